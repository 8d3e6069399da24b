#!/usr/bin/python3
"""Dumps and checkpoints of a window.

test_data_window.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: no Xvfb or xdotool
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from window import Screen, Window, skip_if_missing, wait_for


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def go_on(program, *words):
    """Headless; the report."""
    done = subprocess.run([program, "run", "--headless", "--size", "64x48", "--report", "again.json", *words],
                          capture_output=True, text=True)
    check(done.returncode == 0, f"{' '.join(words)}: {done.stderr.strip() or 'goes on'}")
    return json.loads(pathlib.Path("again.json").read_text())


def checkpoint_in_window(program, screen):
    """The state at the end, by Esc and by a signal; it goes on in a window and without one."""
    with Window(program, screen, ".", ("--checkpoint", "c.state", "--method", "exact", "--time-scale", "1", "-p",
                                             "20000")) as window:
        time.sleep(0.5)
        ended = window.end()
    check(ended["files"]["checkpoint"]["written"] == 1 and ended["steps"] > 0, f"{ended['steps']} steps in the window")
    again = go_on(program, "--from", "c.state", "--seconds", "0.001")
    check(again["state_hash"] == ended["state_hash"], "the checkpoint has the state of the end")
    # It is closed amid a frame, which takes many pictures of a millisecond.
    with Window(program, screen, ".", ("--from", "c.state", "--checkpoint", "d.state", "--log", "d.toml", "--set",
                                       "run.frame_budget_ms=1"), fresh=False) as window:
        time.sleep(0.5)
        later = window.stop()
    check(later["steps"] > ended["steps"], f"it goes on in a window, to {later['steps']} steps")
    again = go_on(program, "--from", "d.state", "--seconds", "0.001")
    check(again["state_hash"] == later["state_hash"], "and is kept there, too")
    check(go_on(program, "d.toml")["state_hash"] == later["state_hash"], "and the log leads there")


def dump_in_window(program, screen):
    """Frames of a window, and another file after a reset."""
    with Window(program, screen, ".", ("--dump", "a.xyz")) as window:
        wait_for("frames", lambda: pathlib.Path("a.xyz").stat().st_size > 1_000_000)
        window.stop()
    check(pathlib.Path("a.xyz").read_text().startswith("2000\nLattice="), "text of 2000 parcels")
    if "HDF5: no" in subprocess.run([program, "--version"], capture_output=True, text=True).stdout:
        print("SKIPPED: dumps as HDF5: this build has none")
        return
    with Window(program, screen, ".", ("--dump", "a.h5")) as window:
        time.sleep(0.4)
        window.press_key("r")
        wait_for("second file", lambda: pathlib.Path("a-2.h5").exists())
        time.sleep(0.4)
        report = window.stop()["files"]["dump"]
    check(report["failure"] == "" and report["written"] > 2, f"{report['written']} frames, {report['dropped']} dropped")
    for file in ("a.h5", "a-2.h5"):
        check(go_on(program, "--from", file, "--seconds", "0.001")["steps"] >= 0, f"{file} is gone on from")


CASES = {case.__name__: case for case in (checkpoint_in_window, dump_in_window)}


def main():
    program = os.path.abspath(sys.argv[1])
    skip_if_missing()
    with Screen() as screen:
        for name in sys.argv[2:]:
            with tempfile.TemporaryDirectory() as folder:
                os.chdir(folder)
                CASES[name](program, screen)
                os.chdir("/")


if __name__ == "__main__":
    main()
