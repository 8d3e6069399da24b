#!/usr/bin/python3
"""Charts of `pickleflight lab work-precision`: error against cost, and orders of convergence.

work-precision.py FOLDER    reads FOLDER/work-precision.json, writes work-precision.svg/.png and
                            work-precision-order.svg/.png beside it
work-precision.py FOLDER --panel ERROR AREA_FRACTION E FILE    draws one panel alone, larger, as FILE (.png or .svg):
                            ERROR is rate, pressure, energy, path or drag, E the restitution
work-precision.py FOLDER --flight FILE    draws a gas at rest beside the layer in front of a flying ball, which
                            FOLDER/gas-dynamics.json holds
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import pathlib
import sys
import textwrap

import style
from style import COLOURS, FAINT, INK, MARKS, METHODS, plt
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

ERRORS = [("rate", "collision rate"), ("pressure", "pressure"), ("energy", "energy, per 10 collisions"),
          ("path", "ball: path"), ("drag", "ball: drag")]
FLOOR = 1e-7  # smaller errors of energy are drawn here
PALE = {"impulse": "#B3D4E8", "spring": "#F3CDB2", "exact": "#B2DDD0"}


def rows_of(study, error, device, eta, restitution, group=None):
    group = group or ("ball" if error in ("path", "drag") else "gas")
    return [row for row in study["points"] if row["group"] == group and row["device"] == device
            and row["area_fraction"] == eta and row["restitution"] == restitution and error in row.get("errors", {})]


def look_of(method, device):
    """Dots of the CPU are filled; dots of a CUDA device have a pale core and a rim of the same colour."""
    return dict(mew=1.2, mfc=COLOURS[method]) if device == "cpu" else dict(mew=1.7, mfc=PALE[method])


def draw_method(axes, rows, error, method, device):
    chosen = sorted((row for row in rows if row["method"] == method), key=lambda row: row["ns_per_disc_time"])
    for row in chosen:
        entry, cost = row["errors"][error], row["ns_per_disc_time"]
        if entry.get("yardstick"):
            axes.axvline(cost, color=COLOURS[method], lw=1.2, ls=(0, (1, 2)), zorder=1)
            continue
        value = max(entry["value"], FLOOR)
        bound = entry["bound"] or entry["value"] < FLOOR
        axes.plot(cost, value, MARKS[method], ms=5.2, mec=COLOURS[method], zorder=4,
                  **{**look_of(method, device), **({"mfc": "white"} if bound else {})})
        if bound:
            style.arrow_down(axes, cost, value, COLOURS[method])
        elif entry["sigma"] > 0.0:
            low = max(value - entry["sigma"], value * 0.1)
            axes.plot([cost, cost], [low, value + entry["sigma"]], color=COLOURS[method], lw=1.0, zorder=3)


def draw_front(axes, rows, error, device):
    front = sorted(((row["ns_per_disc_time"], max(row["errors"][error]["value"], FLOOR)) for row in rows
                    if row["errors"][error].get("front")))
    if len(front) > 1:
        axes.plot(*zip(*front), color=INK, lw=6 if device == "cpu" else 3, alpha=0.10 if device == "cpu" else 0.22, zorder=2,
                  solid_capstyle="round", solid_joinstyle="round")


def draw_panel(axes, study, error, eta, restitution, group=None):
    axes.set_xscale("log")
    axes.set_yscale("log")
    for device in dict.fromkeys(row["device"] for row in study["points"]):
        rows = rows_of(study, error, device, eta, restitution, group)
        for method in METHODS:
            draw_method(axes, rows, error, method, device)
        draw_front(axes, rows, error, device)
    style.tidy(axes)
    axes.yaxis.set_major_formatter(FuncFormatter(style.percent))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())


def share_limits(row_axes):
    low = min(axes.get_ylim()[0] for axes in row_axes)
    high = min(max(axes.get_ylim()[1] for axes in row_axes), 30.0)
    for axes in row_axes:
        axes.set_ylim(low, high)
        axes.yaxis.set_major_locator(LogLocator(base=100.0 if high / low > 1e5 else 10.0, numticks=9))


def add_legend(figure, study, corner=(0.99, 0.985)):
    """Legend of methods and devices, above the panels. corner: its upper right one, as shares of the figure."""
    handles = [Line2D([], [], ls="", marker=MARKS[method], ms=6, color=COLOURS[method], label=method) for method in METHODS]
    devices = list(dict.fromkeys(row["device"] for row in study["points"]))
    if len(devices) > 1:
        names = {}  # a study may have been resumed on another machine
        for entry in study["machine"]["devices"]:
            names.setdefault(entry["series"], []).append(entry["device"])
        handles += [Line2D([], [], ls="", marker="o", ms=6, mec=INK, mew=1.2 if device == "cpu" else 1.7,
                           mfc=INK if device == "cpu" else "#D8D8D8", label="; ".join(names.get(device, [device]))) for device in devices]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=corner, ncol=len(handles), frameon=False,
                  fontsize=10, handletextpad=0.2, columnspacing=1.2)


def draw(study):
    cases = sorted({(row["restitution"], row["area_fraction"]) for row in study["points"] if row["group"] == "gas"},
                   key=lambda case: (-case[0], case[1]))
    # A run that was ended early has not measured all.
    errors = [(error, title) for error, title in ERRORS
              if any(error in row.get("errors", {}) for row in study["points"])] or ERRORS
    width, height = 2.55 * len(cases) + 1.0, 2.1 * len(errors) + 1.2
    figure, grid = plt.subplots(len(errors), len(cases), figsize=(width, height), sharex="col", squeeze=False)
    figure.subplots_adjust(left=0.085, right=0.985, top=1.0 - 1.11 / height, bottom=0.88 / height, wspace=0.12, hspace=0.16)
    for row_axes, (error, title) in zip(grid, errors):
        for axes, (restitution, eta) in zip(row_axes, cases):
            axes.case = (eta, restitution)
            draw_panel(axes, study, error, eta, restitution)
        share_limits(row_axes)
        for axes in row_axes[1:]:
            axes.tick_params(labelleft=False)
        row_axes[0].set_ylabel(title)
    for axes in grid[0]:
        axes.set_title(f"area fraction {axes.case[0]:g}, e = {axes.case[1]:g}", loc="left", fontsize=9.5, color=INK)
    add_legend(figure, study)
    figure.text(0.01, 1.0 - 0.29 / height, "Error against cost", fontsize=15, color=INK, fontweight="bold", va="top")
    reading = ("Lower is more accurate, further left is cheaper. Grey: the front that no other dot beats. Hollow with arrow: "
               "upper bound. Dotted line: cost of exact where it is the reference.")
    figure.text(0.01, 1.0 - 0.58 / height, textwrap.fill(reading, int(14.5 * width)), fontsize=9.5, color=FAINT, va="top")
    figure.supxlabel("nanoseconds per disc and time d/c (diameter over thermal speed)", fontsize=10.5, color=INK, y=0.33 / height)
    figure.text(0.01, 0.07 / height, style.machine_text(study), fontsize=8, color=FAINT)
    return figure


def draw_order(axes, study, rows, method):
    """Error over time step of one method, labelled with its order of convergence."""
    steps, values = [row["dt"] for row in rows], [row["path_error"] for row in rows]
    order = next((entry["order"] for entry in study["orders"]
                  if entry["method"] == method and entry["area_fraction"] == rows[0]["area_fraction"]
                  and entry.get("device", "cpu") == "cpu"), None)
    axes.plot(steps, values, color=COLOURS[method], lw=1.2, alpha=0.5, zorder=2)
    axes.errorbar(steps, values, fmt=MARKS[method], ms=5.5, color=COLOURS[method], elinewidth=1.0, zorder=3,
                  yerr=[[row["path_error"] - row["path_low"] for row in rows],
                        [row["path_high"] - row["path_error"] for row in rows]],
                  label=method if order is None else f"{method} {order:.2f}")


def draw_orders(study):
    rows = [row for row in study["points"] if row["group"] == "parcel-path" and row["device"] == "cpu"]
    etas = sorted({row["area_fraction"] for row in rows})
    figure, grid = plt.subplots(1, len(etas), figsize=(3.9 * len(etas), 4.5), sharey=True, squeeze=False)
    figure.subplots_adjust(left=0.085, right=0.96, top=0.77, bottom=0.2, wspace=0.1)
    for axes, eta in zip(grid[0], etas):
        axes.set_xscale("log")
        axes.set_yscale("log")
        for method in METHODS:
            chosen = [row for row in rows if row["method"] == method and row["area_fraction"] == eta]
            if chosen:
                draw_order(axes, study, sorted(chosen, key=lambda row: row["dt"]), method)
        style.tidy(axes)
        legend = axes.legend(loc="lower left", bbox_to_anchor=(-0.03, 0.985), ncol=len(METHODS), frameon=False, fontsize=9.5,
                             handletextpad=0.2, columnspacing=1.0)
        for text in legend.get_texts():  # labelcolor="linecolor" fails with error bars before matplotlib 3.7
            text.set_color(COLOURS[text.get_text().split()[0]])
        axes.set_title(f"area fraction {eta:g}", loc="left", color=INK, pad=26)
        axes.set_xlabel("time step, d/c")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_locator(NullLocator())
    grid[0][0].set_ylabel("distance from the reference, diameters")
    figure.text(0.01, 0.965, "Order of convergence: parcels after one collision each against the double-precision "
                "reference", fontsize=12, color=INK, fontweight="bold", va="top")
    figure.text(0.01, 0.015, "Median over the parcels that collided, with its 95 % interval. Numbers: order of convergence, "
                "fitted between 1e-5 and 0.1 diameters.\n" + style.machine_text(study), fontsize=8, color=FAINT)
    return figure


def draw_parcels(study):
    """Scatter of the flight over the seeds and distance of the mean from many parcels against N; errors of the methods."""
    rows = sorted((row for row in study["points"] if row["group"] == "parcels" and "ends" in row),
                  key=lambda row: row["num_parcels"])
    figure, grid = plt.subplots(1, 2, figsize=(11.5, 4.6))
    figure.subplots_adjust(left=0.075, right=0.985, top=0.8, bottom=0.24, wspace=0.2)
    sizes = [row["num_parcels"] for row in rows]
    for axes, (error, title) in zip(grid, (("path", "path of the ball, share of its length"),
                                           ("drag", "loss of speed, share of the loss"))):
        axes.set_xscale("log")
        axes.set_yscale("log")
        entries = [row["errors"][error] for row in rows]
        axes.errorbar(sizes, [entry["scatter"] for entry in entries], [entry["sigma"] for entry in entries], fmt="-o",
                      color=INK, ms=5.5, lw=1.4, zorder=4, label="scatter over 16 seeds")
        middle = len(sizes) // 2
        law = [entries[middle]["scatter"] * (sizes[middle] / size) ** 0.5 for size in sizes]
        axes.plot(sizes, law, color=FAINT, lw=1.0, ls=(0, (4, 2)), zorder=2, label=r"$1/\sqrt{N}$")
        axes.errorbar(sizes, [abs(entry["shift"]) for entry in entries], [entry["shift_sigma"] for entry in entries], fmt="-^",
                      color=FAINT, ms=5.5, lw=1.4, zorder=3, label="mean against many parcels")
        draw_method_errors(axes, study, error, {"impulse": sizes[-1] * 2.0, "spring": sizes[-1] * 4.5})
        style.tidy(axes)
        axes.legend(loc="lower left", frameon=False, fontsize=9.5)  # empty, since the scatter falls with N
        axes.set_title(title, loc="left", color=INK)
        axes.set_xlabel("air parcels N")
        axes.set_xlim(sizes[0] * 0.8, sizes[-1] * 8.0)
        axes.set_ylim(top=1.6 * axes.get_ylim()[1])  # room for the names of the methods
        axes.yaxis.set_major_formatter(FuncFormatter(style.percent))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_locator(NullLocator())
    figure.text(0.01, 0.965, "A method's error only matters above that of the number of parcels",
                fontsize=13.5, color=INK, fontweight="bold", va="top")
    figure.text(0.01, 0.015, "Court, area fraction 0.1, e = 0.9, exact. Dots on the right: errors of the methods at area fraction 0.05, "
                "e = 0.9, by displacement per step [diameters];\nmean over the seeds against exact; hollow: upper bound. "
                "Bars: standard errors.\n" + style.machine_text(study), fontsize=8, color=FAINT)
    return figure


def draw_method_errors(axes, study, error, places):
    """Errors of the methods as dots on the right, labelled with the displacement per step."""
    etas = sorted({row["area_fraction"] for row in study["points"] if row["group"] == "ball"})
    rows = [row for row in study["points"] if row["group"] == "ball" and row["restitution"] == 0.9
            and row["device"] == "cpu" and row["area_fraction"] == etas[0] and row["method"] != "exact"
            and row["errors"].get(error, {}).get("value") is not None]
    for row in rows:
        entry, method = row["errors"][error], row["method"]
        at = places[method]
        axes.plot(at, entry["value"], MARKS[method], ms=5.5, mec=COLOURS[method], zorder=4,
                  mfc="white" if entry["bound"] else COLOURS[method])
        if entry["bound"]:
            style.arrow_down(axes, at, entry["value"], COLOURS[method])
        else:
            low = max(entry["value"] - entry["sigma"], 0.1 * entry["value"])
            axes.plot([at, at], [low, entry["value"] + entry["sigma"]], color=COLOURS[method], lw=1.0, zorder=3)
            axes.annotate(f"{row['displacement_per_step']:g}", (at, entry["value"]), xytext=(6, 0), va="center",
                          textcoords="offset points", color=COLOURS[method], fontsize=8)
    for method in ("impulse", "spring"):
        mine = [entry["value"] + entry["sigma"] for entry in (row["errors"][error] for row in rows if row["method"] == method)]
        if mine:
            axes.annotate(method, (places[method], max(mine)), xytext=(0, 9), textcoords="offset points", ha="center",
                          color=COLOURS[method], fontsize=10, fontweight="bold")


def draw_panel_alone(study, error, eta, restitution):
    figure, axes = plt.subplots(figsize=(8.6, 4.7))
    figure.subplots_adjust(left=0.095, right=0.975, top=0.735, bottom=0.175)
    draw_panel(axes, study, error, eta, restitution)
    share_limits([axes])
    axes.set_ylim(bottom=0.55 * axes.get_ylim()[0])  # room for the arrows of upper bounds
    title = dict(ERRORS)[error]
    axes.set_ylabel(f"error of the {title}" if ":" not in title else f"error, {title}")
    axes.set_xlabel("nanoseconds per disc and time d/c (diameter over thermal speed)")
    add_legend(figure, study, (0.985, 0.82))
    figure.text(0.015, 0.965, "Error against cost", fontsize=15, color=INK, fontweight="bold", va="top")
    figure.text(0.015, 0.885, f"Hard discs, area fraction {eta:g}, e = {restitution:g}. Lower is more accurate, left is cheaper. "
                "Grey: no other dot beats these. Arrow: upper bound.", fontsize=9, color=FAINT, va="top")
    figure.text(0.015, 0.02, style.machine_text(study), fontsize=7, color=FAINT)
    return figure


def with_devices_of(study, beside):
    """The study, whose devices also name those of another study in the right panel, where they differ."""
    names = {entry["series"]: entry["device"] for entry in beside["machine"]["devices"]}
    all_devices = [dict(entry) for entry in study["machine"]["devices"]]
    devices = [entry for k, entry in enumerate(all_devices)  # the first of each series, which most rows are of
               if entry["series"] not in (before["series"] for before in all_devices[:k])]
    for entry in devices:
        other = names.get(entry["series"], entry["device"])
        if other != entry["device"]:
            entry["device"] += f" (right: {other})"
    return {**study, "machine": {**study["machine"], "devices": devices}}


def draw_flight(study, layers):
    """A gas at rest beside the layer in front of the ball: what is right for one may fail in the other."""
    figure, grid = plt.subplots(1, 2, figsize=(11.2, 4.9))
    figure.subplots_adjust(left=0.075, right=0.985, top=0.70, bottom=0.175, wspace=0.2)
    layer = {**layers, "points": layers["layer"]}
    at = layer["points"][0]
    draw_panel(grid[0], study, "rate", 0.2, 1.0)
    draw_panel(grid[1], layer, "drag", at["area_fraction"], at["restitution"], "layer")
    grid[0].set_ylabel("error of the collision rate")
    grid[1].set_ylabel("error of the ball's drag")
    grid[0].set_title("A gas at rest, area fraction 0.2", loc="left")
    grid[1].set_title(f"The layer in front of a ball at S = 2, area fraction {at['area_fraction']:g}", loc="left")
    for axes in grid:
        share_limits([axes])
        axes.set_ylim(bottom=0.55 * axes.get_ylim()[0])  # room for the arrows of upper bounds
        axes.set_xlabel("nanoseconds per disc and time d/c (diameter over thermal speed)")
    grid[1].set_xlabel("nanoseconds per disc and time d/c; on the CPU of one thread")
    add_legend(figure, with_devices_of(study, layers), (0.985, 0.855))
    figure.text(0.012, 0.97, "Error against cost", fontsize=15, color=INK, fontweight="bold", va="top")
    figure.text(0.012, 0.893, "Lower is more accurate, left is cheaper. Grey: no other dot beats these. Arrow: upper bound. "
                "Dotted: cost of exact, the measure of the others.", fontsize=9, color=FAINT, va="top")
    figure.text(0.012, 0.01, f"Left: {style.machine_text(study)}\nRight: {style.machine_text(layers)}", fontsize=7, color=FAINT)
    return figure


def flight(folder, file):
    where = pathlib.Path(folder)
    layers = style.load(where, "gas-dynamics")
    if not layers.get("layer"):
        sys.exit(f"{folder}/gas-dynamics.json holds no layer")
    style.prepare("work-precision-flight")
    figure = draw_flight(style.load(where, "work-precision"), layers)
    figure.savefig(file, dpi=120, metadata={"Software": None} if file.endswith(".png") else {"Date": None})


def panel_alone(folder, error, eta, restitution, file):
    study = style.load(pathlib.Path(folder), "work-precision")
    if error not in dict(ERRORS) or not rows_of(study, error, "cpu", float(eta), float(restitution)):
        sys.exit(f"{folder} holds no {error} at area fraction {eta}, e = {restitution}")
    style.prepare("work-precision-panel")
    figure = draw_panel_alone(study, error, float(eta), float(restitution))
    figure.savefig(file, dpi=120, metadata={"Software": None} if file.endswith(".png") else {"Date": None})


def main():
    if len(sys.argv) == 7 and sys.argv[2] == "--panel":
        return panel_alone(sys.argv[1], *sys.argv[3:])
    if len(sys.argv) == 4 and sys.argv[2] == "--flight":
        return flight(sys.argv[1], sys.argv[3])
    where = style.folder()
    study = style.load(where, "work-precision")
    style.prepare("work-precision")
    if any(row["group"] == "gas" for row in study["points"]):
        style.save(draw(study), where, "work-precision")
    if any(row["group"] == "parcel-path" for row in study["points"]):
        style.save(draw_orders(study), where, "work-precision-order")
    if any(row["group"] == "parcels" and "scatter" in row.get("errors", {}).get("path", {}) for row in study["points"]):
        style.save(draw_parcels(study), where, "work-precision-parcels")


if __name__ == "__main__":
    main()
