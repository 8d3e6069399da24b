#!/usr/bin/python3
"""Charts of `pickleflight lab stability`: heat maps of the worst failure, and curves of theory.

stability.py FOLDER    reads FOLDER/stability.json, writes stability, stability-curves and stability-frames
                    as .svg and .png beside it
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import sys

import style
from style import COLOURS, FAINT, INK, MARKS, METHODS, np, plt
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, NullLocator

# From harmless to worst. They also differ in lightness, for all kinds of colour vision.
CLASSES = {"fine": "#F4F4F1", "overlap": "#F0E442", "collisions missed": "#56B4E9", "energy too low": "#0072B2",
           "energy too high": "#E69F00", "blown up": "#8B1A1A", "stopped": "#C9C3B5", "collapsed": "#8B1A1A"}
MAPS = [("area fraction", "area_fraction", "area fraction, e = 1"),
        ("restitution", "restitution", "restitution, area fraction 0.2"),
        ("mass ratio", "mass_ratio", "ball over parcel mass")]


def draw_map(axes, rows, value_key, ticks_left):
    steps = sorted({row["step"] for row in rows})
    values = sorted({row[value_key] for row in rows})
    for row in rows:
        x, y = steps.index(row["step"]), values.index(row[value_key])
        axes.add_patch(plt.Rectangle((x - 0.5, y - 0.5), 1, 1, fc=CLASSES[row["class"]], ec="white", lw=1.5))
    axes.set_xlim(-0.5, len(steps) - 0.5)
    axes.set_ylim(-0.5, len(values) - 0.5)
    every = 2 if len(steps) <= 12 else 4  # counted from the longest step; keeps labels apart
    ticks = range((len(steps) - 1) % every, len(steps), every)
    axes.set_xticks(ticks, [f"{steps[tick]:.2g}" for tick in ticks])
    axes.set_yticks(range(len(values)), [f"{value:g}" for value in values] if ticks_left else [""] * len(values))
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return steps, values


def rate(area_fraction):
    """Collisions per disc and d/c: Enskog with Henderson's contact value (1975)."""
    contact = (1 - 7 * area_fraction / 16) / (1 - area_fraction) ** 2
    return 8 * area_fraction * contact / np.sqrt(np.pi)


def step_of_missed(share):
    """Time step, d/c, at which impulse misses this share, the mean of Delta^2 / 6 d^2: colliding pairs have a mean
    square relative speed of 6 c^2 (docs/physics.md, 'Collision rate')."""
    return np.sqrt(share)


def draw_known_edges(axes, method, steps, values):
    """The limit of theory, on the index axes of the map of area fractions; nothing where it is beside the map."""
    at = lambda step: np.interp(np.log(step), np.log(steps), range(len(steps)), left=np.nan, right=np.nan)
    if method == "impulse":
        edge, text = [at(step_of_missed(0.05))] * len(values), "5 % missed: \u27e8\u0394\u00b2\u27e9/6d\u00b2"
    elif method == "spring":
        edge, text = [at(0.05 / (20 * rate(value))) for value in values], "in contact 5 % of the time"
    else:
        return
    axes.plot(edge, range(len(values)), color=INK, lw=1.4, ls=(0, (4, 2)))
    if not np.all(np.isnan(edge)):
        axes.text(np.nanmin(edge), len(values) - 0.45, text, fontsize=7.5, color=INK, ha="left", va="bottom")


def draw_maps(study):
    figure, grid = plt.subplots(len(MAPS), 3, figsize=(11.5, 8.2), height_ratios=[6, 4, 4], squeeze=False)
    figure.subplots_adjust(left=0.085, right=0.985, top=0.84, bottom=0.11, wspace=0.06, hspace=0.34)
    for row_axes, (name, key, label) in zip(grid, MAPS):
        for axes, method in zip(row_axes, METHODS):
            rows = [row for row in study["points"] if row["map"] == name and row["method"] == method]
            if not rows:
                continue
            steps, values = draw_map(axes, rows, key, method == METHODS[0])
            if name == "area fraction":
                axes.set_title(method, color=COLOURS[method], fontsize=12, fontweight="bold", loc="left", pad=16)
                draw_known_edges(axes, method, steps, values)
        row_axes[0].set_ylabel(label)
    for axes in grid[-1]:
        axes.set_xlabel("time step, d/c")
    figure.text(0.01, 0.975, "Worst failure of each method", fontsize=15, color=INK, fontweight="bold", va="top")
    seen = {row["class"] for row in study["points"] if "class" in row} - {"collapsed", "stopped"}
    figure.legend(handles=[Patch(fc=CLASSES[name], ec=FAINT, lw=0.5, label=name) for name in CLASSES if name in seen],
                  loc="upper left", bbox_to_anchor=(0.003, 0.945), ncol=6, frameon=False, fontsize=9.5)
    figure.text(0.01, 0.012, "1,000 discs, 10 collisions each and 16 steps at least (4 beside a heavy disc). From the worst: blown up (10 times the "
                "energy), energy 5 % off the reference in 10 collisions, collisions missed (5 %),\noverlap of 0.1 "
                "diameters. " + style.machine_text(study), fontsize=8, color=FAINT)
    return figure


def points_of(study, name):
    return [row for row in study["points"] if row["map"] == name]


def unseen_share(step):
    """Mean over impact parameters of 1 - chord / step, for chords below the step (docs/physics.md, 'Missed collisions')."""
    if step >= 2:
        return 1 - np.pi / (2 * step)
    phi = np.arcsin(step / 2)
    return 1 - np.cos(phi) / 2 - phi / (2 * np.sin(phi))


def draw_missed(axes, study):
    steps = np.geomspace(0.08, 6, 200)
    axes.plot(steps, [unseen_share(2 * step) for step in steps], color=COLOURS["impulse"], lw=1.5,
              label="impulse: \u0394\u00b2/6d\u00b2, then 1 \u2212 \u03c0d/4\u0394")
    for method in METHODS:
        rows = [row for row in points_of(study, "missed") if row["method"] == method]
        at = [(row["step"], row["missed"], row["sigma"]) for row in rows if row["missed"] > 2 * row["sigma"]]
        if at:
            x, y, sigma = zip(*at)
            axes.errorbar(x, y, sigma, fmt=MARKS[method], ms=5.5, color=COLOURS[method], zorder=4,
                          label=None if method == "impulse" else method)
        bounds = [row for row in rows if row["missed"] <= 2 * row["sigma"]]
        for row in bounds:
            style.arrow_down(axes, row["step"], 2.5 * row["sigma"], COLOURS[method])
        if bounds:
            axes.plot([row["step"] for row in bounds], [2.5 * row["sigma"] for row in bounds], MARKS[method], ms=5.5,
                      mfc="white", mec=COLOURS[method], label=f"{method}: none (upper bounds)")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(bottom=1e-6)  # room for the arrows of upper bounds, and for the legend below them
    axes.set_title("Collisions missed", loc="left")
    axes.set_xlabel("displacement per step, diameters")


def draw_turn(axes, study):
    rows = sorted(points_of(study, "turn"), key=lambda row: row["step"])
    steps = np.geomspace(rows[0]["step"], rows[-1]["step"], 100)
    axes.plot(steps, (1 + steps**2) ** (np.pi / steps) - 1, color=COLOURS["spring"], lw=1.5,
              label="explicit Euler: (1 + \u03b8\u00b2)^(\u03c0/\u03b8) \u2212 1")
    axes.plot([row["step"] for row in rows], [row["euler"] - 1 for row in rows], "o", color=COLOURS["spring"], ms=5.5)
    axes.plot([row["step"] for row in rows], [max(abs(row["rotation"] - 1), 1e-15) for row in rows], "D",
              color=COLOURS["exact"], ms=5.5, label="exact rotation of the program: rounding")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title("Speed gained in one turn of the ball", loc="left")
    axes.set_xlabel("turn per step, radians")


def draw_spring(axes, study):
    rows = sorted(points_of(study, "spring pair"), key=lambda row: row["step"])
    axes.plot([row["step"] for row in rows], [row["energy_ratio"] for row in rows], "-s", color=COLOURS["spring"], ms=5.5,
              label="spring")
    axes.set_yscale("log")
    axes.axvline(2 / np.pi, color=INK, lw=1.2, ls=(0, (4, 2)), label="dt = 2/\u03c9\u2080")
    axes.axhline(1, color=FAINT, lw=0.8)
    axes.set_title("Energy after an elastic contact by spring", loc="left")
    axes.set_xlabel("time step over contact duration")


def draw_fork(axes, study):
    theta = np.radians(np.linspace(30, 60, 100))
    axes.plot(np.degrees(theta), (1 - 2 * np.cos(theta) ** 2) ** 2 + 2 * np.cos(theta) ** 2, color=COLOURS["impulse"],
              lw=1.5)
    for method in METHODS:
        rows = [row for row in points_of(study, "fork") if row["method"] == method]
        axes.plot([row["degrees"] for row in rows], [row["energy_ratio"] for row in rows], MARKS[method], ms=5.5,
                  color=COLOURS[method], mfc=COLOURS[method] if method == "impulse" else "none", label=method)
    kept = next((row["energy_ratio"] for row in points_of(study, "head-on") if row["method"] == "impulse"), None)
    if kept is not None:
        axes.plot([], [], " ", label=f"head-on from both sides,\nimpulse keeps {kept:.3g}")
    axes.set_title("Energy after one disc hits two at once", loc="left")
    axes.set_xlabel("angle of the two to the path, degrees")


def draw_collapse(axes, study):
    rows = points_of(study, "collapse")
    clocks, values = sorted({row["clock"] for row in rows}), sorted({row["restitution"] for row in rows})
    for row in rows:
        x, y = clocks.index(row["clock"]), values.index(row["restitution"])
        axes.add_patch(plt.Rectangle((x - 0.5, y - 0.5), 1, 1, fc=CLASSES[row["class"]], ec="white", lw=1.5))
        if row["reached_share"] < 1:
            axes.text(x, y, f"{100 * row['reached_share']:.0f} %", ha="center", va="center", fontsize=8.5,
                      color="white" if row["class"] == "collapsed" else INK)
    axes.set_xlim(-0.5, len(clocks) - 0.5)
    axes.set_ylim(-0.5, len(values) - 0.5)
    axes.set_xticks(range(len(clocks)), ["off"] + [rf"$10^{{{round(np.log10(clock))}}}$" for clock in clocks[1:]])
    axes.set_yticks(range(len(values)), [f"{value:g}" for value in values])
    axes.set_ylabel("restitution")
    axes.set_xlabel("contact duration times collision rate")
    axes.set_title("Collapse (red), stopped at 2,000 events a disc (grey);\n% of the run reached", loc="left")


def draw_positions(axes, study):
    rows = sorted(points_of(study, "positions"), key=lambda row: row["num_parcels"])
    for key, colour, text in (("float", COLOURS["spring"], "float"), ("fixed", COLOURS["exact"], "fixed point (program)")):
        axes.plot([row["num_parcels"] for row in rows], [row[key] for row in rows], "-o", color=colour, ms=4.5, label=text)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title("Step of positions at the far side, diameters", loc="left")
    axes.set_xlabel("air parcels N")


def draw_curves(study):
    panels = [("missed", draw_missed), ("spring pair", draw_spring), ("fork", draw_fork), ("turn", draw_turn),
              ("collapse", draw_collapse), ("positions", draw_positions)]
    figure, grid = plt.subplots(2, 3, figsize=(13, 7.6))
    figure.subplots_adjust(left=0.055, right=0.985, top=0.88, bottom=0.115, wspace=0.22, hspace=0.42)
    for axes, (name, draw) in zip(grid.flat, panels):
        if points_of(study, name):
            style.tidy(axes)
            draw(axes, study)
            if name != "collapse":
                axes.legend(loc="best", frameon=False, fontsize=9)
            if axes.get_xscale() == "log":
                axes.xaxis.set_minor_locator(NullLocator())
            if axes.get_yscale() == "log":
                axes.yaxis.set_minor_locator(NullLocator())
        else:
            axes.set_visible(False)
        if name == "collapse":
            axes.grid(False)
    figure.text(0.01, 0.975, "Breaking points that theory knows: lines are theory, dots are measured", fontsize=14,
                color=INK, fontweight="bold", va="top")
    figure.text(0.01, 0.012, style.machine_text(study), fontsize=8, color=FAINT)
    return figure


FRAME_AXES = {"restitution": "restitution", "number of parcels": "parcels N", "area fraction": "area fraction",
              "ball speed": "speed of the ball, m/s"}


def draw_frame_axis(axes, rows, axis):
    for method, has_clock in (("impulse", True), ("exact", True), ("exact", False)):
        flown = sorted((row for row in rows if row["axis"] == axis and row["method"] == method and "worst_ms" in row
                        and (row["contact_clock"] > 0) == has_clock), key=lambda row: row["value"])
        if not flown:
            continue
        axes.plot([row["value"] for row in flown], [row["worst_over_mean"] for row in flown],
                  ("-" if has_clock else ":") + MARKS[method], color=COLOURS[method], ms=5.5, lw=1.4,
                  mfc=COLOURS[method] if has_clock else "white",
                  label=method if has_clock else f"{method} without contact duration")
        for row in flown if method == "exact" else []:
            same_value = [other["worst_over_mean"] for other in rows if other["axis"] == axis and
                          other["method"] == method and other["value"] == row["value"] and "worst_ms" in other]
            is_highest = row["worst_over_mean"] == max(same_value)
            axes.annotate(f"{row['worst_ms']:.2g}", (row["value"], row["worst_over_mean"]), (0, 6 if is_highest else -13),
                          fontsize=7.5, textcoords="offset points", ha="center", color=INK if has_clock else FAINT)
    refused = [row for row in rows if row["axis"] == axis and row["refused"]]  # perhaps in the first frame
    axes.plot([row["value"] for row in refused], [row.get("worst_over_mean", 1.0) for row in refused], "x", ms=11, mew=2.2,
              color=CLASSES["blown up"])
    axes.set_yscale("log")
    if axis in ("number of parcels", "ball speed"):
        axes.set_xscale("log")
        values = sorted({row["value"] for row in rows if row["axis"] == axis})
        axes.set_xticks(values, [f"{value:,g}" if value < 1e4 else f"{value / 1000:g}k" for value in values])
        axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_yticks([1, 2, 5, 10, 20, 50, 100, 200, 500])
    axes.set_xlabel(FRAME_AXES[axis])


def draw_frames(study):
    rows = points_of(study, "frames")
    figure, grid = plt.subplots(1, 4, figsize=(13, 4.4), sharey=True)
    figure.subplots_adjust(left=0.055, right=0.985, top=0.8, bottom=0.24, wspace=0.08)
    for axes, axis in zip(grid, FRAME_AXES):
        style.tidy(axes)
        draw_frame_axis(axes, rows, axis)
    ratios = [row["worst_over_mean"] for row in rows if "worst_ms" in row]
    grid[0].set_ylim(0.9, 1.6 * max(ratios))
    grid[0].set_ylabel("worst frame over mean frame")
    figure.legend(*grid[0].get_legend_handles_labels(), loc="upper right", bbox_to_anchor=(0.99, 0.99), ncol=3,
                  frameon=False, fontsize=10)
    figure.text(0.01, 0.965, "How long the worst frame of a flight over the court takes", fontsize=14, color=INK,
                fontweight="bold", va="top")
    figure.text(0.01, 0.02, "Figures: worst frame of exact, milliseconds. Two threads; one setting of the court changed at a "
                "time; of each frame the shortest time of 4 to 8 flights. A cross: refused.\n" + style.machine_text(study),
                fontsize=8, color=FAINT)
    return figure


def main():
    where = style.folder()
    study = style.load(where, "stability")
    if not {row["class"] for row in study["points"] if "class" in row} <= set(CLASSES):
        sys.exit("stability.json is of an earlier program, whose steps were not those of its columns; measure again")
    style.prepare("stability")
    style.save(draw_maps(study), where, "stability")
    style.save(draw_curves(study), where, "stability-curves")
    if any("worst_ms" in row for row in points_of(study, "frames")):
        style.save(draw_frames(study), where, "stability-frames")


if __name__ == "__main__":
    main()
