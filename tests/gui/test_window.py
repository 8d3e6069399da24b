#!/usr/bin/python3
"""The window as a person uses it: sliders, menus, keys, and what the report then says.

test_window.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: no Xvfb or no xdotool
test_window.py PROGRAM --hands-off   all cases, but no key or button is pressed: exit 0 if each of them fails

Each case works several controls of one window. Undriven, a window shows the court: 2000 parcels, restitution 0.9,
area fraction 0.1, method impulse, search grid, ball 15 m/s and 25 rad/s, all threads.
"""
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from window import Screen, Window, skip_if_missing, wait_for

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_png

RUN_S = 1.0  # of a flight of 9 s, so that the ball is not yet launched again
NEARLY_STILL = ("--time-scale", "0.001")  # while the hands are busy; the ball moves by 15 mm in a second
# Whole steps of a known length, one per frame.
STEPWISE = ("--dt", "0.001", "--substeps", "1")
STEP_M = 15.0 * 0.001


class Bench:
    """What a case needs to open windows."""

    def __init__(self, program, screen, folder, hands_off):
        self.program, self.screen, self.folder, self.hands_off = program, screen, pathlib.Path(folder), hands_off

    def open(self, *words, **how):
        return Window(self.program, self.screen, self.folder, words, self.hands_off, **how)


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def values(bench):
    """Sliders by dragging, menus by choosing: each has a place in the report."""
    with bench.open() as window:
        window.drag_slider("Parcels N", 0.55, 0.5)
        window.drag_slider("Restitution", 0.9, 0.3)
        window.drag_slider("Area fraction", 0.142, 0.25)
        window.choose("Method", "spring")
        window.choose("Neighbours", "all-pairs")
        window.drag_slider("Threads", 0.0, 0.5)
        window.drag_slider("Substeps", 0.0, 0.5)
        time.sleep(0.3)
        report = window.stop()
    # The slider is logarithmic, from 1 to a million: half of it are 1000, a pixel is a sixth.
    check(800 < report["num_parcels"] < 1250, f"N is the slider's: {report['num_parcels']}")
    check(abs(report["restitution"] - 0.3) < 0.02, f"restitution is the slider's: {report['restitution']:.3f}")
    check(abs(report["area_fraction"] - 0.176) < 0.02, f"area fraction is the slider's: {report['area_fraction']:.3f}")
    check(report["method"] == "spring", f"method is that chosen: {report['method']}")
    check(report["neighbors"] == "all-pairs", f"search is that chosen: {report['neighbors']}")
    threads = max((os.cpu_count() + 1) // 2, 1)
    check(report["device"].endswith(f", {threads} thread{'s' if threads > 1 else ''}"),
          f"half of the threads are left: {report['device']}")
    # A frame of 1/600 s of simulated time in 32 steps, or 31 or 33, a pixel being a third of one.
    check(abs(report["dt_s"] * 32 * 600 - 1.0) < 0.05, f"a frame has 32 steps: {report['dt_s'] * 1e6:.1f} us each")


def typed(bench):
    """Numbers typed after control and click: taken, put into the range, or refused."""
    with bench.open() as window:
        window.type_value("Time step", "0.0002")
        window.type_value("Restitution", "7")
        window.type_value("Ball spin", "1e999")
        window.type_value("Parcels N typed", "777")
        time.sleep(0.3)
        report = window.stop()
    check(report["dt_s"] == 0.0002, f"the time step is that typed: {report['dt_s']} s")
    check(report["restitution"] == 1.0, f"restitution 7 is put into its range: {report['restitution']}")
    spin = report["ball"]["spin_radps"]
    check(10.0 < spin < 25.5, f"an infinite spin is refused, the scene's stays: {spin:.1f} rad/s")
    check(report["num_parcels"] == 777, f"N is that typed: {report['num_parcels']}")


def ball_spin(bench):
    """Undriven, hits brake the spin of 25 rad/s at once, and the ball drifts to the left at less than 2 m/s."""
    with bench.open() as window:
        window.drag_slider("Friction", 0.3, -0.1)
        window.type_value("Ball spin", "140")
        window.press_key("r")
        time.sleep(RUN_S)
        ball = window.stop()["ball"]
    check(abs(ball["spin_radps"] - 140.0) < 1e-9 and ball["hits"] > 20,
          f"spin is that typed, and without friction {ball['hits']} hits leave it alone: {ball['spin_radps']:.9f} rad/s")
    check(ball["vy_mps"] > 2.5, f"and it bends the flight: {ball['vy_mps']:.2f} m/s across")


def magnus(bench):
    """The slider of the spin goes from -200 to 200 rad/s."""
    with bench.open() as window:
        window.click("Magnus")
        window.drag_slider("Ball spin", 0.56, 0.85)
        window.press_key("r")
        time.sleep(RUN_S)
        ball = window.stop()["ball"]
    # 0.85 of the slider are 140 rad/s; a pixel is 3 rad/s, and parcels brake the ball by some per cent.
    check(115.0 < ball["spin_radps"] < 145.0, f"spin is the slider's: {ball['spin_radps']:.1f} rad/s")
    check(abs(ball["vy_mps"]) < 1.0, f"without Magnus term it bends nothing: {ball['vy_mps']:.2f} m/s across")


def launch(bench):
    """In a vacuum the ball keeps the speed that it is launched with."""
    with bench.open(*NEARLY_STILL) as window:
        window.choose("Air", "vacuum")
        window.drag_slider("Launch speed", 0.25, 0.5)
        window.drag_slider("Launch angle", 0.5, 0.625)
        window.click("Launch")
        time.sleep(0.3)
        report = window.stop()
    ball = report["ball"]
    check(report["num_parcels"] == 0, "without parcels")
    speed, angle = math.hypot(ball["vx_mps"], ball["vy_mps"]), math.degrees(math.atan2(ball["vy_mps"], ball["vx_mps"]))
    check(abs(speed - 30.0) < 0.5, f"speed is the slider's: {speed:.2f} m/s")  # a pixel is a third of a m/s
    check(abs(angle - 45.0) < 4.0, f"angle is the slider's: {angle:.1f} degrees")  # a pixel is 2 degrees


def terms(bench):
    """Undriven, parcels of the court meet 10^5 times in a second of simulated time, and 400 leave."""
    with bench.open(*NEARLY_STILL) as window:
        window.choose("Boundary", "walls")
        window.click("Contacts")
        window.drag_slider("Parcel speed", 0.1, 0.5)
        window.click("Held")
        window.drag_slider("Time scale", 1 / 3, 1.05)
        time.sleep(1.5)
        report = window.stop()
    check(report["simulated_s"] > 0.2, f"time runs fast: {report['simulated_s']:.2f} s are simulated")
    check(report["num_retired"] < 10, f"behind walls nothing leaves: {report['num_retired']} did")
    check(report["collisions"]["count"] < 200, f"without contacts, few collisions: {report['collisions']['count']}")
    # N m c^2 = 0.144 J at 1 m/s, 3.6 J at 5 m/s; the ball has 2.9 J and keeps it.
    gained = report["energy"]["final_j"] - report["energy"]["initial_j"]
    check(2.0 < gained < 12.0, f"parcels are as fast as the slider says: {gained:.2f} J more")
    check(report["ball"]["distance_m"] < 0.2, f"the ball is held: {report['ball']['distance_m']:.3f} m flown")


MINI = '[scene]\nname = "{}"\n[world]\nboundary = "walls"\n[air]\nnum_parcels = 321\nrestitution = 0.77\n'


def scene_menu(bench):
    """A scene of its own from the menu; then one that cannot be loaded, which leaves all as it is."""
    scenes = bench.folder / "scenes"
    scenes.mkdir(exist_ok=True)
    (scenes / "mini.toml").write_text(MINI.format("mini"))
    (scenes / "broken.toml").write_text(MINI.format("broken").replace("restitution", "restituton"))
    with bench.open("--set", "air.restitution=0.2", environment={"PICKLEFLIGHT_ASSETS": str(bench.folder)}) as window:
        window.choose("Scene", "mini")
        window.choose("Scene", "broken")
        time.sleep(RUN_S)
        window.is_running()
        report = window.stop()
    check(report["scene"] == "mini" and report["num_parcels"] == 321, f"it is the chosen scene: {report['scene']}")
    check(report["restitution"] == 0.77, f"what the command line had set is gone: {report['restitution']}")
    check(report["steps"] > 0 and report["num_retired"] == 0, f"and it runs: {report['steps']} steps")
    check(report["ball"]["distance_m"] > 0.2, f"after the broken one, too: {report['ball']['distance_m']:.2f} m")


def fresh_hash(bench, num_frames, words=STEPWISE):
    """State after so many frames of the same scene, without a window."""
    file = bench.folder / "fresh.json"
    subprocess.run([bench.program, "--headless", "-p", "2000", *words, "--seconds", str(num_frames / 60), "--report",
                    str(file)], check=True, stderr=subprocess.DEVNULL)
    return json.loads(file.read_text())["state_hash"]


def stepped(report, num_steps):
    distance = report["ball"]["distance_m"]
    # Parcels brake it, by less than a hundredth a step; a step more or less would be a third.
    check(abs(distance / (num_steps * STEP_M) - 1.0) < 0.05, f"{num_steps} steps since the launch: {distance:.4f} m")


def keys(bench):
    """Space, R, S."""
    with bench.open(*STEPWISE) as window:
        window.press_key("space")
        window.wait_for_control("Run")
        window.press_key("r")
        for _ in range(3):
            window.press_key("s")
        time.sleep(0.5)
        report = window.stop()
    stepped(report, 3)
    check(report["state_hash"] == fresh_hash(bench, 3), "R: the run is the same as one just begun")


def launch_key(bench):
    """Space once more runs on; L launches the ball, but the air is that of before."""
    with bench.open(*STEPWISE) as window:
        window.press_key("space")
        window.wait_for_control("Run")
        window.press_key("space")
        window.wait_for_control("Run", there=False)
        window.press_key("space")
        window.wait_for_control("Run")
        window.press_key("l")
        for _ in range(2):
            window.press_key("s")
        report = window.stop()
    stepped(report, 2)
    check(report["steps"] > 2 and report["state_hash"] != fresh_hash(bench, 2), "L: the air is not that of the start")


def buttons(bench):
    """Pause, Reset, Step with the mouse."""
    with bench.open(*STEPWISE) as window:
        window.click("Pause")
        window.wait_for_control("Run")
        window.click("Reset")
        for _ in range(2):
            window.click("Step")
        report = window.stop()
    stepped(report, 2)
    check(report["state_hash"] == fresh_hash(bench, 2), "Reset: the run is the same as one just begun")


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


def is_line(picture, x):
    """A column that is bright over a fifth of the picture: a line across the court."""
    return sum(1 for y in range(picture.height) if is_bright(picture.at(x, y))) > picture.height / 5


def is_bright(color):
    return min(color) > 150


def is_yellow(color):
    return color[0] > 100 and color[1] > 90 and color[2] < 0.8 * color[0] and color[0] > color[1]


def slingshot(bench):
    """A pull of 60 pixels left and 40 down is 15 m/s to the right and 10 up; with Shift, 80 up are 40 rad/s more."""
    with bench.open(*NEARLY_STILL, "--set", "air.kind=vacuum", "--set", "ball.vx_mps=3") as window:
        window.drag("Ball's start", [(-30, 10), (-30, 30)])
        time.sleep(0.3)
        window.drag("Ball's start", [(0, -50), (0, -30)], shift=True)
        time.sleep(0.3)
        ball = window.stop()["ball"]
    speed = math.hypot(ball["vx_mps"], ball["vy_mps"])
    check(abs(speed - math.hypot(15.0, 10.0)) < 0.01, f"speed is that pulled: {speed:.2f} m/s")
    check(abs(ball["vy_mps"] / ball["vx_mps"] - 2 / 3) < 0.02, f"and so is the direction: {ball['vy_mps']:.2f} up")
    check(abs(ball["spin_radps"] - 65.0) < 0.01, f"spin is that dragged with Shift: {ball['spin_radps']:.2f} rad/s")
    check(ball["distance_m"] < 0.2, f"it starts anew: {ball['distance_m']:.3f} m flown")


def method_key(bench):
    """M: the next method with the same launch; Shift+M: half the step. B: back to where the flight began."""
    with bench.open(*STEPWISE, "--paused") as window:
        window.press_key("s")
        window.press_key("m")
        window.press_shifted("m")
        for _ in range(3):
            window.press_key("s")
        window.press_key("b")
        for _ in range(2):
            window.press_key("s")
        report = window.stop()
    check(report["method"] == "spring", f"M: the method is the next: {report['method']}")
    check(report["dt_s"] == 0.0005, f"Shift+M: the step is half of 1 ms: {report['dt_s'] * 1e3} ms")
    fresh = fresh_hash(bench, 2, ("--dt", "0.0005", "--substeps", "1", "--method", "spring"))
    check(report["state_hash"] == fresh, "B: two steps from the start again, as of a run just begun")


def time_keys(bench):
    """Started paused, nothing moves; then a frame of 1/60 s at time scale 0.1 * 2 * 2 / 2."""
    with bench.open("--paused", "--substeps", "1", "--set", "air.kind=vacuum") as window:
        time.sleep(0.5)
        for key in ("bracketright", "bracketright", "bracketleft", "s"):
            window.press_key(key)
        report = window.stop()
    check(report["steps"] == 1, f"--paused: one step only, that of S: {report['steps']}")
    check(abs(report["dt_s"] * 60 - 0.2) < 1e-9, f"] and [: time scale {report['dt_s'] * 60:.3f}")


def save(bench):
    """The panel's settings as a scene, loaded back by name; a file that is there stays as it is."""
    file = bench.folder / "saved.toml"
    file.unlink(missing_ok=True)
    with bench.open("--set", "air.restitution=0.4", "--paused") as window:
        for header in ("Ball", "Air", "Method", "View"):
            window.click(f"{header} header")
        window.click("Show header")
        window.wait_for_control("Scene file")
        window.type_text("Scene file", str(file))
        window.click("Save")
        wait_for("saved scene", file.exists, 1.0 if bench.hands_off else 5.0)
        window.stop()
    done = subprocess.run([bench.program, "--headless", "--seconds", "0.02", "--scene", str(file), "--report",
                           str(bench.folder / "saved.json")], stderr=subprocess.DEVNULL)
    report = json.loads((bench.folder / "saved.json").read_text())
    check(done.returncode == 0 and report["scene"] == "saved", f"it loads under its name: {report['scene']}")
    check(report["restitution"] == 0.4 and report["num_parcels"] == 2000, "with the settings of the window")


def looks(bench):
    """D, C, +, F11 and ghosts, seen in the last picture; what the overlay shows is in a file."""
    file, csv = bench.folder / "looks.png", bench.folder / "overlay.csv"
    with bench.open("--picture", str(file), "--overlay-csv", str(csv), "--paused") as window:
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


def vsync_key(bench):
    """V: frames wait for the screen, or do not."""
    for words, after in (((), False), (("--no-vsync",), True)):
        with bench.open(*words) as window:
            window.press_key("v")
            time.sleep(0.2)
            display = window.stop()["display"]
        check(display["vsync"] is after, f"V after {words or 'nothing'}: vsync is {display['vsync']}")


ELASTIC = ("--scene", "gas", "--set", "run.dt_s=0.1", "--paused")


def open_accuracy(window):
    for header in ("Ball", "Air"):
        window.click(f"{header} header")
    window.click("Accuracy header")
    window.wait_for_control("Work-precision")
    time.sleep(0.3)


def accuracy(bench):
    """What the open section reads out is what the report finds; its slider does what --accuracy does."""
    with bench.open(*ELASTIC) as window:
        open_accuracy(window)
        window.press_key("space")
        time.sleep(1.0)
        window.press_key("space")
        time.sleep(0.7)
        report = window.stop()
    shown = report["accuracy"]
    check(shown is not None and shown["simulated_s"] > 1.0, f"it is read out: {shown}")
    drift = report["energy"]["relative_drift"]
    check(abs(drift) > 1e-4 and math.isclose(shown["energy_drift"], drift, rel_tol=1e-6), f"energy drift: {drift:.2e}")
    check(shown["num_collisions"] == report["collisions"]["count"], f"collisions: {shown['num_collisions']}")
    check(shown["max_overlap_diameters"] == report["max_overlap_diameters"], "largest overlap")
    rates = report["collisions"]
    ratio = rates["rate_per_parcel_per_s"] / rates["enskog_rate_per_parcel_per_s"]
    check(math.isclose(shown["rate_over_enskog"], ratio, rel_tol=1e-3), f"rate over Enskog's: {ratio:.3f}")
    for of in (None, "pressure"):
        chosen = chosen_by_flag(bench, "gas", 5, of)
        shown = chosen_in_panel(bench, ELASTIC, 5, of)
        check((shown["method"], shown["dt_s"]) == (chosen["method"], chosen["dt_s"]),
              f"5 % of {of or 'what suits the scene'}: {shown['method']}, {shown['dt_s']:.4f} s, as by --accuracy 5%")
    # An error at which path and drag, the default, ask for different steps, so that the menu tells them apart.
    for percent in (5, 10, 3, 1):
        chosen = {of: chosen_by_flag(bench, "court", percent, of) for of in ("path", "drag")}
        steps = {of: (report["method"], report["dt_s"]) for of, report in chosen.items()}
        if steps["path"] != steps["drag"]:
            break
    check(steps["path"] != steps["drag"], f"path and drag ask for different steps: {steps}")
    shown = chosen_in_panel(bench, ("--scene", "court", "-p", "2000", "--paused"), percent, "path")
    step = (shown["method"], shown["dt_s"])
    check(step == steps["path"], f"{percent} % of path: {step}")


def chosen_by_flag(bench, scene, percent, of):
    """The report of a short run with --accuracy."""
    file = bench.folder / "chosen.json"
    subprocess.run([bench.program, "--headless", "--scene", scene, "-p", "2000", "--accuracy", f"{percent}%", "--seconds",
                    "0.02", "--report", str(file), *(("--of", of) if of else ())], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    return json.loads(file.read_text())


def chosen_in_panel(bench, words, percent, of):
    """The report of a window in which the accuracy is typed, after the menu named what it is of."""
    with bench.open(*words) as window:
        open_accuracy(window)
        if of:
            window.choose("Error of", of)
        window.type_value("Accuracy", str(percent))
        window.press_key("s")
        time.sleep(0.3)
        return window.stop()


def unstable(bench):
    """A contact that the step does not resolve is refused while it flies, too, unless it was forced."""
    too_long = ("--dt", "0.002", "--substeps", "1", "--set", "run.spring_contact_s=0.002")
    for words, method in (((), "impulse"), (("--force",), "spring")):
        with bench.open(*too_long, *words) as window:
            window.choose("Method", "spring")
            time.sleep(0.3)
            report = window.stop()
        check(report["method"] == method, f"spring in steps of its contact{' forced' if words else ''}: {report['method']}")


def dense_screen(bench):
    """At twice the usual pixels per inch everything has twice the pixels, and the mouse finds it there."""
    widths = []
    try:
        for dpi in (96, 192):
            bench.screen.set_dpi(dpi)
            with bench.open("--size", "480x380") as window:
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


def wider(window, width):
    x0, _, x1, _ = window.controls()["Restitution"]
    return x1 - x0 > 1.15 * width


def stays(bench):
    """The length that a scene has for a headless run does not close a window; --seconds does."""
    (bench.folder / "short.toml").write_text("[run]\nseconds = 0.2\n")
    with bench.open("--scene", str(bench.folder / "short.toml")) as window:
        time.sleep(1.0)
        check(window.is_running(), "a window outlives the seconds of its scene")
        window.end()
    with bench.open("--seconds", "2") as window:
        check(window.process.wait(timeout=20) == 0, "and ends after --seconds")


def leave(bench):
    """H hides the panel and shows it; Esc ends."""
    with bench.open() as window:
        check("Ball spin" in window.controls(), "the panel is there at first")
        window.press_key("h")
        window.wait_for_control("Ball spin", there=False)
        print("ok: H hides it")
        window.press_key("h")
        window.wait_for_control("Ball spin")
        print("ok: H again shows it")
        report = window.end()
        check(report["steps"] > 0 and report["scene"] == "court", "Esc ends with exit code 0 and a report")


CASES = {case.__name__: case for case in (values, typed, ball_spin, magnus, launch, terms, scene_menu, keys, launch_key,
                                          buttons, view_keys, slingshot, method_key, time_keys, save, looks, vsync_key, accuracy,
                                          unstable, dense_screen, stays,
                                          leave)}


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
    names = list(CASES) if hands_off else words
    with Screen() as screen, tempfile.TemporaryDirectory() as folder:
        bench = Bench(program, screen, folder, hands_off)
        if hands_off:
            blind = [name for name in names if not fails(CASES[name], bench)]
            sys.exit(f"FAILED: blind: {', '.join(blind)}" if blind else 0)
        for name in names:
            CASES[name](bench)


if __name__ == "__main__":
    main()
