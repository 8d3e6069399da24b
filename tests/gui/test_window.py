#!/usr/bin/python3
"""The window as a person uses it: sliders, keys, and what the report then says.

test_window.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: no Xvfb or no xdotool
test_window.py PROGRAM --hands-off   all cases, but no key or button is pressed: exit 0 if each of them fails
"""
import sys
import tempfile
import time

from window import Screen, Window, skip_if_missing, wait_for

RUN_S = 1.0  # of a flight of 9 s, so that the ball is not yet launched again


class Bench:
    """What a case needs to open windows."""

    def __init__(self, program, screen, folder, hands_off):
        self.program, self.screen, self.folder, self.hands_off = program, screen, folder, hands_off

    def open(self, *words):
        return Window(self.program, self.screen, self.folder, words, self.hands_off)


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def undriven_report(bench):
    with bench.open() as window:
        time.sleep(RUN_S)
        return window.stop()


def driven_report(bench, label, start, end):
    with bench.open() as window:
        window.drag_slider(label, start, end)
        time.sleep(RUN_S)
        return window.stop()


def ball_spin(bench):
    """The slider goes from -200 to 200 rad/s; the scene has 25, which is at 0.56 of it."""
    before = undriven_report(bench)["ball"]
    after = driven_report(bench, "Ball spin", 0.56, 0.85)["ball"]
    check(15.0 < before["spin_radps"] < 25.5, f"undriven, the spin is the scene's: {before['spin_radps']:.1f} rad/s")
    # 0.85 of the slider are 140 rad/s; a pixel is 3 rad/s, and parcels brake the ball by some per cent.
    check(125.0 < after["spin_radps"] < 145.0, f"driven, it is the slider's: {after['spin_radps']:.1f} rad/s")
    check(after["vy_mps"] > 1.5 * before["vy_mps"],
          f"and bends the flight: {before['vy_mps']:.2f} m/s across become {after['vy_mps']:.2f} m/s")


def num_parcels(bench):
    """The slider is logarithmic, from 1 to a million: two thirds of it are 10,000, a pixel is a sixth."""
    before = undriven_report(bench)["num_parcels"]
    after = driven_report(bench, "Parcels N", 0.55, 2 / 3)["num_parcels"]
    check(before == 2000, f"undriven, N is that of -p: {before}")
    check(8000 < after < 12500, f"driven, it is the slider's: {after}")


def restitution(bench):
    before = undriven_report(bench)["restitution"]
    after = driven_report(bench, "Restitution", 0.9, 0.3)["restitution"]
    check(abs(before - 0.9) < 1e-6, f"undriven, the restitution is the scene's: {before:.3f}")
    check(abs(after - 0.3) < 0.02, f"driven, it is the slider's: {after:.3f}")  # 0.02: two pixels and more


def simulated_s(bench, actions):
    """Simulated time at the end of a window in which each action is done and then waited for."""
    with bench.open() as window:
        for key, wait_s in actions:
            if key:
                window.press_key(key)
            time.sleep(wait_s)
        return window.stop()["simulated_s"]


def pause(bench):
    short = simulated_s(bench, [("space", 0.2)])
    long = simulated_s(bench, [("space", 0.2 + 3.0)])
    resumed = simulated_s(bench, [("space", 0.2), ("space", 3.0)])
    # The windows differ by some frames of start-up; 3 s that run are 0.3 s in the slow motion of the scene.
    check(abs(long - short) < 0.1, f"paused 3 s longer, the same is simulated: {short:.3f} and {long:.3f} s")
    check(resumed - short > 0.15, f"space again goes on: {resumed:.3f} s")


def hide_panel(bench):
    with bench.open() as window:
        check("Ball spin" in window.controls(), "the panel is there at first")
        window.press_key("h")
        wait_for("hidden panel", lambda: window.controls() == {}, limit_s=3.0)
        print("ok: H hides it")
        window.press_key("h")
        wait_for("panel", lambda: "Ball spin" in window.controls(), limit_s=3.0)
        print("ok: H again shows it")


def escape(bench):
    with bench.open() as window:
        time.sleep(RUN_S)
        report = window.end()
        check(report["steps"] > 0 and report["scene"] == "court", "Esc ends with exit code 0 and a report")


CASES = {case.__name__: case for case in (ball_spin, num_parcels, restitution, pause, hide_panel, escape)}


def fails(case, bench):
    try:
        case(bench)
    except AssertionError as error:
        print(f"failed, as it should: {error}")
        return True
    print("PASSED WITHOUT HANDS")
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
