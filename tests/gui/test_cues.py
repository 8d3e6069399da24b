#!/usr/bin/python3
"""A talk in the window: cues by keys and panel, their titles, undo, and the way back to the scene's values.

test_cues.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: no Xvfb or no xdotool
test_cues.py PROGRAM --hands-off   all cases, but no key or button is pressed: exit 0 if each of them fails
"""
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from bench import NEARLY_STILL, Bench, check
from window import SKIPPED, Screen, skip_if_missing, wait_for

for folder in ("cli", "golden"):
    sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / folder))
from film import frame
from png import read_png

TALK = """
[[cue]]
title = "Alpha"
title_s = 0
air.num_parcels = 500

[[cue]]
title = "Beta"
subtitle = "the second"
title_s = 2
air.num_parcels = 500
air.restitution = 0.25
camera = { center_m = [-6.4, -1.4], width_m = 2 }
paused = true

[[cue]]
title = "Gamma"
scene = "gas"
air.num_parcels = 100
"""


def talk_of(bench, text=TALK):
    file = bench.folder / "talk.toml"
    file.write_text(text)
    return str(file)


def title(name):
    return f"Cue title: {name}"


def far(place, other):
    """Pixels between the corners of two rectangles."""
    return math.hypot(place[0] - other[0], place[1] - other[1])


def lit(picture, place):
    """Bright pixels in a rectangle."""
    x0, y0, x1, y1 = (round(edge) for edge in place)
    return sum(1 for y in range(y0, y1) for x in range(x0, x1) if min(picture.at(x, y)) > 170)


def cue_keys(bench):
    """Digits, page down and page up go to cues; title, settings, pause and camera are the cue's."""
    file = bench.folder / "last.png"
    words = ("--cues", talk_of(bench), "--threads", "1", "--picture", str(file), "-p", "500", *NEARLY_STILL)
    with bench.open(*words) as window:
        window.wait_for_control(title("Alpha"))
        window.press_key("2")
        window.wait_for_control(title("Beta"))
        window.wait_for_control("Cue 2 current")
        window.wait_for_control("Run")
        print("ok: 2: the second cue, which is paused")
        start = window.controls()["Ball's start"]
        # 1280-318 pixels show 2 m around the ball's start; here 800-318, and 136 of the overlay below.
        check(abs(start[0] - (318 + 241)) < 3, f"its camera is at the ball: {start}")
        window.wait_for_control(title("Beta"), there=False)
        print("ok: its title goes after two seconds")
        window.press_key("Next")
        window.wait_for_control(title("Gamma"))
        window.press_key("Prior")
        window.press_key("Prior")
        window.wait_for_control(title("Alpha"))
        window.press_key("Prior")
        window.wait_for_control("Notice: There is no such cue: the list has 3")
        window.click("Cue 2")
        window.wait_for_control(title("Beta"))
        time.sleep(0.6)
        place, bar = window.controls()[title("Beta")], window.controls()["Timeline"]
        report = window.stop()
    check(report["restitution"] == 0.25 and report["simulated_s"] == 0.0, f"the cue's settings: {report['restitution']}")
    picture = read_png(file)
    check(lit(picture, place) > 150, f"the title is in the picture, at {place}: {lit(picture, place)} pixels")
    check(place[0] > 318 and place[3] <= bar[1], f"beside the panel, above the timeline: {place[3]:.0f} <= {bar[1]:.0f}")


def talk_is_clear(bench):
    """The magnifier keeps clear of the titles of the shipped talk, also with large text."""
    for scale in ("1.5", "2"):
        with bench.open("--cues", "talk", "--ui-scale", scale, "--size", "1280x720") as window:
            for key, name in (("8", "A real ball"),):
                window.press_key(key)
                window.wait_for_control(title(name))
                window.wait_for_control("Magnifier square")
                window.wait_frames()
                places = window.controls()
                a, b = places[title(name)], places["Magnifier square"]
                covers = min(a[2], b[2]) > max(a[0], b[0]) and min(a[3], b[3]) > max(a[1], b[1])
                check(not covers, f"cue {key}, text {scale}: title {a}, magnifier {b}")
            window.stop()


def title_above_profile(bench):
    """The title of a cue stands above the strip of a scene with a profile."""
    text = TALK.replace('scene = "gas"', 'scene = "blast"').replace('"Gamma"', '"Gamma"\ntitle_s = 0')
    with bench.open("--cues", talk_of(bench, text), *NEARLY_STILL) as window:
        window.press_key("3")
        window.wait_for_control(title("Gamma"))
        window.wait_for_control("profile")
        places = window.controls()
        window.stop()
    low, top = places[title("Gamma")][3], places["profile"][1]
    check(low <= top, f"the title ends at {low:.0f}, the strip begins at {top:.0f}")


def cue_list_files(bench):
    """Without a list a digit says so; a list is loaded in the panel, a broken one changes nothing, and a cue is added."""
    good = talk_of(bench)
    broken = bench.folder / "broken.toml"
    broken.write_text(TALK.replace("restitution", "restituton"))
    own = bench.folder / "own.toml"
    own.unlink(missing_ok=True)
    with bench.open("--set", "air.restitution=0.4", "--paused", "--size", "1000x790") as window:
        window.press_key("1")
        window.wait_for_control("Notice: There are no cues: start with --cues FILE.toml, or load a list in the panel")
        for header in ("Ball", "Air", "Method", "View"):
            window.click(f"{header} header")
        window.click("Presenting header")
        window.wait_for_control("Cue file")
        window.type_text("Cue file", str(own))
        window.click("Cue title")
        window._press("type", "--delay", "60", "Mine")
        window.click("Add")
        wait_for("saved cue", own.exists, 1.0 if bench.hands_off else 5.0)
        window.wait_for_control("Cue 1 current")
        window.stop()
    check('title = "Mine"' in own.read_text() and "air.restitution = 0.4" in own.read_text(), own.read_text())
    done = subprocess.run([bench.program, "--headless", "--seconds", "0.02", "--size", "64x64", "--cues", str(own), "--report",
                           str(bench.folder / "own.json")], stderr=subprocess.DEVNULL)
    report = json.loads((bench.folder / "own.json").read_text())
    check(done.returncode == 0 and report["restitution"] == 0.4 and report["num_parcels"] == 2000, "the cue added flies")
    with bench.open("--cues", good, "--size", "1000x790") as window:
        load(window, broken)
        wait_for("notice of the error",
                 lambda: any("broken.toml" in name and ":" in name for name in window.controls() if name.startswith("Notice")))
        window.wait_for_control("Cue 1 current")
        print("ok: a broken list changes nothing")
        load(window, own)
        window.wait_for_control(title("Mine"))
        report = window.stop()
    check(report["restitution"] == 0.4, "a good one begins with its first cue")


def load(window, file):
    window.click("Cue file")
    ctrl(window, "ctrl", "a")
    window._press("type", "--delay", "60", str(file))
    window.click("Load")


def cue_film(bench):
    """A film without overlay has the title, and then has it no more."""
    if shutil.which("ffmpeg") is None:
        print("SKIPPED: ffmpeg not found")
        sys.exit(SKIPPED)
    film = bench.folder / "talk.mp4"
    talk = talk_of(bench, TALK.replace("title_s = 2", "title_s = 1.5"))
    with bench.open("--cues", talk, "--record", str(film), "--record-size", "640x360", "--record-overlay", "off") as window:
        window.wait_for_control(title("Alpha"))
        window.press_key("2")
        window.wait_for_control(title("Beta"))
        window.wait_for_control(title("Beta"), there=False)
        time.sleep(0.3)
        report = window.stop()
    num = report["record"]["frames"]
    bright = [letters(frame(str(film), at), 640, 360) for at in (*range(10, min(90, num - 2), 10), num - 2)]
    check(max(bright) > 30 and bright[-1] < 5, f"letters at the lower left, at first and at the end: {bright}")


def letters(rgb, width, height):
    """Pixels of letters, which are grey at their edges, at the lower left."""
    pixels = ((x, y) for y in range(height - 60, height - 5) for x in range(14, 120))
    return sum(1 for x, y in pixels if min(rgb[3 * (y * width + x):3 * (y * width + x) + 3]) > 120)


def ctrl(window, *keys):
    for key in keys[:-1]:
        window._press("keydown", key)
    window.press_key(keys[-1])
    for key in reversed(keys[:-1]):
        window._press("keyup", key)


def undo(bench):
    """Ctrl+Z takes back a drag as one change, a key, a new air; Ctrl+Y and Ctrl+Shift+Z go forward; a cue comes back."""
    with bench.open("--cues", talk_of(bench), "-p", "500", *NEARLY_STILL) as window:
        window.drag_slider("Restitution", 0.9, 0.3)
        window.press_key("bracketright")
        window.drag_slider("Friction", 0.3, 0.6)
        ctrl(window, "ctrl", "z")
        window.wait_for_control("Notice: Undone: ball.friction is 0.3")
        ctrl(window, "ctrl", "z")
        window.wait_for_control("Notice: Undone: run.time_scale is 0.001")
        ctrl(window, "ctrl", "z")
        window.wait_for_control("Notice: Undone: air.restitution is 0.9")
        ctrl(window, "ctrl", "z")
        window.wait_for_control("Notice: Nothing to undo")
        ctrl(window, "ctrl", "y")
        wait_for("redone", lambda: any("Redone: air.restitution" in name for name in window.controls()), 5.0)
        ctrl(window, "ctrl", "shift", "z")
        window.wait_for_control("Notice: Redone: run.time_scale is 0.002")
        window.press_key("3")
        window.wait_for_control("Cue 3 current")
        ctrl(window, "ctrl", "z")
        window.wait_for_control("Notice: Undone: scene court; the flight starts again")
        window.wait_for_control("Cue 1 current")
        report = window.stop()
    check(report["scene"] == "court", f"the scene of before: {report['scene']}")
    check(abs(report["restitution"] - 0.3) < 0.03, f"with what was changed in it: {report['restitution']:.3f}")


def cue_left(bench):
    """A scene from the menu leaves no cue marked; page down goes on from the one that it ended, undo comes back to it."""
    with bench.open("--cues", talk_of(bench), *NEARLY_STILL) as window:
        window.wait_for_control("Cue 1 current")
        start = window.controls()["Ball's start"]
        window.choose("Scene", "gas")
        window.wait_for_control("Cue 1 current", there=False)
        window.wait_for_control("Cue 1")
        window.scroll(560, 350, 4)
        ctrl(window, "ctrl", "z")
        window.wait_for_control("Cue 1 current")
        wait_for("view of the cue", lambda: far(window.controls().get("Ball's start", (0, 0)), start) < 3.0, 5.0)
        print("ok: undo brings the cue's view back")
        ctrl(window, "ctrl", "y")
        window.wait_for_control("Cue 1 current", there=False)
        window.press_key("Next")
        window.wait_for_control("Cue 2 current")
        report = window.stop()
    check(report["restitution"] == 0.25, f"the cue's settings: {report['restitution']}")


def scene_values(bench):
    """A dot marks a value that is not the scene's; dot, double click and right click go back to it."""
    with bench.open("--set", "air.restitution=0.8", *NEARLY_STILL) as window:
        check(not [name for name in window.controls() if name.endswith(" dot")], "no dot at first")
        for label, share in (("Restitution", 0.3), ("Friction", 0.7), ("Parcels N", 0.4), ("Ball spin", 0.8)):
            window.drag_slider(label, share, share)
            window.wait_for_control(f"{label} dot")
        window.choose("Method", "spring")
        window.wait_for_control("Method dot")
        window.click("Magnus")
        window.wait_for_control("Magnus dot")
        window.click("Restitution dot")
        window.wait_for_control("Restitution dot", there=False)
        window._move_to("Friction label")
        for _ in range(5):  # a slow frame may see two clicks as one
            if "Friction dot" in window.controls():
                window._press("click", "--repeat", "2", "--delay", "130", "1")
        window.wait_for_control("Friction dot", there=False)
        for label in ("Parcels N label", "Method label", "Magnus"):
            window._move_to(label)
            window._press("mousedown", "3")
            window._press("mouseup", "3")
            window.wait_for_control(f"{label.removesuffix(' label')} dot", there=False)
        window.wait_for_control("Ball spin dot")
        report = window.stop()
    check(report["restitution"] == 0.8 and report["num_parcels"] == 2000 and report["method"] == "impulse",
          f"the values at the start are back: {report['restitution']}, {report['num_parcels']}, {report['method']}")


CASES = {case.__name__: case
         for case in (cue_keys, talk_is_clear, title_above_profile, cue_list_files, cue_left, cue_film, undo, scene_values)}


def fails(case, bench):
    try:
        case(bench)
    except AssertionError as error:
        print(f"{case.__name__} failed, as it should: {error}")
        return True
    print(f"{case.__name__} PASSED WITHOUT HANDS")
    return False


def main():
    program, words = sys.argv[1], sys.argv[2:]
    skip_if_missing()
    hands_off = words == ["--hands-off"]
    with Screen() as screen, tempfile.TemporaryDirectory() as folder:
        bench = Bench(program, screen, folder, hands_off)
        if hands_off:
            blind = [name for name, case in CASES.items() if not fails(case, bench)]
            sys.exit(f"FAILED: blind: {', '.join(blind)}" if blind else 0)
        for name in words:
            CASES[name](bench)


if __name__ == "__main__":
    main()
