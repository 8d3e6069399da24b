#!/usr/bin/python3
"""What a run without a window says: how far it is, what it could not do as asked, and what flew.

test_said.py PROGRAM CASE...   exit code 0: passed, 1: failed, 77: skipped, since something is missing
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from test_cli import LIMIT_S, SOFTWARE, Bench, check

SMALL = ("--headless", "--size", "64x64", "-p", "500")


def on_terminal(bench, *words):
    """What a long run shows on a terminal until it knows what is left, and after an interrupt."""
    controller, terminal = os.openpty()
    run = subprocess.Popen([bench.program, *words], env={**os.environ, **SOFTWARE}, stderr=terminal)
    os.close(terminal)
    shown, rest = b"", b""
    while b"left" not in shown:
        shown += os.read(controller, 4096)
    run.send_signal(signal.SIGINT)
    check(run.wait(LIMIT_S) == 0, "the run ends in order")
    try:
        while chunk := os.read(controller, 4096):
            rest += chunk
    except OSError:  # how a terminal ends when nobody writes to it
        pass
    os.close(controller)
    return shown, rest


def progress(bench):
    """On a terminal a line that is rewritten; a short run has its last line only."""
    flown = re.compile(r"1 frame to t = 0\.001667 s in [0-9.]+ s: \d+ steps, \d+ collisions; the ball has flown 0\.0[23] m, now at 15\.\d\d m/s")
    short = bench.run(*SMALL, "--seconds", "0.0166")
    last = short.stderr.splitlines()[-1]
    check(short.returncode == 0 and flown.search(last), f"the end: {last}")
    check("%" not in short.stderr, "no progress of a run that ends at once")
    shown, rest = on_terminal(bench, *SMALL, "--seconds", "100000")
    check(re.search(rb"frame [\d,]+ \(\d+ %\), t = [\d.]+ s; about \d+ s left", shown), f"progress: {shown[-80:]}")
    check(b"frames to t = " in rest, f"the summary: {rest[-80:]}")
    check(b"\r\x1b[K" in rest and b"stopped by a signal before its end" in rest, f"the line makes room for the last ones: {rest[:60]}")


def progress_of_cues(bench):
    """Their lengths together are the whole."""
    cues = bench.write("c.toml", b"".join(b"[[cue]]\ntitle = '%d'\nscene = 'gas'\nrun.seconds = %d\nair.num_parcels = 500\n"
                                          % (k, seconds) for k, seconds in enumerate((60, 100000))))
    shown, _ = on_terminal(bench, "--headless", "--size", "64x64", "--cues", cues)
    share = int(re.search(rb"\((\d+) %\)", shown)[1]) if b"%" in shown else 0
    check(share == 0, f"{share} % of 100060 s after a moment of the first 60 s")


def hasty(bench):
    """A time scale that the limit of steps does not allow."""
    done = bench.run("--headless", "--size", "64x64", "-p", "20000", "--time-scale", "1", "--seconds", "0.05")
    found = re.search(r"run\.time_scale: 1 needs \d+ steps a frame, but run\.max_substeps is 32, .* --set run\.max_substeps=(\d+)",
                      done.stderr)
    check(found and done.stderr.count("max_substeps is") == 1, f"said once: {done.stderr.splitlines()[1:2]}")
    again = bench.run("--headless", "--size", "64x64", "-p", "20000", "--time-scale", "1", "--seconds", "0.05", "--set",
                      f"run.max_substeps={int(found[1]) + 5}")
    check("max_substeps" not in again.stderr and "t = 0.05 s" in again.stderr, f"its remedy works: {again.stderr.splitlines()[-1]}")


def no_display(bench):
    done = bench.run("--size", "64x64", "-p", "500", "--seconds", "0.05", environment={"DISPLAY": ":79", "WAYLAND_DISPLAY": ""})
    check(done.returncode == 0 and "the display DISPLAY=:79 cannot be opened: running without a window" in done.stderr,
          f"a display that is gone: {done.stderr.splitlines()[0]}")


def picture_and_still(bench):
    """The last frame of the first flight, and that of the still, which comes later."""
    picture, still, alone = (bench.folder / name for name in ("p.png", "s.png", "a.png"))
    fast = ("--headless", "--size", "320x180", "-p", "500", "--ball-vx", "60", "--time-scale", "0.5", "--overlay", "off")
    done = bench.run(*fast, "--picture", str(picture), "--still", "0.5", str(still))
    bench.run(*fast, "--seconds", "1.2", "--picture", str(alone))
    check(done.returncode == 0 and picture.read_bytes() != still.read_bytes(), "two pictures")
    pixels = [file.read_bytes().split(b"IDAT", 1)[1] for file in (picture, alone)]
    check(pixels[0] == pixels[1], "the first flight's is the same as without a still")
    times = [float(re.search(rb"Simulated time\0([0-9.e-]+) s", file.read_bytes())[1]) for file in (picture, still)]
    check(times[0] < times[1] == 0.5, f"each says its time: {times}")


CASES = {case.__name__: case for case in (progress, progress_of_cues, hasty, no_display, picture_and_still)}

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[2:]:
            CASES[name](Bench(sys.argv[1], folder))
