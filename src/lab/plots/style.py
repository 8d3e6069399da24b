"""Shared by the lab's charts: colours, reading and saving."""
import json
import pathlib
import sys

try:
    import matplotlib
    import numpy as np
except ModuleNotFoundError as missing:  # the other charts import this first
    sys.exit(f"{missing}: apt install python3-matplotlib, and start this with /usr/bin/python3")

matplotlib.use("Agg")
import matplotlib.pyplot as plt

if {"-h", "--help"} & set(sys.argv[1:]):
    print(sys.modules["__main__"].__doc__.strip())
    sys.exit()

# Okabe and Ito (2008): distinct for all kinds of colour vision. Each method also has its own shape of dot.
COLOURS = {"impulse": "#0072B2", "spring": "#D55E00", "exact": "#009E73"}
MARKS = {"impulse": "o", "spring": "s", "exact": "D"}
METHODS = ("impulse", "spring", "exact")
INK, FAINT, RULE = "#222222", "#8A8A8A", "#E6E6E6"


def prepare(salt):
    plt.rcParams.update({"font.family": "DejaVu Sans", "axes.edgecolor": FAINT, "axes.labelcolor": INK,
                         "xtick.color": FAINT, "ytick.color": FAINT, "xtick.labelcolor": INK,
                         "ytick.labelcolor": INK, "svg.fonttype": "none", "svg.hashsalt": salt,
                         "axes.titlesize": 10.5, "axes.labelsize": 10, "xtick.labelsize": 9, "ytick.labelsize": 9})


def folder():
    if len(sys.argv) != 2:
        sys.exit(sys.modules["__main__"].__doc__)
    return pathlib.Path(sys.argv[1])


def read_json(file):
    try:
        return json.loads(pathlib.Path(file).read_text())
    except (OSError, ValueError) as error:
        sys.exit(f"{file} cannot be read: {error}")


def load(where, name):
    return read_json(where / f"{name}.json")


def tidy(axes):
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, which="major", color=RULE, lw=0.8, zorder=0)
    axes.set_axisbelow(True)


def arrow_down(axes, x, y, colour):
    """An upper bound on a logarithmic axis."""
    axes.annotate("", (x, y * 0.45), (x, y * 0.9), zorder=3,
                  arrowprops=dict(arrowstyle="-|>", color=colour, lw=0.8, mutation_scale=6))


def machine_text(study):
    machine = study["machine"]
    devices = "; ".join(entry["device"] for entry in machine["devices"])
    text = f"{devices}. {study['command']}."
    return text + (" Measured under load: costs are upper bounds." if machine["measured_under_load"] else "")


def save(figure, where, name):
    try:
        figure.savefig(where / f"{name}.svg", metadata={"Date": None})
        figure.savefig(where / f"{name}.png", dpi=120, metadata={"Software": None})
    except OSError as error:
        sys.exit(f"the picture {where / name} cannot be written: {error}")
    plt.close(figure)


def percent(value, _=None):
    """0.01 -> '1 %'; small values as a power of ten."""
    shown = 100.0 * value
    if shown >= 1e-4 * 0.999 and shown < 1e4:
        return f"{shown:g} %"
    return rf"$10^{{{round(np.log10(shown))}}}$ %" if shown > 0 else "0"
