#!/usr/bin/python3
"""A window of several processes, started by mpirun: its controls do what they do with one, and the state is the same.

test_ranks_window.py PROGRAM   exit code 0: passed, 1: failed, 77: no Xvfb, no xdotool or no MPI
"""
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "cli"))
from test_ranks import ENVIRONMENT, skip_without_mpi  # noqa: E402
from bench import check  # noqa: E402
from window import Screen, Window, skip_if_missing  # noqa: E402

LIMIT_S = 60


def fly_by_hand(program, screen, folder):
    """Report of a window of two processes with two slabs each, after some work at its controls."""
    words = ("--threads", "1", "--domains", "4", "--time-scale", "0.002", "--log", str(folder / "a.toml"))
    with Window(program, screen, folder, words, environment=ENVIRONMENT, launcher=("mpirun", "-n", "2")) as window:
        window.drag_slider("Restitution", 0.9, 0.3)
        window.drag_slider("Ball spin", 0.56, 0.85)
        window.drag_slider("Area fraction", 0.142, 0.25)
        window.press_key("r")
        window.choose("Method", "spring")
        window.wait_frames(20)
        return window.end()


def change_threads(program, screen, folder):
    """Report of a window that asks domains for its pictures while their backend is replaced."""
    words = ("--domains", "2", "--draw-target", "images", "-p", "3000", "--time-scale", "0.002")
    with Window(program, screen, folder, words) as window:
        window.drag_slider("Threads", 0.0, 1.0)
        window.wait_frames(20)
        window.drag_slider("Threads", 1.0, 0.0)
        window.wait_frames(20)
        return window.end()


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    skip_if_missing()
    skip_without_mpi(program)
    with Screen() as screen, tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        report = fly_by_hand(program, screen, folder)
        check(abs(report["restitution"] - 0.3) < 0.02 and report["method"] == "spring",
              f"its sliders and menus: restitution {report['restitution']:.3f}, method {report['method']}")
        check("4 domains, 2 processes" in report["device"], f"several processes: {report['device']}")
        subprocess.run([program, "run", "a.toml", "--headless", "--size", "320x180", "--report", "again.json"], cwd=folder,
                       check=True, stderr=subprocess.DEVNULL, timeout=LIMIT_S)
        again = json.loads((folder / "again.json").read_text())
        changed = change_threads(program, screen, folder)
        check("2 domains" in changed["device"], f"pictures go on with other threads: {changed['device']}")
        check(again["replay"]["same"] and again["replay"]["checks"] > 0 and again["state_hash"] == report["state_hash"],
              f"one process flies the same from the log: {again['replay']}")


if __name__ == "__main__":
    main()
