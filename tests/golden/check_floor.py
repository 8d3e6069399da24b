#!/usr/bin/python3
"""The floor around a court has no edge: in windows of several shapes no band begins beyond the court.

check_floor.py PROGRAM            exit code 0: passed, 1: failed, 77: skipped, since nothing can be drawn
check_floor.py PROGRAM --broken   exit code 0 if a floor that ends is refused
"""
import os
import pathlib
import subprocess
import sys
import tempfile

from check_picture import NO_GL, SKIPPED, edited_shaders
from png import read_png

MAX_STEP = 2  # grey levels from pixel to pixel: rounding, and a level of noise
EDGE = ("court.frag", "smoothstep(-0.5, 7.0, box(p, kHalfPlay))", "step(0.0, box(p, kHalfPlay))")


def draw(program, folder, scene, size, theme, edit):
    file = folder / "floor.png"
    command = [program, "run", "--headless", "--scene", scene, "--size", size, "--theme", theme, "--overlay", "off",
               "-p", "500", "--seconds", "0.05", "--picture", str(file)]
    environment = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", **(edited_shaders(edit, folder) if edit else {})}
    done = subprocess.run(command, timeout=60, text=True, stderr=subprocess.PIPE, env=environment)
    if done.returncode == 3 and any(text in done.stderr for text in NO_GL):
        print("SKIPPED: no offscreen drawing here")
        sys.exit(SKIPPED)
    assert done.returncode == 0, done.stderr
    return read_png(file)


def largest_step(picture):
    """Between neighbours in the columns above the court, from the upper edge to its post."""
    court_top = picture.height / 2 - 0.27 * picture.width  # the posts reach 3.4 m of 14 m
    rows = range(1, int(court_top))
    columns = [round(share * picture.width) for share in (0.02, 0.3, 0.5, 0.8)]
    return max(abs(a - b) for x in columns for y in rows for a, b in zip(picture.at(x, y), picture.at(x, y - 1)))


def main():
    program, edit = sys.argv[1], EDGE if "--broken" in sys.argv else None
    with tempfile.TemporaryDirectory() as folder:
        steps = {shape: largest_step(draw(program, pathlib.Path(folder), *shape, edit))
                 for shape in (("court", "400x640", "dark"), ("court", "500x500", "light"),
                               ("regulation", "400x640", "light"))}
    print(f"largest step between neighbours: {steps}")
    passed = all(step <= MAX_STEP for step in steps.values())
    if edit:
        passed = all(step > MAX_STEP for step in steps.values())
    sys.exit(0 if passed else "FAILED: the floor has an edge" if not edit else "FAILED: an edge is not seen")


if __name__ == "__main__":
    main()
