"""Cases of the view: camera, overlay, looks, full screen, dense screens; seen in the last picture."""
import pathlib
import sys
import time

from bench import STEPWISE, check
from window import wait_for

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_png


def view_keys(bench):
    """T shows the path, O twice takes the overlay away, F undoes zooming: seen in the last picture."""
    file = bench.folder / "last.png"
    with bench.open("--picture", str(file), "--dt", "0.01", "--substeps", "1", "--set",
                    "air.kind=vacuum") as window:
        window.press_key("space")
        window.wait_for_control("Run")
        window.press_key("r")
        for _ in range(8):
            window.press_key("s")
        window.press_key("o")
        window.press_key("o")
        window.scroll(560, 350, 4)
        window.press_key("f")
        window.press_key("t")
        time.sleep(0.3)
        window.stop()
    picture = read_png(file)
    lines = [x for x in range(330, picture.width) if is_line(picture, x)]
    check(lines and lines[0] < 400 and lines[-1] > picture.width - 60,
          f"F: both ends of the court are in the picture, at {lines[:1] + lines[-1:]}")
    bright = [y for y in range(picture.height) if is_bright(picture.at(lines[-1], y))]
    middle = 0.5 * (bright[0] + bright[-1])
    # With the overlay, 136 pixels high, the court would be centred in what is above it.
    check(abs(middle - picture.height / 2) < 20, f"O twice: the court has the whole height, its middle is at {middle}")
    below_notices = range(100, picture.height)
    columns = [x for x in range(330, 500) if any(is_yellow(picture.at(x, y)) for y in below_notices)]
    # 8 steps of 0.15 m are 39 pixels; the ball alone, as yellow, is 12 wide.
    check(len(columns) > 25, f"T: from ball and path {len(columns)} columns are yellow")


METHOD_COLORS = {"impulse": (51, 153, 219), "spring": (230, 115, 26), "exact": (26, 189, 143)}


def compared(bench):
    """M twice: the first flight in row one, then the current one, each in its method's colour. Shift+M twice: its step."""
    file = bench.folder / "compared.png"
    with bench.open(*STEPWISE, "--paused", "--picture", str(file)) as window:
        for key in ("s", "s", "m", "s", "m", "s"):
            window.press_key(key)
        time.sleep(0.3)
        window.stop()
    picture = read_png(file)
    rows = {method: legend_row(picture, color) for method, color in METHOD_COLORS.items()}
    check(None not in rows.values() and rows["impulse"] < rows["exact"] < rows["spring"], f"rows of the legend: {rows}")
    with bench.open(*STEPWISE, "--paused") as window:
        for _ in range(2):
            window.press_key("s")
            window.press_shifted("m")
        window.press_key("m")
        window.press_key("s")
        report = window.stop()
    check(report["method"] == "spring" and report["dt_s"] == 0.001, f"again the scene's step: {report['dt_s']} s")


def legend_row(picture, color):
    """Height of a sample of a path's line, above the court; None if there is none."""
    for y in range(130):
        near = [x for x in range(330, picture.width) if max(abs(a - b) for a, b in zip(picture.at(x, y), color)) < 15]
        if len(near) > 12:
            return y
    return None


def is_line(picture, x):
    """A column that is bright over a fifth of the picture: a line across the court."""
    return sum(1 for y in range(picture.height) if is_bright(picture.at(x, y))) > picture.height / 5


def is_bright(color):
    return min(color) > 150


def is_yellow(color):
    return color[0] > 100 and color[1] > 90 and color[2] < 0.8 * color[0] and color[0] > color[1]


def looks(bench):
    """D, C, +, F11 and ghosts, seen in the last picture; the overlay's figures in a file."""
    file, csv = bench.folder / "looks.png", bench.folder / "overlay.csv"
    with bench.open("--picture", str(file), "--overlay-csv", str(csv), "--paused", "--size", "1200x700") as window:
        x0, _, x1, _ = window.controls()["Restitution"]
        window.press_key("plus")
        wait_for("larger text", lambda: wider(window, x1 - x0), 1.0 if bench.hands_off else 5.0)
        print("ok: + makes the panel larger")
        window.press_key("minus")
        for key in ("h", "d", "c", "c", "g", "F11"):
            window.press_key(key)
        time.sleep(0.5)
        window.stop()
    picture = read_png(file)
    check((picture.width, picture.height) == (1280, 800), f"F11: it fills the screen: {picture.width} wide")
    check(min(picture.at(8, 8)) > 180, f"D: the floor is light: {picture.at(8, 8)}")
    colors = [picture.at(x, y) for x in range(0, picture.width, 3) for y in range(60, 600, 3)]
    grey = sum(1 for color in colors if max(color) < 150 and max(color) - min(color) < 12)
    green = sum(1 for color in colors if color[1] - color[0] > 40)
    # 2000 parcels of some 30 pixels, a ninth of which is looked at.
    check(grey > 1000 and green < grey / 10, f"C twice: parcels are grey: {grey} pixels, {green} green")
    lines = csv.read_text().splitlines()
    row = dict(zip(lines[0].split(","), lines[-1].split(",")))
    check(len(lines) > 5 and row["num_parcels"] == "2000" and row["draw_target"] == "host",
          f"--overlay-csv: {len(lines) - 1} frames, draw target {row['draw_target']}")


def wider(window, width):
    x0, _, x1, _ = window.controls()["Restitution"]
    return x1 - x0 > 1.15 * width


def vsync_key(bench):
    """V: frames wait for the screen, or do not."""
    for words, after in (((), False), (("--no-vsync",), True)):
        with bench.open(*words) as window:
            window.press_key("v")
            time.sleep(0.2)
            display = window.stop()["display"]
        check(display["vsync"] is after, f"V after {words or 'nothing'}: vsync is {display['vsync']}")


def dense_screen(bench):
    """At twice the usual pixels per inch everything has twice the pixels, and the mouse finds it there."""
    widths = []
    try:
        for dpi in (96, 192):
            bench.screen.set_dpi(dpi)
            with bench.open("--size", "480x380") as window:
                window.press_key("h")  # in so narrow a window the panel is hidden
                window.wait_for_control("Restitution")
                window.drag_slider("Restitution", 0.9, 0.3)
                time.sleep(0.3)
                x0, y0, x1, y1 = window.controls()["Restitution"]  # late, beside the scroll bar that has come
                widths.append((x1 - x0, y1 - y0))
                report = window.stop()
            scale = dpi / 96
            check(report["display"]["content_scale"] == scale and report["display"]["width"] == 480 * scale,
                  f"{dpi} dpi: {report['display']}")
            check(abs(report["restitution"] - 0.3) < 0.04, f"the slider is found: {report['restitution']:.3f}")
    finally:
        bench.screen.set_dpi(96)
    # Each edge is rounded to a whole pixel, the font's height too: two pixels each way, at most.
    grown = [(before, after) for before, after in zip(*widths)]
    check(all(abs(after - 2.0 * before) <= 4.0 for before, after in grown), f"width and height of a slider: {grown}")


def narrow(bench):
    """A window of which the panel would take more than half shows it by H only, and again when it is wide."""
    with bench.open("--paused", "--size", "600x400") as window:
        window.wait_for_control("Restitution", there=False)
        window.press_key("h")
        window.wait_for_control("Restitution")
        window.press_key("h")
        window.wait_for_control("Restitution", there=False)
        window.resize(800, 500)
        window.wait_frames()
        window.wait_for_control("Restitution", there=False)
        print("ok: who has hidden it by H finds it hidden in a wide window")
        window.press_key("h")
        window.wait_for_control("Restitution")
        window.resize(500, 400)
        window.wait_for_control("Restitution", there=False)
        window.resize(800, 500)
        window.wait_for_control("Restitution")
        window.stop()
    print("ok: it goes and comes with the window's width")


def scene_words(bench):
    """The open menu of scenes has a line below each name that says what it shows: another for each."""
    file = bench.folder / "menu.png"
    with bench.open("--size", "1000x700", "--picture", str(file), "--paused") as window:
        window.click("Scene")
        window.wait_for_control("Scene.gas")
        time.sleep(0.3)
        places = {name: place for name, place in window.controls().items() if name.startswith("Scene.")}
        window.stop()
    picture = read_png(file)
    lines = {name: letters(picture, place) for name, place in places.items()}
    lengths = [max(columns, default=0) for columns in lines.values()]
    check(len(lines) > 8 and min(lengths) > 250, f"{len(lines)} sentences, the shortest {min(lengths)} pixels long")
    check(len({tuple(columns) for columns in lines.values()}) == len(lines), "each another")


def letters(picture, place):
    """Columns with letters in the lower half of a rectangle, from its left."""
    x0, y0, x1, y1 = (round(edge) for edge in place)
    rows = range((y0 + y1) // 2 + 2, y1)
    return [x - x0 for x in range(x0, min(x1, picture.width)) if any(max(picture.at(x, y)) > 120 for y in rows)]


def key_card(bench):
    """F1, ? and the button show all keys over the picture; each and Esc take them away, and Esc does no more."""
    file = bench.folder / "keys.png"
    with bench.open("--picture", str(file), "--paused", "--size", "1000x700") as window:
        for opens, closes in (("F1", "Escape"), ("?", "F1"), ("F1", "?")):
            for key, there in ((opens, True), (closes, False)):
                window.press_shifted("slash") if key == "?" else window.press_key(key)
                window.wait_for_control("Key card", there)
            print(f"ok: {opens} shows it, {closes} takes it away")
        window.is_running()
        window.click("Keys (F1)")
        window.wait_for_control("Key card")
        time.sleep(0.3)
        x0, y0, x1, y1 = (round(edge) for edge in window.controls()["Key card"])
        window.stop()
    check(318 <= x0 and x1 <= 1000 and y0 > 0 and y1 < 700, f"all of it is over the picture: {x0}, {y0}, {x1}, {y1}")
    with bench.open("--paused", "--size", "640x480") as window:
        window.press_key("F1")
        window.wait_for_control("Key card")
        time.sleep(0.3)
        left, top, right, bottom = window.controls()["Key card"]
        window.stop()
    check(left >= 0 and right <= 640 and top >= 0 and bottom <= 480 and bottom - top > 400,
          f"in a small window as well, with small text: {left:.0f}, {top:.0f}, {right:.0f}, {bottom:.0f}")
    picture = read_png(file)
    lit = [any(max(picture.at(x, y)) > 150 for x in range(x0 + 14, x1)) for y in range(y0, y1)]
    lines = sum(1 for above, here in zip(lit, lit[1:]) if here and not above)
    check(lines >= 19, f"it has {lines} lines of text")
