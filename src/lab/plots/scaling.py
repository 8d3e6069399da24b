#!/usr/bin/python3
"""Chart of `pickleflight bench --json FILE` over the number of parcels, one line for each device and method.

scaling.py FILE.json... OUT    writes OUT.svg and OUT.png
FILE: one run, or runs collected by number of parcels as in assets/bench. The dotted lines are ceilings of
`impulse` on an H200 (docs/limits.md): its instructions, and the memory that a step moves at least.
Needs matplotlib (Debian, Ubuntu: apt install python3-matplotlib).
"""
import collections
import pathlib
import sys

from style import COLOURS, FAINT, INK, METHODS, plt, prepare, read_json, save, tidy

CEILINGS_GPS = (("all issue slots of an H200", 57.0), ("all its memory bandwidth", 116.0))
DASHES = ("-", (0, (5, 1.6)), (0, (1.2, 1.2)), (0, (6, 1.4, 1.2, 1.4)))  # by device


def runs_in(report):
    if "runs" not in report:
        return [report]
    collected = [report["runs"]] + [part["runs"] for part in report.values() if isinstance(part, dict) and "runs" in part]
    return [run for runs in collected for run in runs.values()]


def read(names):
    """All runs of the files."""
    runs = []
    for name in names:
        steps = [run for run in runs_in(read_json(name)) if run and "bench" in run]
        if not steps:
            sys.exit(f"{name}: no run of steps; measure one: pickleflight bench --json FILE")
        runs += steps
    return runs


def lines_of(runs):
    """{(device, method): {N: Gps}}, by the median step."""
    lines = collections.defaultdict(dict)
    for run in runs:
        lines[run["device"], run["method"]][run["num_parcels"]] = 1.0 / run["bench"]["ns_per_parcel_step_median"]
    return lines


def scenes_of(runs):
    """'scene gas (area fraction 0.2)', or several."""
    texts = sorted({run["scene"] + (f" (area fraction {run['area_fraction']:.3g})" if run.get("area_fraction") else "")
                    for run in runs})
    return ("scene " if len(texts) == 1 else "scenes ") + ", ".join(texts)


def draw(runs):
    lines = lines_of(runs)
    prepare("scaling")
    figure, axes = plt.subplots(figsize=(9.6, 5.4))
    figure.subplots_adjust(left=0.08, right=0.97, top=0.78, bottom=0.12)
    tidy(axes)
    axes.set_xscale("log")
    axes.set_yscale("log")
    devices = list(dict.fromkeys(device for device, _ in lines))
    for device, method in sorted(lines, key=lambda key: (METHODS.index(key[1]), devices.index(key[0]))):
        points = sorted(lines[device, method].items())
        axes.plot(*zip(*points), color=COLOURS[method], lw=1.6, ls=DASHES[devices.index(device) % len(DASHES)],
                  marker="o", ms=3.5, label=f"{method}, {device}", zorder=3)
    if any("H200" in device for device in devices):
        for name, gps in CEILINGS_GPS:
            axes.axhline(gps, color=FAINT, lw=0.9, ls=":", zorder=1)
            axes.text(0.005, gps, f" {name}", color=FAINT, fontsize=8.5, va="bottom",
                      transform=axes.get_yaxis_transform())
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xlabel("parcels")
    figure.suptitle(f"Steps of {scenes_of(runs)}, 10\N{SUPERSCRIPT NINE} parcel-steps per second", x=0.08, ha="left",
                    fontsize=11.5, color=INK)
    figure.legend(loc="upper left", bbox_to_anchor=(0.07, 0.94), ncols=2, fontsize=8.5, frameon=False)
    return figure


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out = pathlib.Path(sys.argv[-1])
    save(draw(read(sys.argv[1:-1])), out.parent, out.name)


if __name__ == "__main__":
    main()
