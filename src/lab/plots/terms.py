#!/usr/bin/python3
"""Chart of `pickleflight lab terms`: effect of leaving out a term on the flight, and its cost.

terms.py FOLDER    reads FOLDER/terms.json, writes terms.svg and terms.png beside it
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import style
from terms_text import saved_text
from style import FAINT, INK, plt
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, NullLocator

PLACE, SPEED, COST = "#0072B2", "#E69F00", "#999999"
VERDICTS = {"keep": "#D55E00", "leave out": "#009E73", "not resolved": FAINT}
FLOOR = 1e-5


def draw_effects(axes, rows, tolerance):
    axes.set_xscale("log")
    for y, row in enumerate(rows):
        for shift, value, sigma, colour in ((-0.15, row["exit_shift"], row["exit_shift_sigma"], PLACE),
                                            (0.15, abs(row["speed_shift"]), row["speed_shift_sigma"], SPEED)):
            if value < 2.0 * sigma:  # an upper bound
                axes.barh(y + shift, value + 2.0 * sigma - FLOOR, left=FLOOR, height=0.26, fc="none", ec=colour, lw=1.2,
                          ls=(0, (3, 2)), zorder=3)
                continue
            axes.barh(y + shift, max(value, FLOOR) - FLOOR, left=FLOOR, height=0.26, color=colour, zorder=3)
            axes.plot([max(value - sigma, FLOOR), value + sigma], [y + shift] * 2, color=INK, lw=1.1, zorder=4)
    axes.axvline(tolerance, color=INK, lw=1.2, ls=(0, (4, 2)), zorder=5)
    axes.set_xlim(FLOOR, 2)
    axes.text(tolerance, -0.62, f"tolerance {100 * tolerance:g} %", ha="center", va="bottom", fontsize=9, color=INK)
    axes.set_yticks(range(len(rows)), [row["term"] for row in rows], fontsize=10)
    axes.set_ylim(len(rows) - 0.5, -0.65)
    axes.xaxis.set_major_formatter(FuncFormatter(style.percent))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_title("Change of the flight without the term", loc="left", pad=20)
    axes.set_xlabel("share of the path's length, or of the speed")


def draw_costs(axes, rows, full_ms):
    for y, row in enumerate(rows):
        saved, sigma = 100 * (row["saved_share"] or 0.0), 100 * (row.get("saved_share_sigma") or 0.0)
        axes.barh(y, saved, height=0.4, color=COST, zorder=3)
        axes.plot([saved - sigma, saved + sigma], [y, y], color=INK, lw=1.1, zorder=4)
        axes.text(max(saved + sigma, 0) + 3, y, saved_text(row), va="center", fontsize=9.5, color=INK)
        axes.text(150, y, row["verdict"], va="center", ha="right", fontsize=10.5, fontweight="bold",
                  color=VERDICTS[row["verdict"]])
    axes.set_yticks([])
    axes.set_xlim(0, 150)
    axes.set_ylim(len(rows) - 0.5, -0.65)
    axes.set_xticks([0, 50, 100], ["0", "50", "100 %"])
    axes.set_title(f"Cost, of {full_ms:,.0f} ms per simulated s", loc="left", pad=20)


def main():
    where = style.folder()
    study = style.load(where, "terms")
    style.prepare("terms")
    rows = [row for row in study["points"] if "verdict" in row]
    full = next((row for row in study["points"] if row["term"] == ""), None)
    if not rows or full is None:
        return
    figure, (effects, costs) = plt.subplots(1, 2, figsize=(12, 4.6), width_ratios=[1.5, 1.0])
    figure.subplots_adjust(left=0.19, right=0.985, top=0.76, bottom=0.2, wspace=0.06)
    for axes in (effects, costs):
        style.tidy(axes)
        axes.grid(False, axis="y")
    draw_effects(effects, rows, study["tolerance"])
    draw_costs(costs, rows, full["ms_per_simulated_s"])
    figure.text(0.01, 0.965, f"Effect and cost of each term of the model: scene {full['scene']}", fontsize=14,
                color=INK, fontweight="bold", va="top")
    figure.text(0.01, 0.015, f"{full['num_parcels']:,} parcels, means over {len(full['flights'])} seeds with "
                f"standard errors; dashed bars: upper bounds.\n" + style.machine_text(study), fontsize=8, color=FAINT)
    figure.legend(handles=[Patch(color=PLACE, label="place of exit"), Patch(color=SPEED, label="speed at exit")],
                  loc="upper right", bbox_to_anchor=(0.99, 0.985), ncol=2, frameon=False, fontsize=10)
    style.save(figure, where, "terms")


if __name__ == "__main__":
    main()
