"""Cases of the view: the camera that follows the ball, the magnifier, and where marks stand with large text."""
import pathlib
import sys
import time

from bench import NEARLY_STILL, check
from window import wait_for

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_png

WIDE = ("--size", "1200x700")
SMALL_BALL = ("--scene", "regulation", "--set", "run.time_scale=0.001")


def middle(place):
    return 0.5 * (place[0] + place[2]), 0.5 * (place[1] + place[3])


def side(place):
    return place[2] - place[0]


def settled(window, label):
    """A rectangle of the map when it has stopped to move."""
    def still():
        before = window.controls().get(label)
        time.sleep(0.4)
        after = window.controls().get(label)
        return after if before and after and max(abs(a - b) for a, b in zip(before, after)) < 1.0 else None
    return wait_for(f"{label!r} at rest", still, 2.0 if window.hands_off else 20.0)


def follow_key(bench):
    """Z: the ball comes into the middle and stays there; the wheel goes nearer, a drag or F ends it."""
    with bench.open(*WIDE, *NEARLY_STILL) as window:
        window.press_key("z")
        window.wait_for_control("Followed ball")
        ball = settled(window, "Followed ball")
        x, y = middle(ball)
        check(abs(x - (318 + 1200) / 2) < 4 and 150 < y < 450, f"the ball is in the middle: {x:.0f}, {y:.0f}")
        check(side(ball) > 45, f"and well visible: {side(ball):.0f} pixels")
        window.scroll(900, 200, 4)
        nearer = settled(window, "Followed ball")
        check(side(nearer) > 1.5 * side(ball), f"the wheel goes nearer: {side(nearer):.0f} pixels")
        check(max(abs(a - b) for a, b in zip(middle(nearer), (x, y))) < 2, "and the ball stays in the middle")
        window.drag("Followed ball", [(150, 60), (60, 0)], off=(250, 150))
        window.wait_for_control("Followed ball", there=False)
        print("ok: a drag ends it")
        window.press_key("z")
        window.wait_for_control("Followed ball")
        window.press_key("f")
        window.wait_for_control("Followed ball", there=False)
        print("ok: F ends it")
        start = window.controls()["Ball's start"]
        check(start[0] < 380, f"and shows the whole court: the start is at {start[0]:.0f}")
        window.stop()


def follow_option(bench):
    """--follow, and a scene that asks for it; a periodic world goes on beyond its edge."""
    file = bench.folder / "edge.png"
    words = ("--set", "world.boundary=periodic", "--set", "ball.x_m=6.6", "--set", "ball.y_m=0", "--no-panel",
             "--overlay", "off", *NEARLY_STILL, "--picture", str(file))
    with bench.open(*WIDE, *words, "--set", "view.follow=true") as window:
        window.wait_for_control("Followed ball")
        ball = settled(window, "Followed ball")
        check(abs(middle(ball)[0] - 600) < 3, "the scene asks for it")
        window.press_key("z")
        window.wait_for_control("Followed ball", there=False)
        window.press_key("z")
        window.wait_for_control("Followed ball")
        settled(window, "Followed ball")
        window.stop()
    picture = read_png(file)
    beyond = [picture.at(x, y) for x in range(800, 1200, 4) for y in range(40, 660, 4)]
    lit = sum(max(color) > 110 for color in beyond) / len(beyond)
    check(lit > 0.02, f"parcels beyond the edge: {lit:.1%} of the picture there")


def magnifier_alone(bench):
    """Where the ball is a dot, its magnifier is there by itself, clear of ball and legend; N takes it away."""
    file = bench.folder / "magnified.png"
    with bench.open(*WIDE, *SMALL_BALL, "-t", "--picture", str(file)) as window:
        window.wait_for_control("Magnifier square")
        inset = window.controls()["Magnifier square"]
        legend = window.controls()["Legend"]
        check(318 <= inset[0] and inset[2] <= 1200 and 0 <= inset[1] and inset[3] <= 700, f"in the window: {inset}")
        check(apart(inset, legend), f"beside the legend: {legend}")
        window.press_key("n")
        window.wait_for_control("Magnifier square", there=False)
        window.press_key("n")
        window.wait_for_control("Magnifier square")
        time.sleep(0.3)
        inset = window.controls()["Magnifier square"]
        window.stop()
    check(len(yellow(read_png(file), inset)) > 900, "a large ball in it")


def magnifier_key(bench):
    """N brings it where the ball is large, too; the wheel over it magnifies, and the court stays as it is."""
    counts = []
    for notches in (0, 4):
        file = bench.folder / f"nearer{notches}.png"
        with bench.open(*WIDE, *NEARLY_STILL, "--picture", str(file)) as window:
            check("Magnifier square" not in window.controls(), "not by itself")
            window.press_key("n")
            window.wait_for_control("Magnifier square")
            time.sleep(0.3)
            start = window.controls()["Ball's start"]
            window.scroll_over("Magnifier square", notches)
            time.sleep(0.3)
            inset = window.controls()["Magnifier square"]
            check(window.controls()["Ball's start"] == start, "the court stays")
            window.stop()
        counts.append(len(yellow(read_png(file), inset)))
    check(counts[1] > 2 * counts[0] > 1000, f"pixels of the ball: {counts}")


def yellow(picture, place):
    x0, y0, x1, y1 = (round(edge) for edge in place)
    colors = [picture.at(x, y) for x in range(x0, x1) for y in range(y0, y1 - 24)]
    return [color for color in colors if color[0] > 130 and color[1] > 110 and color[2] < 0.6 * color[1]]


def apart(a, b):
    return a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def large_text(bench):
    """Twice the text at 1280x720: the panel leaves most of the window, the legend and all else is in it and apart."""
    with bench.open("--size", "1280x720", "--ui-scale", "2", "-t", *NEARLY_STILL) as window:
        for _ in range(2):
            window.press_key("m")
        window.wait_for_control("Number 2")
        time.sleep(0.5)
        panel = window.controls()["Restitution"]
        check(panel[2] < 0.37 * 1280, f"the panel ends at {panel[2]:.0f}")
        for hidden in (False, True):
            if hidden:
                window.press_key("h")
                window.wait_for_control("Restitution", there=False)
                time.sleep(0.3)
            marks = {name: place for name, place in window.controls().items()
                     if name == "Legend" or name.startswith(("Number", "Magnifier square")) or name.endswith(" notice")}
            check(len(marks) >= 3, f"marks: {sorted(marks)}")
            for name, place in marks.items():
                left = 0 if hidden else 450
                check(left <= place[0] and place[2] <= 1280 and 0 <= place[1] and place[3] <= 720, f"{name}: {place}")
                check(all(apart(place, other) for label, other in marks.items() if label != name), f"{name} is apart")
        window.stop()
