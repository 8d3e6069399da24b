#!/usr/bin/python3
"""Chart of `pickleflight lab gas-dynamics`: shocks, blasts, the ball in a stream, and what the methods cost there.

gas-dynamics.py FOLDER    reads FOLDER/gas-dynamics.json, writes gas-dynamics.svg and gas-dynamics.png beside it
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import style
from style import COLOURS, FAINT, INK, MARKS, np, plt

FIGURES = {"density": ("density", "#0072B2", "o"), "temperature": ("temperature", "#D55E00", "s"),
           "pressure": ("pressure", "#009E73", "D"), "front_speed": ("speed of the front", "#CC79A7", "^")}


def best_device(rows):
    """Of a group that several devices measured, the GPU: it has more parcels."""
    return [row for row in rows if row["device"] == "cuda"] or rows


def rows_of(study, group, **wanted):
    rows = [row for row in study.get("table", []) if row["group"] == group
            and all(row.get(name) == value for name, value in wanted.items()) and row["error"] is not None]
    return [row for row in rows if row["device"] == "cpu"] if group == "layer" else best_device(rows)


def short(case):
    return case.replace("area fraction ", "η ").replace(", Mach ", "\nMach ")


def draw_jumps(axes, study):
    cases = list(dict.fromkeys(row["case"] for row in rows_of(study, "shock", method="exact")))
    for shift, (name, (label, colour, mark)) in zip((-0.24, -0.08, 0.08, 0.24), FIGURES.items()):
        rows = rows_of(study, "shock", method="exact", figure=name)
        axes.errorbar([cases.index(row["case"]) + shift for row in rows], [100 * row["error"] for row in rows],
                      [100 * row["sigma"] for row in rows], fmt=mark, color=colour, ms=5.5, capsize=2, lw=1.2,
                      label=label)
    allowed = 100 * max((row["allowed"] for row in rows_of(study, "shock", method="exact")), default=0.005)
    axes.axhspan(-allowed, allowed, color="#F2F2F2", zorder=0)
    axes.axhline(0, color=FAINT, lw=0.8)
    axes.set_xticks(range(len(cases)), [short(case) for case in cases])
    axes.set_ylabel("difference from theory, %")
    axes.set_title(f"Shocks by exact: jumps and speed; grey: {allowed:g} %", loc="left")
    axes.legend(frameon=False, fontsize=8.5, ncols=2)


def draw_profile(axes, study):
    runs = best_device([row for row in study["points"] if row["group"] == "shock" and row["method"] == "exact"
                        and "profile" in row])
    if not runs:
        return
    run = max(runs, key=lambda row: (row["area_fraction"] == 0.01, -row["mach"]))
    x, density, _, temperature = np.array(run["profile"], dtype=float).T
    axes.plot(x, density, color=FIGURES["density"][1], lw=1.2, label="density")
    axes.plot(x, temperature, color=FIGURES["temperature"][1], lw=1.2, label="temperature")
    for name in ("density", "temperature"):
        axes.axhline(run[f"{name}_theory"], color=FIGURES[name][1], lw=0.9, ls=(0, (4, 2)))
    axes.set_xlabel("distance from the middle, mean free paths ahead of the shock")
    axes.set_ylabel("over that ahead")
    axes.set_title(f"One run: {run['case']}; dashed: theory", loc="left")
    axes.legend(frameon=False, fontsize=8.5)


def draw_blast(axes, study):
    runs = best_device([row for row in study["points"] if row["group"] == "blast"])
    for colour, fraction in zip(("#0072B2", "#D55E00", "#009E73"), sorted({row["area_fraction"] for row in runs})):
        curves = [np.array(row["samples"], dtype=float) for row in runs if row["area_fraction"] == fraction]
        radii = np.array([curve[:, 1] for curve in curves])
        seen = (radii > 0).all(axis=0)  # 0: no front was found yet
        time, radius = curves[0][seen, 0], radii[:, seen].mean(axis=0)
        axes.loglog(time, radius, "o", color=colour, ms=3.5, label=f"area fraction {fraction:g}")
        axes.loglog(time, np.sqrt(time), color=colour, lw=0.9, ls=(0, (4, 2)))
    axes.set_xlabel("time, over that of one mean free path")
    axes.set_ylabel("radius of the front, mean free paths")
    axes.set_title("Blast; dashed: Taylor, von Neumann, Sedov", loc="left")
    if runs:
        axes.legend(frameon=False, fontsize=8.5)


def draw_drag(axes, study):
    rows = sorted((row for row in rows_of(study, "drag", figure="drag coefficient over free-molecular")
                   if row["radius_over_path"] > 0), key=lambda row: row["radius_over_path"])
    if not rows:
        return
    axes.errorbar([row["radius_over_path"] for row in rows], [row["measured"] for row in rows],
                  [row["sigma"] * row["expected"] for row in rows], fmt="-D", color=COLOURS["exact"], ms=5, lw=1.2,
                  capsize=2)
    axes.axhline(rows[0]["expected"], color=INK, lw=0.9, ls=(0, (4, 2)))
    axes.text(rows[0]["radius_over_path"], rows[0]["expected"] * 1.01, "free-molecular", fontsize=8.5, color=INK,
              va="bottom")
    axes.set_xscale("log")
    axes.set_ylim(0, 3.6)
    axes.set_xlabel("ball radius over mean free path")
    axes.set_ylabel("drag coefficient, F / (ρ V² R)")
    axes.set_title("Drag of a smooth held ball at S = 2", loc="left")


def draw_layer(axes, study):
    floor = max([row["sigma"] for row in rows_of(study, "layer", method="exact")] or [0.0])
    for method in ("impulse", "spring"):
        rows = sorted(rows_of(study, "layer", method=method), key=lambda row: row["ns_per_disc_time"])
        axes.errorbar([row["ns_per_disc_time"] for row in rows], [100 * row["error"] for row in rows],
                      [100 * row["sigma"] for row in rows], fmt=f"-{MARKS[method]}", color=COLOURS[method],
                      ms=5.5, lw=1.2, capsize=2, label=method)
        for row in rows:
            axes.annotate(f"{row['displacement_per_step']:g}", (row["ns_per_disc_time"], 100 * row["error"]),
                          fontsize=7.5, color=FAINT, xytext=(5, 5), textcoords="offset points")
    for row in rows_of(study, "layer", method="exact"):
        axes.axvline(row["ns_per_disc_time"], color=COLOURS["exact"], lw=1.2, ls=(0, (4, 2)), label="exact")
    axes.axhspan(-100 * floor, 100 * floor, color="#F2F2F2", zorder=0)
    axes.axhline(0, color=FAINT, lw=0.8)
    if rows_of(study, "layer"):  # a logarithmic axis without data cannot be drawn
        axes.set_xscale("log")
        axes.legend(frameon=False, fontsize=8.5)
    axes.set_xlabel("cost, ns per disc and time d/c; numbers: displacement per step")
    axes.set_ylabel("drag against exact, %")
    axes.set_title("A layer as that of the court's ball (η 0.1, R/λ 3.45), at S = 2, e = 1", loc="left")


def draw_methods(axes, study):
    rows = rows_of(study, "shock", method="impulse") + rows_of(study, "shock", method="spring")
    for name, (label, colour, mark) in FIGURES.items():
        for method, fill in (("impulse", colour), ("spring", "white")):
            chosen = sorted((row for row in rows if row["figure"] == name and row["method"] == method),
                            key=lambda row: row["displacement_per_step"])
            axes.errorbar([row["displacement_per_step"] for row in chosen], [100 * row["error"] for row in chosen],
                          [100 * row["sigma"] for row in chosen], fmt=f"-{mark}", color=colour, mfc=fill, ms=5.5, lw=1,
                          capsize=2, label=label if method == "impulse" else None)
    axes.axhline(0, color=FAINT, lw=0.8)
    if rows:
        axes.set_xscale("log")
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(top=max(10.0, 300.0 * max(row["error"] + row["sigma"] for row in rows)))
        axes.legend(frameon=False, fontsize=8.5)
    axes.set_xlabel("displacement per step, diameters")
    axes.set_ylabel("difference from theory, %")
    axes.set_title("Shocks by impulse (filled) and spring (hollow)", loc="left")


def main():
    where = style.folder()
    study = style.load(where, "gas-dynamics")
    style.prepare("gas-dynamics")
    figure, grid = plt.subplots(3, 2, figsize=(11, 11.4))
    figure.subplots_adjust(left=0.075, right=0.985, top=0.92, bottom=0.075, wspace=0.2, hspace=0.36)
    draw_jumps(grid[0, 0], study)
    draw_profile(grid[0, 1], study)
    draw_blast(grid[1, 0], study)
    draw_drag(grid[1, 1], study)
    draw_layer(grid[2, 0], study)
    draw_methods(grid[2, 1], study)
    for axes in grid.flat:
        style.tidy(axes)
    figure.text(0.01, 0.985, study["title"], fontsize=15, color=INK, fontweight="bold", va="top")
    figure.text(0.01, 0.01, style.machine_text(study), fontsize=8, color=FAINT)
    style.save(figure, where, "gas-dynamics")


if __name__ == "__main__":
    main()
