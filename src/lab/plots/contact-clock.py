#!/usr/bin/python3
"""Chart of `pickleflight lab contact-clock`: what the contact duration of `exact` changes, and what it saves.

contact-clock.py FOLDER    reads FOLDER/contact-clock.json, writes contact-clock.svg and contact-clock.png beside it
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import style
from style import FAINT, INK, np, plt
from matplotlib.ticker import FuncFormatter, NullLocator

GAS, FLIGHTS = "#009E73", {0.9: "#0072B2", 0.5: "#D55E00", 0.0: "#CC79A7"}
MARKS = {0.9: "o", 0.5: "s", 0.0: "^"}
OFF = 3e-6  # where the flights without a contact duration are drawn


def rows_of(study, case, restitution, name):
    rows = [row for row in study["points"]
            if row["case"] == case and row["restitution"] == restitution and name in row]
    return sorted(rows, key=lambda row: row["clock"])


def draw(axes, rows, name, **look):
    rows = [row for row in rows if row["clock"] > 0]
    axes.errorbar([row["clock"] for row in rows], [row[name] for row in rows], [row[f"{name}_sigma"] for row in rows],
                  ms=5.5, lw=1.2, capsize=2, **look)


def draw_gas(axes, study):
    rows = rows_of(study, "gas", 0.9, "rate")
    draw(axes, rows, "rate", color=GAS, fmt="-D", label="collisions")
    draw(axes, rows, "energy", color=GAS, fmt=":o", mfc="white", label="energy left")
    axes.set_title("Cooling gas, e = 0.9, area fraction 0.2", loc="left")


def draw_flights(axes, study, name, title):
    for restitution, colour in FLIGHTS.items():
        draw(axes, rows_of(study, "flight", restitution, name), name, color=colour, fmt=f"-{MARKS[restitution]}",
             label=f"e = {restitution:g}")
    axes.set_title(title, loc="left")


def draw_cost(axes, study):
    for restitution, colour in FLIGHTS.items():
        rows = rows_of(study, "flight", restitution, "collisions")
        axes.plot([row["clock"] or OFF for row in rows], [row["collisions"] for row in rows], f"-{MARKS[restitution]}",
                  color=colour, ms=5.5, lw=1.2, label=f"e = {restitution:g}")
    axes.set_yscale("log")
    axes.set_ylim(4, 200)
    axes.set_title("Court: collisions of a parcel in 0.6 s, the cost", loc="left")


def finish(axes, study, case):
    style.tidy(axes)
    axes.set_xscale("log")
    default = next((row["default_clock"] for row in study["points"] if row["case"] == case), None)
    if default is not None:
        axes.axvline(default, color=INK, lw=1.2, ls=(0, (4, 2)), zorder=1)
    axes.set_xticks([1e-5, 1e-4, 1e-3, 1e-2, 1e-1])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.legend(loc="best", frameon=False, fontsize=9.5)
    axes.set_xlabel("contact duration, mean free times" + ("" if case == "gas" else " of the fastest body"))
    if axes.get_yscale() == "log":
        axes.set_xticks([OFF, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1], ["off"] + [rf"$10^{{{k}}}$" for k in (-5, -4, -3, -2, -1)])
        axes.set_yticks([5, 7, 10, 20, 50, 100], ["5", "7", "10", "20", "50", "100"])
        axes.yaxis.set_minor_locator(NullLocator())
        return
    axes.axhline(0, color=FAINT, lw=0.8, zorder=1)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:+.3g} %" if abs(value) > 1e-12 else "0"))


def main():
    where = style.folder()
    study = style.load(where, "contact-clock")
    if not any("rate" in row for row in study["points"]):
        return
    style.prepare("contact-clock")
    figure, grid = plt.subplots(2, 2, figsize=(11, 7.6))
    figure.subplots_adjust(left=0.08, right=0.985, top=0.86, bottom=0.125, wspace=0.2, hspace=0.42)
    draw_gas(grid[0, 0], study)
    draw_flights(grid[0, 1], study, "path", "Court: distance flown in 0.6 s")
    draw_flights(grid[1, 0], study, "drag", "Court: speed lost in 0.6 s (drag)")
    draw_cost(grid[1, 1], study)
    for axes in np.ravel(grid):
        finish(axes, study, "gas" if axes is grid[0, 0] else "flight")
    figure.text(0.01, 0.975, "What the contact duration changes", fontsize=15, color=INK, fontweight="bold", va="top")
    figure.text(0.01, 0.93, "Differences from the same run without one; dashed: the default", fontsize=10.5, color=FAINT,
                va="top")
    runs = {row["case"]: len(row["runs"]) for row in study["points"]}
    figure.text(0.01, 0.012, "Means over " + " and ".join(f"{num} seeds ({case})" for case, num in sorted(runs.items()))
                + f", with standard errors.\n{study['command']}.", fontsize=8, color=FAINT)
    style.save(figure, where, "contact-clock")


if __name__ == "__main__":
    main()
