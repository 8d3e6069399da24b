#!/usr/bin/python3
"""Chart of `pickleflight lab validate --out FOLDER`: error of each figure against theory.

validate.py FOLDER    reads FOLDER/validate.json, writes validate.svg and validate.png beside it
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import style
from style import COLOURS, FAINT, INK, MARKS, plt
from matplotlib.ticker import FixedLocator, FuncFormatter

MAX_ERROR = 1000.0  # in allowed errors; larger ones are drawn here


def allowed(row):
    return max(3.0 * row["sigma"], row["tolerance"]) or 1e-12


def draw(study):
    names = list(dict.fromkeys(row["yardstick"] for row in study["points"]))
    figure, axes = plt.subplots(figsize=(11, 0.235 * len(names) + 1.9))
    height = figure.get_figheight()
    figure.subplots_adjust(left=0.36, right=0.975, top=1.0 - 0.75 / height, bottom=0.95 / height)
    axes.set_xscale("symlog", linthresh=1.0, linscale=1.4)
    for row in study["points"]:
        scale, y, method = allowed(row), names.index(row["yardstick"]), row["method"]
        at = max(-MAX_ERROR, min(MAX_ERROR, row["error"] / scale))
        axes.errorbar(at, y + (0.0 if row["judged"] else 0.22), xerr=row["sigma"] / scale, fmt=MARKS[method], ms=5.0,
                      color=COLOURS[method], mfc=COLOURS[method] if row["judged"] else "white", elinewidth=1.1, zorder=4)
    for edge in (-1, 1):
        axes.axvline(edge, color=INK, lw=1.2, ls=(0, (4, 2)), zorder=2)
    style.tidy(axes)
    axes.set_yticks(range(len(names)), names, fontsize=8.5)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlim(-1.5 * MAX_ERROR, 1.5 * MAX_ERROR)
    axes.xaxis.set_major_locator(FixedLocator([-1000, -100, -10, -1, 0, 1, 10, 100, 1000]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:+g}" if value else "0"))
    axes.set_xlabel("error over allowed error: the larger of three standard errors and the tolerance")
    for text, method, x in (("exact, judged", "exact", 0.36), ("impulse, only shown (hollow)", "impulse", 0.5)):
        figure.text(x, 1.0 - 0.62 / height, text, color=COLOURS[method], fontsize=10, fontweight="bold")
    failed = len(study.get("failed", []))
    title = f"Against theory: {failed or 'no'} figure{'' if failed == 1 else 's'} outside the allowed error"
    figure.text(0.01, 1.0 - 0.16 / height, title, fontsize=14, color=INK, fontweight="bold", va="top")
    figure.text(0.01, 0.12 / height, style.machine_text(study), fontsize=8, color=FAINT)
    return figure


def main():
    where = style.folder()
    study = style.load(where, "validate")
    style.prepare("validate")
    if study["points"]:
        style.save(draw(study), where, "validate")


if __name__ == "__main__":
    main()
