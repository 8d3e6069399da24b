#!/usr/bin/python3
"""Recording in the window: films and pictures by their keys, a log played in a window.

test_film_window.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: no Xvfb, xdotool or ffmpeg
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from window import LIMIT_S, SKIPPED, Screen, Window, skip_if_missing, wait_for

for folder in ("cli", "golden"):
    sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / folder))
from film import frame, mean_difference, probe
from png import read_png

WIDTH, HEIGHT = 1280, 720
SIZE = ("--record-size", f"{WIDTH}x{HEIGHT}", "--record-overlay", "off")


class Bench:
    def __init__(self, program, screen, folder):
        self.program, self.screen, self.folder = program, screen, pathlib.Path(folder)

    def open(self, *words):
        return Window(self.program, self.screen, self.folder, words)

    def fly_again(self, log):
        done = subprocess.run([self.program, "run", log, "--headless", "--size", f"{WIDTH}x{HEIGHT}", "--record-overlay", "off",
                               "--picture", f"{log}.png", "--report", "again.json"],
                              stderr=subprocess.DEVNULL)
        check(done.returncode == 0, f"{log} is flown again")
        return json.loads(pathlib.Path("again.json").read_text())


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def film_key(bench):
    """F9 starts and stops, twice; between, inputs; the films are what was flown, without the panel."""
    with bench.open(*SIZE) as window:
        window.press_key("F9")
        time.sleep(1.0)
        window.press_key("F9")
        wait_for("end of the first film", lambda: "[[frame]]" in pathlib.Path("court.mp4.toml").read_text())
        window.drag_slider("Restitution", 0.9, 0.3)
        window.press_key("l")
        window.press_key("F9")
        time.sleep(0.4)
        window.press_key("space")
        time.sleep(0.2)
        window.press_key("F9")
        time.sleep(0.3)
        report = window.stop()
    films = report["record"]["earlier"] + [report["record"]]
    check([film["file"] for film in films] == ["court.mp4", "court-2.mp4"], f"two films: {films}")
    for film in films:
        found, complaints = probe(film["file"])
        check(complaints == "" and found["nb_read_frames"] == film["frames"] > 2,
              f"{film['file']}: {film['frames']} frames, {found}")
        check((found["width"], found["height"], found["r_frame_rate"]) == (WIDTH, HEIGHT, "60/1"), "size and rate")
        check(film["dropped"] == 0, "nothing dropped")
    # The logs are of the run from its start, each up to the end of its film.
    again = bench.fly_again("court.mp4.toml")
    check(again["replay"]["same"] and again["replay"]["checks"] > 0, f"the first log: {again['replay']}")
    again = bench.fly_again("court-2.mp4.toml")
    check(again["replay"]["same"] and again["restitution"] < 0.4, f"the second has the inputs: {again['restitution']}")
    # Paused before its end and nothing after it: the log ends in the state of the run.
    check(again["state_hash"] == report["state_hash"], "and its flight ends in the same state")
    # The last frame of the first film is where its log ends.
    last = frame("court.mp4", films[0]["frames"] - 1)
    near = mean_difference(last, read_png("court.mp4.toml.png").rgb)
    far = mean_difference(last, read_png("court-2.mp4.toml.png").rgb)
    check(near < 4.0 and near < 0.5 * far, f"its last frame: {near:.2f} from the log's, {far:.2f} from another's")


def film_escape(bench):
    """Esc while recording says that the film will be finished; a second press ends, and it is whole."""
    with bench.open(*SIZE) as window:
        window.press_key("F9")
        time.sleep(0.4)
        window.press_key("Escape")
        window.wait_for_control("Notice: Press Esc again to quit; the film will be finished")
        window.press_key("Escape")
        check(window.process.wait(timeout=LIMIT_S) == 0, "the second Esc ends")
        record = window.report()["record"]
    found, complaints = probe(record["file"])
    check(complaints == "" and found["nb_read_frames"] == record["frames"] > 0, f"the film is whole: {record}")


def picture_key(bench):
    """F12 twice: two files, neither written over."""
    with bench.open() as window:
        window.press_key("space")
        window.wait_for_control("Run")
        for _ in range(2):
            window.press_key("F12")
            time.sleep(0.3)
        window.stop()
    names = sorted(path.name for path in pathlib.Path(".").glob("court_t*.png"))
    check(len(names) == 2 and names[0].startswith(names[1].removesuffix(".png")), f"the same moment twice: {names}")
    pictures = [read_png(name) for name in names]
    check(pictures[0].width == 800 and pictures[0].height == 700, "as large as the window")
    # The panel is 318 pixels wide; without it, the court's left line is there, as long as the court is high.
    line = max(sum(min(pictures[0].at(x, y)) > 150 for y in range(700)) for x in range(318))
    check(line > 150, f"without the panel: a line of {line} pixels where it would be")
    text = pathlib.Path(names[0]).read_bytes()
    check(b"tEXtScene\0[scene]\nname = \"court\"" in text and b"num_parcels = 2000 " in text, "with the scene in it")


def replay_in_window(bench):
    """A log in a window: its inputs, no hands, and the same state at the end."""
    with bench.open("--log", "a.toml") as window:
        window.drag_slider("Ball spin", 0.56, 0.85)
        window.press_key("r")
        window.press_key("space")
        report = window.stop()
    command = [bench.program, "run", "a.toml", "--size", "640x480", "--report", "again.json"]
    process = subprocess.Popen(command, env={**os.environ, "DISPLAY": bench.screen.name, "LIBGL_ALWAYS_SOFTWARE": "1"})
    try:
        check(process.wait(timeout=LIMIT_S) == 0, "it ends by itself")
    finally:
        process.kill()
    again = json.loads(pathlib.Path("again.json").read_text())
    check(again["replay"]["same"] and again["state_hash"] == report["state_hash"], f"the same state: {again['replay']}")
    check(abs(again["ball"]["spin_radps"]) > 100, f"with the input: {again['ball']['spin_radps']:.0f} rad/s")


def are_apart(a, b):
    return a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def film_notice(bench):
    """While it records, a red dot with the film's time covers neither legend nor panel nor overlay."""
    for size in ("1280x700", "800x700"):
        with bench.open("--size", size, "-t", "--picture", "last.png", "--time-scale", "0.01") as window:
            window.press_key("F9")
            window.wait_for_control("Film notice")
            window.press_key("F12")
            window.wait_for_control("News notice")
            time.sleep(0.3)
            places = window.controls()
            window.stop()
        notices = {name: place for name, place in places.items() if name.endswith("notice")}
        legend, panel = places["Legend"], [0, 0, 318, 700]
        overlay = [318, 700 - (150 if size.startswith("1280") else 28), 1280, 700]
        for name, place in notices.items():
            check(all(are_apart(place, other) for other in (legend, panel, overlay)), f"{size}: {name} covers nothing: {place}")
        x0, y0, _, y1 = notices["Film notice"]
        picture = read_png("last.png")
        red, green, blue = picture.at(round(x0 + 15), round(0.5 * (y0 + y1)))
        check(red > 200 and max(green, blue) < 80, f"and its dot is red: {red}, {green}, {blue}")


CASES = {case.__name__: case for case in (film_key, film_notice, film_escape, picture_key, replay_in_window)}


def main():
    program = os.path.abspath(sys.argv[1])
    skip_if_missing()
    if shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None:
        print("SKIPPED: ffmpeg not found")
        sys.exit(SKIPPED)
    with Screen() as screen:
        for name in sys.argv[2:]:
            with tempfile.TemporaryDirectory() as folder:
                os.chdir(folder)
                CASES[name](Bench(program, screen, folder))
                os.chdir("/")


if __name__ == "__main__":
    main()
