#!/usr/bin/python3
"""Chart of `pickleflight bench --sweep --json FILE`: time of physics over N, and shares of a frame.

sweep.py FILE.json OUT    writes OUT.svg and OUT.png
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import pathlib
import re
import sys

import style
from style import FAINT, INK, plt, read_json
from matplotlib.ticker import FuncFormatter, NullLocator

# Okabe and Ito (2008): distinct for all kinds of colour vision. One colour per device, one dash per search.
COLOURS = {"1 thread": "#0072B2", "all threads": "#D55E00", "CUDA": "#009E73"}
PARTS = [("physics", "#0072B2"), ("render", "#E69F00"), ("overhead", "#BBBBBB")]
# The report of the seed project: 10^6 parcels, grid, on an RTX 2080 (its section 4.5).
SEED = {"physics": 27.56, "render": 68.75, "overhead": 3.69}
SIXTIETH_MS = 1000.0 / 60.0


def device_of(series):
    return "CUDA" if series["backend"] == "cuda" else "1 thread" if series["threads"] == 1 else "all threads"


def style_of(series):
    return dict(color=COLOURS[device_of(series)], lw=2.0,
                ls="-" if series["neighbors"] == "grid" else (0, (5, 1.8)), solid_capstyle="round")


def label_of(series):
    names = {"1 thread": "1 thread", "all threads": threads_text(series), "CUDA": "CUDA"}
    return f"{names[device_of(series)]}, {series['neighbors']}"


def threads_text(series):
    """'AMD EPYC, 2 threads' -> '2 threads'."""
    return series["device"].rsplit(", ", 1)[-1]


def spread(values, min_gap):
    """Moves values apart until they differ by min_gap. Keeps their order, and their positions as far as possible."""
    order = sorted(range(len(values)), key=values.__getitem__)

    def height(group):
        return (len(group[0]) - 1) * min_gap

    merged = []  # groups of members and their centre
    for i in order:
        merged.append([[i], values[i]])
        while len(merged) > 1 and (merged[-1][1] - height(merged[-1]) / 2
                                   < merged[-2][1] + height(merged[-2]) / 2 + min_gap):
            upper, lower = merged.pop(), merged.pop()
            members = lower[0] + upper[0]
            merged.append([members, sum(values[i] for i in members) / len(members)])
    places = list(values)
    for members, centre in merged:
        for rank, i in enumerate(members):
            places[i] = centre + (rank - (len(members) - 1) / 2) * min_gap
    return places


def milliseconds(value, _=None):
    return f"{value:g}" if value < 10_000 else rf"$10^{{{round(len(f'{value:.0f}') - 1)}}}$"


def draw_growth(axes, sweep):
    axes.set_xscale("log")
    axes.set_yscale("log")
    ends = []
    for series in sweep["series"]:
        points = series["points"]
        sizes = [point["num_parcels"] for point in points]
        times = [point["physics_ms"] for point in points]
        axes.plot(sizes, times, zorder=3, **style_of(series))
        for point in points:
            axes.plot(point["num_parcels"], point["physics_ms"], "o", ms=6.5, mew=1.6, zorder=4,
                      mec=COLOURS[device_of(series)],
                      mfc="white" if point["extrapolated"] else COLOURS[device_of(series)])
        ends.append((series, sizes[-1], times[-1]))
    axes.axhline(SIXTIETH_MS, color=FAINT, lw=0.9, ls=":", zorder=1)
    axes.text(0.01, SIXTIETH_MS * 1.12, "60 fps", color=FAINT, fontsize=8.5, va="bottom",
              transform=axes.get_yaxis_transform())
    label_ends(axes, ends)
    axes.set_xlabel("air parcels N")
    axes.set_title("Physics of a frame, milliseconds", loc="left", fontsize=11.5, color=INK, pad=10)
    axes.yaxis.set_major_formatter(FuncFormatter(milliseconds))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
    axes.grid(True, which="major", color="#E6E6E6", lw=0.8, zorder=0)


def label_ends(axes, ends):
    """Labels each series at its last point. Labels of close points are moved apart."""
    axes.figure.canvas.draw()
    heights = [axes.transData.transform((size, time))[1] for _, size, time in ends]
    places = spread(heights, 15.0 * axes.figure.dpi / 72)
    for (series, size, time), place in zip(ends, places):
        at = axes.transData.inverted().transform((0, place))[1]
        axes.annotate(label_of(series), (size, time), xytext=(size * 1.45, at), textcoords="data", va="center",
                      color=COLOURS[device_of(series)], fontsize=9.5, annotation_clip=False,
                      arrowprops=dict(arrowstyle="-", color=COLOURS[device_of(series)], lw=0.7, shrinkA=1, shrinkB=5))


def last_measured(series):
    measured = [point for point in series["points"] if not point["extrapolated"]]
    return max(measured, key=lambda point: point["num_parcels"], default=None)


def bars_of(sweep):
    """The bar of the seed, then the grid on each device at the largest measured N."""
    bars = [("the seed's report\nRTX 2080, grid", 10**6, SEED, None)]
    for series in sweep["series"]:
        point = last_measured(series)
        if series["neighbors"] != "grid" or point is None:
            continue
        name = series["device"] if series["backend"] == "cuda" else "CPU, " + threads_text(series)
        shares = {part: point[f"{part}_percent"] for part, _ in PARTS}
        bars.append((f"{name}\ndrawn by {renderer_name(series)}", point["num_parcels"], shares, point["frame_ms"]))
    return bars


def renderer_name(series):
    return re.split(r"[ /(]", series["renderer"].replace("NVIDIA ", ""))[0]


def draw_shares(axes, sweep):
    bars = bars_of(sweep)
    for row, (_, _, shares, frame_ms) in enumerate(bars):
        left = 0.0
        for part, colour in PARTS:
            axes.barh(row, shares[part], left=left, height=0.52, color=colour, edgecolor="white", lw=1.2, zorder=3)
            if shares[part] >= 6.0:
                axes.text(left + shares[part] / 2, row, f"{shares[part]:.0f} %", ha="center", va="center",
                          color="white" if part == "physics" else INK, fontsize=9.5, zorder=4)
            left += shares[part]
        if frame_ms is not None:
            axes.text(102, row, f"{frame_ms:.3g} ms", va="center", color=INK, fontsize=9.5)
    left = 0.0
    for part, _ in PARTS:  # labels over the first bar
        at, align = (100, "right") if part == "overhead" else (left + SEED[part] / 2, "center")
        axes.text(at, -0.40, part, ha=align, va="bottom", color=INK, fontsize=9.5)
        left += SEED[part]
    axes.set_yticks(range(len(bars)), [name for name, *_ in bars], fontsize=9.5)
    axes.set_ylim(len(bars) - 0.5, -0.75)
    axes.set_xlim(0, 100)
    axes.set_xticks([0, 25, 50, 75, 100], ["0", "25", "50", "75", "100 %"])
    size = max(number for _, number, _, _ in bars[1:]) if len(bars) > 1 else 10**6
    axes.set_title(f"Shares of a frame of {size:,} parcels", loc="left", fontsize=11.5, color=INK, pad=10)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)


def draw(sweep):
    style.prepare("sweep")
    figure, (growth, shares) = plt.subplots(1, 2, figsize=(12.6, 4.9), width_ratios=[1.12, 1.0])
    figure.subplots_adjust(left=0.05, right=0.94, top=0.88, bottom=0.16, wspace=0.68)
    for axes in (growth, shares):
        axes.spines[["top", "right"]].set_visible(False)
    draw_growth(growth, sweep)
    draw_shares(shares, sweep)
    device = next((s["device"] for s in sweep["series"] if s["backend"] == "cpu"), "").rsplit(", ", 1)[0]
    hollow = any(point["extrapolated"] for series in sweep["series"] for point in series["points"])
    note = f"Court scene, one step a frame, 1280x720. CPU: {device}."
    if hollow:
        note += " Hollow: extrapolated, longer than 20 s (all-pairs as N\u00b2, grid as N)."
    figure.text(0.05, 0.02, note, fontsize=8.5, color=FAINT)
    return figure


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sweep = read_json(sys.argv[1])
    if sweep.get("kind") != "sweep" or not sweep["series"]:
        sys.exit(f"{sys.argv[1]}: no sweep with a series; measure one: pickleflight bench --sweep --json FILE")
    out = pathlib.Path(sys.argv[2])
    style.save(draw(sweep), out.parent, out.name)


if __name__ == "__main__":
    main()
