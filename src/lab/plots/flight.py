#!/usr/bin/python3
"""Chart of `pickleflight bench --flight --json FILE`: time of each frame over whole flights.

flight.py FILE.json... OUT    writes OUT.svg and OUT.png; one line for each file
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import pathlib
import sys

from style import COLOURS, FAINT, INK, METHODS, np, plt, prepare, read_json, save, tidy
from matplotlib.ticker import LogLocator

SIXTIETH_MS = 1000.0 / 60.0
NUM_BINS = 150
DASHES = ("-", (0, (5, 1.6)), (0, (1.2, 1.2)), (0, (6, 1.4, 1.2, 1.4)))  # by N, smallest first


def read(name):
    report = read_json(name)
    if report.get("kind") != "flight":
        sys.exit(f"{name}: no whole flight; measure one: pickleflight bench --flight --json FILE")
    return report


def binned(times_s, values):
    """Middle, median and largest of each span of time; frames are too many for a line."""
    edges = np.linspace(0.0, times_s[-1], min(NUM_BINS, len(times_s)) + 1)
    place = np.clip(np.searchsorted(edges, times_s, side="left") - 1, 0, len(edges) - 2)
    rows = [(0.5 * (edges[i] + edges[i + 1]), np.median(values[place == i]), np.max(values[place == i]))
            for i in range(len(edges) - 1) if np.any(place == i)]
    return np.array(rows).T


def label_of(report):
    flight = report["flight"]
    stopped = ", stopped" if report.get("interrupted") or report.get("ended_early") else ""
    return (f"{report['method']}, {report['num_parcels']:,}{stopped}: median {flight['median_ms']:.3g}, "
            f"99 % {flight['p99_ms']:.3g}, worst {flight['worst_ms']:.3g} ms")


def draw(reports):
    prepare("flight")
    sizes = sorted({report["num_parcels"] for report in reports})
    reports = sorted(reports, key=lambda r: (METHODS.index(r["method"]), r["num_parcels"]))
    columns = 2 if len(reports) > 3 else 1
    figure, axes = plt.subplots(figsize=(9.6, 5.0))
    figure.subplots_adjust(left=0.08, right=0.97, top=0.89 - 0.042 * -(-len(reports) // columns), bottom=0.16)
    tidy(axes)
    axes.set_yscale("log")
    for report in reports:
        colour = COLOURS[report["method"]]
        middle, median, largest = binned(np.array(report["flight"]["simulated_s"]), np.array(report["flight"]["ms"]))
        axes.fill_between(middle, median, largest, color=colour, alpha=0.16, lw=0, zorder=2)
        axes.plot(middle, median, color=colour, lw=1.6, ls=DASHES[sizes.index(report["num_parcels"]) % len(DASHES)],
                  label=label_of(report), zorder=3)
    axes.axhline(SIXTIETH_MS, color=FAINT, lw=0.9, ls=":", zorder=1)
    axes.text(1.0, SIXTIETH_MS, "60 frames/s ", color=FAINT, fontsize=8.5, va="bottom", ha="right",
              transform=axes.get_yaxis_transform())
    axes.set_xlim(left=0.0)
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xlabel("simulated time of the flight, s")
    scenes = ", ".join(sorted({report["scene"] for report in reports}))
    figure.suptitle(f"Physics of a frame over a flight ({scenes}), milliseconds", x=0.08, ha="left", fontsize=11.5,
                    color=INK)
    figure.legend(loc="upper left", bbox_to_anchor=(0.07, 0.94), ncols=columns, fontsize=8.5,
                  frameon=False)
    devices = "; ".join(sorted({report["device"] for report in reports}))
    figure.text(0.08, 0.03, f"{devices}. Lines: median; shades: up to the longest frame.", fontsize=8.5, color=FAINT)
    return figure


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out = pathlib.Path(sys.argv[-1])
    save(draw([read(name) for name in sys.argv[1:-1]]), out.parent, out.name)


if __name__ == "__main__":
    main()
