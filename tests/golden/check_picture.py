#!/usr/bin/python3
"""Runs a scene offscreen and compares its last frame with a stored picture and with its own report.

check_picture.py PROGRAM SCENE            exit code 0: passed, 1: failed, 77: skipped, since nothing can be drawn
check_picture.py PROGRAM SCENE --broken   exit code 0 if each broken variant of the run is refused
check_picture.py PROGRAM SCENE --update   stores the picture as the reference; look at it before a commit
check_picture.py ... --keep FOLDER       keeps picture and report there
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from png import read_png

HERE = pathlib.Path(__file__).resolve().parent
SKIPPED = 77
WIDTH, HEIGHT = 640, 360
SCENE_ROWS = HEIGHT  # only the scene: times and texts differ between runs and machines
NO_GL = ("no OpenGL 4.5 without a display", "libEGL cannot be loaded")  # context_egl.cpp
MARGIN_PX = 14    # margin of stage.cpp around the world

# The state is equal on every machine, bit for bit. Only rasterisation may differ: rounding by a grey level or two
# anywhere, and coverage of some rim pixels of discs and lines. Two seeds differ by a mean of 7 and in 16 % of the
# pixels. The smallest broken variants below differ by 1.8 and 4 % (parcels), 1.0 and 1.2 % (missing path), or, if local,
# in 20 % of a tile.
MAX_MEAN_DIFFERENCE = 1.0   # grey levels, over all pixels and channels
FAR_OFF = 24                 # grey levels in any channel: more than rounding, less than a missing disc
MAX_FAR_OFF = 0.005         # share of the pixels
TILE_PX = 16                 # detects small missing things such as the ball
MAX_FAR_OFF_IN_TILE = 0.10

# Arguments of each run besides the scene. Values are fixed where the scene may change its method later.
RUN = {
    "court": ["-p", "3000", "--seconds", "0.5"],
    "gas": ["-p", "3000", "--seconds", "0.5"],
    "orbit": ["--seconds", "0.9"],  # 5.4 rad of the circle
    "dense": ["--seconds", "0.5", "--method", "spring", "--dt", "2.5e-4", "--substeps", "80",
              "--set", "run.spring_contact_s=5e-3"],
}
PATH = ["-t"]
# Runs that must be refused: arguments, and a change of a shader (file, from, to) or None.
BROKEN = {
    "court": [(["-t", "--seed", "2"], None), (["-t", "--set", "ball.present=false"], None),
              (["-t", "--ball-vx", "14"], None), (["-t", "--ball-spin", "-25"], None),
              (["-t", "--set", "air.parcel_speed_mps=0.5"], None), (["-t", "--set", "air.kind=vacuum"], None),
              ([], None),  # no path
              (PATH, ("ball.vert", "px_of(ball_m)", "px_of(vec2(ball_m.x, -ball_m.y))")),
              (PATH, ("ball.frag", "vec3(0.965, 0.890, 0.170)", "vec3(0.170, 0.890, 0.965)")),
              (PATH, ("court.frag", "0.80 * cover(lines(p))", "0.0")),
              (PATH, ("parcels.vert", "px_of(position_m)", "px_of(-position_m)"))],
    "gas": [(["--seed", "2"], None), (["--set", "air.contacts=false"], None),
            (["--set", "world.boundary=periodic"], None), (["--dt", "0.030"], None),
            ([], ("box.frag", "0.85 * frame", "0.0"))],
    "orbit": [([], None),  # no path
              (["-t", "--ball-spin", "-104"], None), (["-t", "--ball-spin", "106"], None),
              (["-t", "--ball-vx", "4.9"], None), (["-t", "--set", "ball.y_m=-2.4"], None),
              (["-t", "--set", "ball.magnus=false"], None), (["-t", "--set", "air.kind=drag"], None),
              (PATH, ("path.vert", "px_of(", "1.1 * px_of("))],
    "dense": [(["--seed", "2"], None), (["--set", "air.contacts=false"], None),
              (["--set", "air.area_fraction=0.66"], None), (["-p", "840"], None),
              (["--set", "air.drawn_area_fraction=0.44"], None), (["--set", "world.boundary=walls"], None),
              (["--set", "run.spring_contact_s=2e-2"], None)],
}
NORMAL = {"court": PATH, "gas": [], "orbit": PATH, "dense": []}


class View:
    """Position of a world of this size in the picture (Camera::fit)."""

    def __init__(self, shown_width, shown_height):
        self.per_px = max(shown_width / (WIDTH - 2 * MARGIN_PX), shown_height / (SCENE_ROWS - 2 * MARGIN_PX))

    def pixel(self, x, y):
        return int(WIDTH / 2 + x / self.per_px), int(SCENE_ROWS / 2 - y / self.per_px)


def edited_shaders(edit, folder):
    """A copy of the shaders with one place changed."""
    file, old, new = edit
    copy = folder / "shaders"
    shutil.copytree(HERE.parent.parent / "shaders", copy, dirs_exist_ok=True)
    text = (copy / file).read_text()
    if old not in text:
        sys.exit(f"FAILED: {file} no longer contains '{old}'; choose another change")
    (copy / file).write_text(text.replace(old, new))
    return {"PICKLEFLIGHT_SHADERS": str(copy)}


def without(words, others):
    """The words, less the settings that others give."""
    given = {other.partition("=")[0] for flag, other in zip(others, others[1:]) if flag == "--set"}
    pairs = list(zip(words[::2], words[1::2]))
    return [word for flag, value in pairs if flag != "--set" or value.partition("=")[0] not in given for word in (flag, value)]


def run_program(program, scene, folder, words, edit=None):
    picture, report = folder / f"{scene}.png", folder / f"{scene}.json"
    command = [program, "run", "--headless", "--scene", scene, "--size", f"{WIDTH}x{HEIGHT}", "--overlay", "off",
               *without(RUN[scene], words),
               "--picture", str(picture), "--report", str(report), *words]
    # Mesa must use its software rasteriser, not a GPU.
    environment = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", **(edited_shaders(edit, folder) if edit else {})}
    done = subprocess.run(command, env=environment, stderr=subprocess.PIPE, text=True, timeout=60)
    print(done.stderr.strip())
    if done.returncode == 3 and any(text in done.stderr for text in NO_GL):
        print("SKIPPED: no offscreen drawing here")
        sys.exit(SKIPPED)
    if done.returncode != 0:
        sys.exit(f"FAILED: exit code {done.returncode} of {' '.join(command)}")
    return read_png(picture), json.loads(report.read_text())


def compare(picture, reference):
    """Errors in a comparison of the parts above the overlay."""
    if (picture.width, picture.height) != (reference.width, reference.height):
        return [f"size {picture.width}x{picture.height}, not {reference.width}x{reference.height}"]
    size = 3 * WIDTH * SCENE_ROWS
    differences = [abs(a - b) for a, b in zip(picture.rgb[:size], reference.rgb[:size])]
    mean = sum(differences) / size
    far_off = [i for i in range(WIDTH * SCENE_ROWS) if max(differences[3 * i:3 * i + 3]) > FAR_OFF]
    share = len(far_off) / (WIDTH * SCENE_ROWS)
    tiles = {}
    for i in far_off:
        tile = (i % WIDTH // TILE_PX, i // WIDTH // TILE_PX)
        tiles[tile] = tiles.get(tile, 0) + 1
    worst = max(tiles.values(), default=0) / TILE_PX**2
    print(f"against the reference: mean difference {mean:.3f} grey levels, {100 * share:.3f} % of the pixels off by "
          f"more than {FAR_OFF}, {100 * worst:.1f} % in the worst tile")
    found = []
    if mean > MAX_MEAN_DIFFERENCE:
        found.append(f"mean difference {mean:.3f} > {MAX_MEAN_DIFFERENCE}")
    if share > MAX_FAR_OFF:
        found.append(f"{100 * share:.3f} % of the pixels far off, allowed {100 * MAX_FAR_OFF} %")
    if worst > MAX_FAR_OFF_IN_TILE:
        found.append(f"{100 * worst:.1f} % of a tile far off, allowed {100 * MAX_FAR_OFF_IN_TILE} %")
    return found


def is_ball_yellow(color):
    return color[0] > 130 and color[1] > 115 and color[2] < 0.55 * color[0]


def is_line(color):
    return min(color) > 120


def is_disc(color):
    """Speed colours are greener than any floor and more saturated than any line."""
    return color[1] > 90 and max(color) - min(color) > 50


def share_of(test, picture, pixels):
    pixels = [p for p in pixels if picture.has(*p)]
    return sum(test(picture.at(*p)) for p in pixels) / max(len(pixels), 1)


def disc_pixels(center, radius):
    reach = range(-math.ceil(radius), math.ceil(radius) + 1)
    return [(center[0] + i, center[1] + j) for i in reach for j in reach if i * i + j * j <= radius * radius]


def along(view, start, end, num=200):
    steps = [i / (num - 1) for i in range(num)]
    return [view.pixel(start[0] + (end[0] - start[0]) * s, start[1] + (end[1] - start[1]) * s) for s in steps]


def line_share(picture, pixels):
    """Visible share of a line. A point counts if a pixel next to it is light."""
    def seen(x, y):
        near = [(x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        return any(is_line(picture.at(*p)) for p in near if picture.has(*p))
    return sum(seen(x, y) for x, y in pixels) / len(pixels)


def check_lines(picture, view, lines):
    found = []
    for name, start, end in lines:
        share = line_share(picture, along(view, start, end))
        if share < 0.7:  # parcels cover parts of it
            found.append(f"{name}: only {100 * share:.0f} % of it is visible")
    return found


def check_discs(picture, view, half_width, half_height, min_share, max_share):
    left, top = view.pixel(-half_width, half_height)
    right, bottom = view.pixel(half_width, -half_height)
    inside = [(x, y) for x in range(left + 6, right - 5) for y in range(top + 6, bottom - 5)]
    share = share_of(is_disc, picture, inside)
    print(f"parcels cover {100 * share:.1f} % of the floor's pixels")
    return [] if min_share <= share <= max_share else [f"parcels cover {100 * share:.1f} %, expected "
                                              f"{100 * min_share:.0f} to {100 * max_share:.0f} %"]


def check_ball(picture, view, ball):
    if ball is None:
        return ["the report has no ball"]
    center = view.pixel(ball["x_m"], ball["y_m"])
    radius_px = 0.185 / view.per_px
    share = share_of(is_ball_yellow, picture, disc_pixels(center, radius_px))
    print(f"ball reported at pixel {center}: {100 * share:.0f} % of its {radius_px:.1f} px disc is yellow")
    found = [] if share > 0.4 else [f"no ball at pixel {center}: {100 * share:.0f} % yellow"]  # holes are dark
    # The path from the start to the ball's rim. Its older part is faded.
    middle = -6.4 + 0.7 * (ball["x_m"] - 0.185 + 6.4)
    path = share_of(is_ball_yellow, picture, along(view, (middle, ball["y_m"]), (ball["x_m"] - 0.2, ball["y_m"]), 20))
    return found if path > 0.5 else found + [f"only {100 * path:.0f} % of the path's younger half is yellow"]


def check_court(picture, report):
    view = View(13.4 + 2 * 0.30, 6.1)  # an open world is shown with an apron
    x, y, zone = 6.706, 3.048, 2.134   # 22, 10 and 7 ft
    lines = [("left baseline", (-x, -y), (-x, y)), ("right baseline", (x, -y), (x, y)),
             ("lower sideline", (-x, -y), (x, -y)), ("upper sideline", (-x, y), (x, y)),
             ("left zone line", (-zone, -y), (-zone, y)), ("right zone line", (zone, -y), (zone, y)),
             ("left middle line", (-x, 0), (-zone, 0)), ("right middle line", (zone, 0), (x, 0)),
             ("net", (0, -y), (0, y))]
    found = check_lines(picture, view, lines) + check_ball(picture, view, report["ball"])
    if line_share(picture, along(view, (-x + 1, 1.5), (-zone - 1, 1.5))) > 0.3:
        found.append("light pixels where the court has no line")
    return found + check_discs(picture, view, 6.7, 3.05, 0.04, 0.16)  # area fraction 0.1, rims fade


def check_gas(picture, report):
    half = 0.5 * math.sqrt(report["num_parcels"] * math.pi * 0.25 / report["area_fraction"])
    view = View(2 * half, 2 * half)
    frame = half + 1.6 * view.per_px   # middle of the frame, which lies outside the box
    lines = [("left wall", (-frame, -half), (-frame, half)), ("right wall", (frame, -half), (frame, half)),
             ("lower wall", (-half, -frame), (half, -frame)), ("upper wall", (-half, frame), (half, frame))]
    found = check_lines(picture, view, lines) + check_discs(picture, view, half, half, 0.08, 0.32)
    outside = [(x, y) for x in list(range(0, 150)) + list(range(490, WIDTH)) for y in range(SCENE_ROWS)]
    if share_of(is_disc, picture, outside) > 0.0:
        found.append("parcels outside the box")
    return found


def check_orbit(picture, report):
    view = View(13.4, 6.1)
    ball = report["ball"]
    found = []
    # From (0, -2.5) m counter-clockwise around the middle, 0.1 rad a step.
    angle = -0.5 * math.pi + 0.1 * report["steps"]
    if math.dist((ball["x_m"], ball["y_m"]), (2.5 * math.cos(angle), 2.5 * math.sin(angle))) > 1e-9:
        found.append(f"the ball is at ({ball['x_m']:.3f}, {ball['y_m']:.3f}) m, not on its circle")
    share = share_of(is_ball_yellow, picture, disc_pixels(view.pixel(ball["x_m"], ball["y_m"]), 0.185 / view.per_px))
    print(f"{100 * share:.0f} % of the ball's disc is yellow")
    if share <= 0.4:
        found.append(f"no ball at its reported position: {100 * share:.0f} % yellow")
    younger = [angle - 0.1 - 0.5 * 0.1 * report["steps"] * i / 99 for i in range(100)]
    path = share_of(is_ball_yellow, picture, [view.pixel(2.5 * math.cos(a), 2.5 * math.sin(a)) for a in younger])
    print(f"{100 * path:.0f} % of the path's younger half is yellow")
    if path <= 0.5:
        found.append(f"only {100 * path:.0f} % of the path's younger half is yellow")
    return found


def check_dense(picture, report):
    area = report["num_parcels"] * math.pi * 0.25 / report["area_fraction"]
    aspect = 29 / 25.98076211353316
    half_width, half_height = 0.5 * math.sqrt(area * aspect), 0.5 * math.sqrt(area / aspect)
    view = View(2 * half_width, 2 * half_height)
    return check_discs(picture, view, half_width, half_height, 0.45, 0.75)  # less than 0.69: rims fade, slow ones are dark


def check_scene(scene, picture, report):
    checks = {"court": check_court, "gas": check_gas, "orbit": check_orbit, "dense": check_dense}
    return checks[scene](picture, report)


def check_broken(program, scene, folder, reference):
    missed = []
    for words, edit in BROKEN[scene]:
        name = f"'{' '.join(words)}'" + (f", {edit[0]}: {edit[1]} -> {edit[2]}" if edit else "")
        print(f"-- broken: {name}")
        picture, report = run_program(program, scene, folder, words, edit)
        found = compare(picture, reference) + check_scene(scene, picture, report)
        print("refused: " + "; ".join(found) if found else "NOT REFUSED")
        missed += [] if found else [f"not refused: {name}"]
    return missed


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("scene", choices=sorted(BROKEN))
    parser.add_argument("--broken", action="store_true")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--keep", type=pathlib.Path)
    arguments = parser.parse_args()
    stored = HERE / f"{arguments.scene}.png"
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or pathlib.Path(temporary)
        if arguments.update:
            run_program(arguments.program, arguments.scene, folder, NORMAL[arguments.scene])
            shutil.copy(folder / f"{arguments.scene}.png", stored)
        if arguments.broken:
            found = check_broken(arguments.program, arguments.scene, folder, read_png(stored))
        else:
            picture, report = run_program(arguments.program, arguments.scene, folder, NORMAL[arguments.scene])
            found = compare(picture, read_png(stored)) + check_scene(arguments.scene, picture, report)
    if found:
        sys.exit("FAILED: " + "; ".join(found))
    print("passed")


if __name__ == "__main__":
    main()
