"""Two methods at once: X, the divider, both halves; seen in the last picture and in the report."""
import pathlib
import sys
import time

from bench import check
from window import wait_for

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_png

# The ball turns by a third of a radian in a step, but not in the second half.
TURNING = ("--dt", "0.01", "--substeps", "1", "--ball-spin", "1500", "--set", "air.kind=vacuum", "--set", "ball.y_m=0",
           "--paused", "--size", "1280x700", "--overlay", "off")


def split_key(bench):
    """X: two halves with the same parcels and balls that part; the divider goes where it is dragged; X: one picture; X: off."""
    file = bench.folder / "halves.png"
    with bench.open(*TURNING, "--split", "ball.magnus=false", "--picture", str(file)) as window:
        for _ in range(6):
            window.press_key("s")
        window.wait_for_control("Divider")
        before = window.controls()
        window.drag("Divider", [(0, 40), (0, 40)])
        wait_for("divider that follows", lambda: window.controls()["Divider"][1] > before["Divider"][1] + 70,
                 1.0 if bench.hands_off else 10.0)
        places = window.controls()
        time.sleep(0.3)
        report = window.stop()
    picture = read_png(file)
    x0, y0, x1, _ = places["Divider"]
    check(all(is_line(picture.at(x, round(y0) + 1)) for x in (round(x0) + 60, round(x1) - 420)),
          "the divider is drawn where it was dragged to")
    balls = {half: ball_in(picture, places[half]) for half in ("First half", "Second half")}
    check(None not in balls.values(), f"a ball in each half: {balls}")
    first, second = (relative(balls[half], places[half]) for half in balls)
    check(abs(second[1] - 0.5) < 0.02, f"the second one flies straight on, at {second[1]:.3f} of its half's height")
    check(first[1] < second[1] - 0.05, f"the first one turns up, to {first[1]:.3f}")
    check(report["split"]["set"] == ["ball.magnus = false"], f"report: {report['split']['set']}")
    check(report["split"]["second"]["steps"] == report["steps"] == 6, "as many steps in both")
    check(report["split"]["compared"]["distance_m"]["final"] > 0.1, "and their distance")
    cycle(bench)


def cycle(bench):
    """X from one flight to two, to one picture, and back."""
    with bench.open("--time-scale", "0.01", "--size", "1280x700") as window:
        window.press_key("x")
        window.wait_for_control("Divider")
        window.press_key("space")
        window.wait_for_control("Pause notice")
        place = window.controls()
        check(place["Pause notice"][1] >= place["First half"][1] + 24, "a notice stands below the name")
        window.press_key("space")
        window.press_key("x")
        window.wait_for_control("Divider", there=False)
        check("Split card" in window.controls(), "X again: one picture, with the figures")
        window.press_key("space")
        window.wait_for_control("Pause notice")
        place = window.controls()
        check(place["Pause notice"][1] >= place["Split card"][3], f"a notice stands below the figures: {place['Pause notice']}")
        window.press_key("space")
        window.press_key("x")
        window.wait_for_control("Split card", there=False)
        report = window.stop()
    check(report["split"] is None, "and again: one flight")


def split_panel(bench):
    """The panel begins a second flight with the method that is chosen; M takes the next; the restitution is both's."""
    with bench.open("--time-scale", "0.01", "--size", "1280x790", "--overlay", "off") as window:
        for section in ("Ball", "Air", "View"):
            window.click(f"{section} header")
        window.click("Two methods at once header")
        window.wait_for_control("Two at once (X)")
        time.sleep(0.3)
        window.choose("Second half", "method exact")
        window.choose("Two at once (X)", "two halves")
        window.wait_for_control("Divider")
        window.drag_slider("Restitution", 0.9, 0.3)
        time.sleep(0.3)
        window.press_key("m")
        time.sleep(0.5)
        report = window.stop()
    check(report["method"] == "impulse" and report["split"]["second"]["method"] == "spring", "M: the second half's next method")
    check(report["restitution"] == report["split"]["second"]["restitution"] < 0.4, "the slider holds for both")


def is_line(color):
    return 25 < min(color) and max(color) < 130 and color[2] >= color[0]


def ball_in(picture, place):
    """The middle of what is as yellow as the ball."""
    x0, y0, x1, y1 = (round(value) for value in place)
    found = [(x, y) for y in range(max(y0, 0), min(y1, picture.height)) for x in range(x0, min(x1, picture.width))
             if is_ball(picture.at(x, y))]
    if len(found) < 10:
        return None
    return sum(x for x, _ in found) / len(found), sum(y for _, y in found) / len(found)


def is_ball(color):
    return color[0] > 150 and color[1] > 140 and color[2] < 100


def relative(at, place):
    x0, y0, x1, y1 = place
    return (at[0] - x0) / (x1 - x0), (at[1] - y0) / (y1 - y0)
