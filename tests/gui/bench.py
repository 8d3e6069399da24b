"""Shared by the cases: windows to open, checks, and runs to compare with."""
import json
import pathlib
import subprocess

from window import Window

RUN_S = 1.0  # of a flight of 9 s, so that the ball is not yet launched again
NEARLY_STILL = ("--time-scale", "0.001")  # while the hands work; the ball moves by 15 mm in a second
# Whole steps of a known length, one per frame.
STEPWISE = ("--dt", "0.001", "--substeps", "1")
STEP_M = 15.0 * 0.001


class Bench:
    """Opens windows of the program. hands_off: no key or button is pressed."""

    def __init__(self, program, screen, folder, hands_off):
        self.program, self.screen, self.folder, self.hands_off = program, screen, pathlib.Path(folder), hands_off

    def open(self, *words, **how):
        return Window(self.program, self.screen, self.folder, words, self.hands_off, **how)


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


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
