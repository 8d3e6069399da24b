#!/usr/bin/python3
"""Pictures of any size, with tiles, without ground, and as drawings of paths.

test_pictures.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: nothing can be drawn here
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_alpha, read_png

SKIPPED = 77
NO_GL = ("no OpenGL 4.5 without a display", "libEGL cannot be loaded")  # context_egl.cpp
STILL = ("-t", "--ghosts", "--size", "640x360")
STRIP_SHARE = 0.09  # of the height: the overlay in one line has times, which differ between runs


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def run(program, *words):
    done = subprocess.run([program, "--headless", *words], stderr=subprocess.PIPE, text=True)
    if any(reason in done.stderr for reason in NO_GL):
        print("SKIPPED: no OpenGL 4.5 without a display")
        sys.exit(SKIPPED)
    return done


def still(program, name, *words, scene="court", num_parcels=3000):
    done = run(program, "--scene", scene, "-p", str(num_parcels), *STILL, *words, "--still", "0.2", name)
    check(done.returncode == 0, f"{name}: {done.stderr.strip()[-200:]}")
    return pathlib.Path(name)


def shrunk(picture, factor):
    """Means of squares of so many pixels, a list of rows."""
    rows = []
    for y in range(0, picture.height, factor):
        row = []
        for x in range(0, picture.width, factor):
            square = [picture.at(x + i, y + j) for i in range(factor) for j in range(factor)]
            row.append(tuple(sum(parts) / len(square) for parts in zip(*square)))
        rows.append(row)
    return rows


def enlarged(program):
    """A picture of three times the size is the picture of the window's size, enlarged: lines and text, too."""
    small, usual, large = (read_png(still(program, name, "--overlay", "compact", *words, num_parcels=1000)) for name, words in (
        ("small.png", ("--picture-size", "640x360")), ("usual.png", ()),
        ("large.png", ("--picture-size", "1920x1080"))))
    check((large.width, large.height) == (1920, 1080), f"its size: {large.width} x {large.height}")
    for name, picture, factor, most in (("drawn by tiles", small, 1, 0.5), ("three times as large", large, 3, 2.0)):
        rows = shrunk(picture, factor)[:round(360 * (1.0 - STRIP_SHARE))]
        differences = [abs(a - b) for y, row in enumerate(rows) for x, color in enumerate(row)
                       for a, b in zip(color, usual.at(x, y))]
        mean = sum(differences) / len(differences)
        check(mean < most, f"{name}: it differs by {mean:.2f} levels from the window's size")


def tiles(program):
    """However it is divided, each pixel is the same: discs, counted parcels, paths, text, magnifier."""
    cases = (("court", 3000, ()), ("regulation", 3000, ("--magnifier", "on")), ("gas", 3000, ()),
             ("court", 60000, ("--theme", "light", "--picture-transparent")))
    for scene, num_parcels, words in cases:
        size = ("--picture-size", "960x540", "--overlay", "compact", *words)
        whole = pixels(still(program, "whole.png", *size, "--picture-tile", "960", scene=scene, num_parcels=num_parcels))
        name = f"{scene} {' '.join(words)}"
        for tile in ("200", "37"):
            parts = still(program, "parts.png", *size, "--picture-tile", tile, scene=scene, num_parcels=num_parcels)
            different = sum(a != b for a, b in zip(whole, pixels(parts)))
            check(different == 0, f"{name}: tiles of {tile}: {different} pixels differ")
        colors = len(set(whole))
        check(colors > 300, f"{name}: it is a picture, of {colors} colours")


def pixels(file):
    picture = read_png(file)
    end = 3 * picture.width * round(picture.height * (1.0 - STRIP_SHARE))
    return [picture.rgb[at:at + 3] for at in range(0, end, 3)]


def transparent(program):
    """Without ground: alpha 0 beside lines, parcels, paths and ball; their colours are not darkened."""
    width, height, found = read_alpha(still(program, "clear.png", "--picture-transparent"))
    clear = sum(color[3] == 0 for color in found) / len(found)
    solid = sum(color[3] > 240 for color in found) / len(found)
    check((width, height) == (640, 360) and 0.5 < clear < 0.99, f"{clear:.1%} of it is clear")
    check(solid > 0.005, f"{solid:.1%} is solid")
    check(found[0][3] == 0 and found[-1][3] == 0, "the corners are clear: no overlay")
    yellow = [color for color in found if color[3] > 250 and color[0] > 200 and color[1] > 170 and color[2] < 90]
    check(len(yellow) > 30, f"the ball: {len(yellow)} pixels")
    line = (222, 230, 227)  # of a court's lines, whatever lies behind them
    like_lines = [color for color in found if 198 <= color[3] <= 210 and max(abs(a - b) for a, b in zip(color, line)) <= 6]
    check(len(like_lines) > 300, f"lines have their colour: {len(like_lines)} pixels")
    usual = read_png(still(program, "usual.png"))
    check(min(usual.at(320, 170)) > 5, "the usual picture has a ground")


def svg(program):
    """Valid XML in metres with the paths of the flight and its ghosts; at a time, and of a whole flight."""
    space = "{http://www.w3.org/2000/svg}"
    root = xml.etree.ElementTree.parse(still(program, "still.svg")).getroot()
    left, top, width, height = (float(part) for part in root.get("viewBox").split())
    check(root.tag == space + "svg" and abs(left + 0.5 * width) < 1e-3 and 13.4 < width < 15, f"metres: {root.attrib}")
    lines = root.findall(f"{space}polyline")
    titles = [line.find(space + "title").text for line in lines]
    check(len(lines) == 3 and titles[-1].startswith("flight 1: impulse, 15 m/s"), f"ghosts and flight: {titles}")
    end = [float(part) for part in lines[-1].get("points").split()[-1].split(",")]
    ball = root.find(space + "circle")
    gap = abs(end[0] - float(ball.get("cx"))) + abs(end[1] - float(ball.get("cy")))
    check(gap < 2e-4 and -4.5 < end[0] < -3.0, f"the path ends at the ball: {end}")
    done = run(program, "-p", "500", "--time-scale", "1", "--picture", "flight.svg")
    root = xml.etree.ElementTree.parse("flight.svg").getroot()
    points = root.findall(f"{space}polyline")[-1].get("points").split()
    check(done.returncode == 0 and float(points[-1].split(",")[0]) > 6.0, f"a whole flight: to {points[-1]} m")


def refusals(program):
    for words, reason in ((("--picture-size", "big"), "is not a size"), (("--picture-tile", "3"), "from 16 to 16384"),
                          (("--picture", "a.gif"), "must end in .png or .svg"),
                          (("--magnifier", "maybe"), "one of auto, on, off")):
        done = subprocess.run([program, *words], stderr=subprocess.PIPE, text=True)
        check(done.returncode == 2 and reason in done.stderr and done.stderr.count("\n") == 1,
              f"{' '.join(words)}: {done.stderr.strip()}")


CASES = {case.__name__: case for case in (enlarged, tiles, transparent, svg, refusals)}

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        program = str(pathlib.Path(sys.argv[1]).resolve())
        os.chdir(folder)
        for case in sys.argv[2:]:
            CASES[case](program)
