"""Cases of the panel's rows as they look: knobs, tooltips, labels, the chart of accuracy; seen in the last picture."""
import pathlib
import sys
import time

from accuracy_cases import ELASTIC, open_accuracy
from bench import check

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_png

PANEL_PX = 318


def columns(picture, place, has):
    """Those of a rectangle with a pixel of the wanted colour."""
    x0, y0, x1, y1 = (round(edge) for edge in place)
    return [x for x in range(x0, x1) if any(has(picture.at(x, y)) for y in range(y0, y1))]


def is_knob(color):
    return all(abs(part - wanted) < 14 for part, wanted in zip(color, (103, 182, 187)))


def is_letter(color):
    return min(color) > 170


def knobs(bench):
    """A slider's number stands beside its knob, at either end."""
    file = bench.folder / "knobs.png"
    with bench.open("--paused", "--picture", str(file)) as window:
        window.drag_slider("Friction", 0.3, 0.9)
        time.sleep(0.3)
        places = window.controls()
        window.stop()
    picture = read_png(file)
    for label, is_right in (("Restitution", True), ("Friction", True), ("Area fraction", False), ("Ball spin", True)):
        knob, letters = (columns(picture, places[label], what) for what in (is_knob, is_letter))
        check(knob and letters, f"{label}: knob and number are there")
        apart = knob[0] - letters[-1] if is_right else letters[0] - knob[-1]
        check(apart > 1, f"{label}: {apart} pixels between knob and number")


    with bench.open("--paused", "--method", "exact", "--picture", str(file)) as window:
        window.drag_slider("Friction", 0.3, 0.9)  # a hand, so that this fails without one
        time.sleep(0.3)
        places = window.controls()
        window.stop()
    knob, letters = (columns(read_png(file), places["Contact clock"], what) for what in (is_knob, is_letter))
    check(knob and letters, "Contact clock: knob and number are there")
    check(letters[0] > knob[-1] + 1 or letters[-1] < knob[0] - 1, "its long value keeps off the knob")


def hovered(bench, hold):
    """The last picture with the pointer on a slider, or with it held."""
    file = bench.folder / "hovered.png"
    with bench.open("--paused", "--picture", str(file), "--size", "1000x700") as window:
        window.drag_slider("Friction", 0.3, 0.3)  # the pointer is then there
        if hold:
            window.hold("Friction", 0.3)
        else:
            window.move_to("Friction", 0.3)
        time.sleep(0.4)
        window.stop()
    return read_png(file)


def tooltips(bench):
    """A tooltip stands at the right of the panel, and goes while the slider is held."""
    shown, held = hovered(bench, False), hovered(bench, True)
    changed = [(x, y) for x in range(0, 700, 3) for y in range(0, 560, 3) if shown.at(x, y) != held.at(x, y)]
    beside = [place for place in changed if place[0] >= PANEL_PX]
    check(len(beside) > 500, f"the tooltip is beside the panel, and gone while held: {len(beside)} pixels differ")
    rows = {y for x, y in changed if x < PANEL_PX}
    check(len(rows) < 12, f"it covers no other control: rows {sorted(rows)} differ in the panel")


def labels(bench):
    """In All settings no label runs into its field."""
    file = bench.folder / "labels.png"
    with bench.open("--paused", "--picture", str(file), "--size", "800x1900") as window:
        for header in ("Ball", "Air", "Method", "View"):
            window.click(f"{header} header")
        window.click("All settings header")
        window.wait_for_control("run.displacement_per_step")
        time.sleep(0.3)
        places = {name: place for name, place in window.controls().items() if "." in name and place[0] > 100}
        window.stop()
    picture = read_png(file)
    cut = [name for name, (x0, y0, _, y1) in places.items()
           if columns(picture, (x0 - 3, y0, x0, y1), lambda color: max(color) > 100)]
    check(len(places) > 30 and not cut, f"of {len(places)} labels cut: {cut}")


def chart(bench):
    """The chart of accuracy has costs and a caption below each other at its foot, clear of its points."""
    file = bench.folder / "chart.png"
    with bench.open(*ELASTIC, "--method", "exact", "--size", "1000x790", "--picture", str(file)) as window:
        open_accuracy(window)
        x0, y0, x1, y1 = window.controls()["Work-precision"]
        window.stop()
    picture = read_png(file)
    foot = range(round(y1 - 2.0 * 14), round(y1))
    lit = [any(sum(picture.at(x, y)) > 220 for x in range(round(x0), round(x1))) for y in foot]
    lines = sum(1 for above, here in zip([False] + lit, lit) if here and not above)
    check(lines == 2, f"{lines} lines of text at the foot")
    colored = [(x, y) for y in foot for x in range(round(x0), round(x1))
               if max(picture.at(x, y)) - min(picture.at(x, y)) > 60]
    check(not colored, f"no point among them: {colored[:3]}")
