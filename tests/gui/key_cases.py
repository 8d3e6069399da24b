"""Cases of the keys, the buttons and the slingshot."""
import csv
import math
import pathlib
import statistics
import sys
import time

from bench import NEARLY_STILL, STEPWISE, check, fresh_hash, stepped

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_png


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
    check(report["state_hash"] == fresh_hash(bench, 3), "R: the run equals one just begun")


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
    check(report["steps"] > 2 and report["state_hash"] != fresh_hash(bench, 2), "L: the air is not the one of the start")


def other_keyboards(bench):
    """Keys go by the letter that they bear. On a French keyboard M is where others have a semicolon, and the comma is where
    they have M; on a German one AltGr with 8 is a bracket."""
    with bench.screen.layout("fr"), bench.open("--substeps", "1", "--paused") as window:
        for key in ("m", "m", "comma"):
            window.press_key(key)
        report = window.stop()
    check(report["method"] == "exact", f"M twice and a comma: {report['method']}")
    with bench.screen.layout("de"), bench.open("--substeps", "1", "--paused", "--set", "air.kind=vacuum") as window:
        window.press_with("ISO_Level3_Shift", "8")
        controls = window.controls()
        window.press_key("s")
        report = window.stop()
    check(abs(report["dt_s"] * 60 - 0.05) < 1e-9, f"a bracket halves the pace: time scale {report['dt_s'] * 60:.3f}")
    check(not any("cue" in control for control in controls if control.startswith("Notice")), "and asks for no cue")


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
    check(report["state_hash"] == fresh_hash(bench, 2), "Reset: the run equals one just begun")


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


def ring(bench):
    """Near the ball a ring appears, with a hint until the first launch by hand; a press in its reach takes the ball."""
    file = bench.folder / "ring.png"
    with bench.open("--paused", *NEARLY_STILL, "--set", "air.kind=vacuum", "--picture", str(file)) as window:
        window.point_at("Ball's start", (150, 0))
        time.sleep(0.3)
        check(not rings(window), "none from afar")
        window.point_at("Ball's start", (40, 0))
        window.wait_for_control("Ring and hint")
        window.drag("Ball's start", [(-30, 10), (-30, 30)], off=(15, 15))  # 21 of 24 pixels
        window.point_at("Ball's start", (40, 0))
        window.wait_for_control("Ring")
        window.wait_for_control("Ring and hint", there=False)
        x0, y0, x1, y1 = window.controls()["Ball's start"]  # late, below the legend that has come
        ball = window.stop()["ball"]
    check(abs(ball["vx_mps"] - 15.0) < 0.05 and abs(ball["vy_mps"] - 10.0) < 0.05, f"taken beside it: {ball}")
    picture = read_png(file)
    x, y = round(0.5 * (x0 + x1)), round(0.5 * (y0 + y1))
    shades = [picture.at(x, y - up) for up in range(9, 16)]
    check(any(red > 180 and green > 150 and blue < 130 for red, green, blue in shades), f"a ring is seen: {shades}")


def rings(window):
    return [label for label in window.controls() if label.startswith("Ring")]


def back_key(bench):
    """B says for two seconds to what time it went; without a moment to go back to, only why it did not."""
    with bench.open(*STEPWISE, "--paused") as window:
        window.press_key("b")
        time.sleep(0.5)
        check(not notices(window), f"refused: {notices(window)}")
        for _ in range(5):
            window.press_key("s")
        window.press_key("b")
        window.wait_for_control("Notice: Back to 0.00 s")
        window.wait_for_control("Notice: Back to 0.00 s", there=False)
        report = window.stop()
    check(report["ball"]["distance_m"] == 0.0, f"B: the ball is at its start: {report['ball']['distance_m']} m")


def notices(window):
    return [label for label in window.controls() if label.startswith("Notice")]


def slingshot_paused(bench):
    """Letting go starts time; a click on the ball does not."""
    with bench.open("--paused", *NEARLY_STILL, "--set", "air.kind=vacuum") as window:
        window.drag("Ball's start", [(1, 0)])
        window.wait_for_control("Run")
        window.drag("Ball's start", [(-30, 10), (-30, 30)])
        window.wait_for_control("Run", there=False)
        time.sleep(0.3)
        report = window.stop()
    check(report["simulated_s"] > 0.0 and report["ball"]["distance_m"] > 0.0,
          f"the ball let go flies: {report['ball']['distance_m']:.4f} m")


def slingshot(bench):
    """A pull of 60 pixels left and 40 down is 15 m/s to the right and 10 up; with Shift, 80 up are 40 rad/s more."""
    with bench.open(*NEARLY_STILL, "--set", "air.kind=vacuum", "--set", "ball.vx_mps=3") as window:
        window.drag("Ball's start", [(-30, 10), (-30, 30)])
        time.sleep(0.3)
        window.drag("Ball's start", [(0, -50), (0, -30)], shift=True)
        time.sleep(0.3)
        ball = window.stop()["ball"]
    speed = math.hypot(ball["vx_mps"], ball["vy_mps"])
    check(abs(speed - math.hypot(15.0, 10.0)) < 0.01, f"speed follows the pull: {speed:.2f} m/s")
    check(abs(ball["vy_mps"] / ball["vx_mps"] - 2 / 3) < 0.02, f"and so does the direction: {ball['vy_mps']:.2f} up")
    check(abs(ball["spin_radps"] - 65.0) < 0.01, f"spin follows the drag with Shift: {ball['spin_radps']:.2f} rad/s")
    check(ball["distance_m"] < 0.2, f"it starts again: {ball['distance_m']:.3f} m flown")


ASKS = "Notice: Press Esc again to quit"


def escape(bench):
    """Esc closes a menu, then leaves full screen; then it asks, for two seconds, and ends nothing."""
    with bench.open("--paused") as window:
        window.click("Method")
        window.wait_for_control("Method.spring")
        window.press_key("Escape")
        window.wait_for_control("Method.spring", there=False)
        print("ok: Esc closes the menu")
        window.press_key("F11")
        time.sleep(0.5)
        check(ASKS not in window.controls(), "and asks nothing")
        window.press_key("Escape")
        time.sleep(0.5)
        for _ in range(2):  # the second time as the first: the question has gone
            window.press_key("Escape")
            window.wait_for_control(ASKS)
            window.wait_for_control(ASKS, there=False)
        # It breaks off a pull at the ball, and the rest of that drag moves nothing.
        start = window.controls()["Ball's start"]
        window.hold("Ball's start", 0.5)
        window.move_by(-40, 10)
        window.press_key("Escape")
        window.move_by(-60, 20)
        window.release()
        check(window.controls()["Ball's start"] == start, f"a pull that was broken off pans nothing: {start}")
        window.is_running()
        report = window.stop()
    check(report["display"]["width"] == 800, f"Esc leaves full screen: {report['display']['width']} wide")
    check(report["method"] == "impulse", "the menu changed nothing")


def leave(bench):
    """H hides the panel and shows it; Esc twice ends."""
    with bench.open() as window:
        check("Ball spin" in window.controls(), "the panel is there at first")
        window.press_key("h")
        window.wait_for_control("Ball spin", there=False)
        print("ok: H hides it")
        window.press_key("h")
        window.wait_for_control("Ball spin")
        print("ok: H again shows it")
        report = window.end()
        check(report["steps"] > 0 and report["scene"] == "court", "Esc twice ends with exit code 0 and a report")


def answer_s(bench, budget_ms):
    """Time from a press of H to the picture without the panel, or with it, and rows of the overlay's figures. A frame is
    a single step with 640,000 collisions, which takes half a second or more."""
    figures = bench.folder / "figures.csv"
    with bench.open("--scene", "gas", "--method", "exact", "-p", "50000", "--dt", "20", "--substeps", "1", "--threads", "1",
                    "--set", f"run.frame_budget_ms={budget_ms}", "--overlay-csv", str(figures)) as window:
        times = []
        for there in (False, True, False, True, False):
            time.sleep(0.37)  # anywhere in a frame
            began = time.monotonic()
            window.press_key("h")
            window.wait_for_control("Restitution", there)
            times.append(time.monotonic() - began)
        window.stop()
    with open(figures, encoding="utf-8") as file:
        return statistics.median(times), list(csv.DictReader(file))


def answers(bench):
    """Keys are answered before a slow step is done; without a budget, after it."""
    late_s, whole = answer_s(bench, 0)
    soon_s, cut = answer_s(bench, 50)
    check(2.0 * soon_s < late_s, f"H is answered after {soon_s:.2f} s, without a budget after {late_s:.2f} s")
    most = max(int(row["pictures"]) for row in cut)
    check(most > 5, f"a step takes {most} pictures")
    check(all(row["pictures"] == "1" for row in whole), "without a budget one")
    usual = [float(row["slow_motion"]) for row in whole if float(row["slow_motion"]) > 0]
    slowed = [float(row["slow_motion"]) for row in cut if int(row["pictures"]) > 5]
    check(max(slowed) < 0.21 * min(usual), f"the flight is slowed, and says so: {max(slowed):.2g} after {min(usual):.2g}")


def stays(bench):
    """The length that a scene has for a headless run does not close a window; --seconds does."""
    (bench.folder / "short.toml").write_text("[run]\nseconds = 0.2\n")
    with bench.open("--scene", str(bench.folder / "short.toml")) as window:
        time.sleep(1.0)
        check(window.is_running(), "a window outlives the seconds of its scene")
        window.end()
    with bench.open("--seconds", "2") as window:
        check(window.process.wait(timeout=20) == 0, "and ends after --seconds")
