#!/usr/bin/python3
"""The bar below the scene, clips of the last seconds, and files dropped on the window.

test_timeline.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: no Xvfb, xdotool or ffmpeg
"""
import collections
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

from bench import STEPWISE, Bench, check, fresh_hash
from drop import Source
from window import SKIPPED, Screen, skip_if_missing, wait_for

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from png import read_png

STEP_S = 0.001  # of STEPWISE, one a frame
LONG = ("--set", "run.relaunch=false", *STEPWISE)


def clock_s(window):
    """The time on the bar, while paused or in the past; None: it runs."""
    times = [re.match(r"Time (\d[\d.]*)", label) for label in window.controls()]
    return next((float(time[1]) for time in times if time), None)


def pause_after(window, seconds):
    time.sleep(seconds)
    window.press_key("space")
    window.wait_for_control("Run")
    return wait_for("time on the bar", lambda: clock_s(window))


def settled(window):
    """The clock once it stands still."""
    def still():
        before = clock_s(window)
        time.sleep(0.3)
        return before if before == clock_s(window) and before is not None else None
    return wait_for("standing clock", still)


def drag_back(bench):
    """Dragging goes back and forth; the state is that of a flight of so many frames, bit for bit."""
    for share in (0.3, 0.8):
        with bench.open(*LONG) as window:
            latest_s = pause_after(window, 2.5)
            window.drag_slider("Timeline", 1.0, 0.1)
            window.drag_slider("Timeline", 0.1, share)
            time_s = settled(window)
            check(abs(time_s - share * latest_s) < 0.03 * latest_s, f"to {share} of {latest_s} s: {time_s} s")
            report = window.stop()
        frames = round(report["clock_s"] / STEP_S)
        check(abs(report["clock_s"] - time_s) < 1e-4, f"the clock is that of the run: {report['clock_s']} s")
        check(report["state_hash"] == fresh_hash(bench, frames), f"the state is that after {frames} frames")


def let_go(bench):
    """A flight that ran goes on from there, through what is known and beyond."""
    with bench.open(*LONG) as window:
        latest_s = pause_after(window, 2.0)
        window.press_key("space")
        window.wait_for_control("Run", there=False)
        window.hold("Timeline", 0.2)
        held_s = settled(window)
        check(held_s < 0.5 * latest_s, f"while it is held it stands: {held_s} s")
        window.release()
        wait_for("the end of what is known", lambda: clock_s(window) is None)
        time.sleep(0.3)
        report = window.stop()
    check(report["clock_s"] > latest_s, f"it went on beyond {latest_s} s: {report['clock_s']} s")
    frames = round(report["clock_s"] / STEP_S)
    check(report["state_hash"] == fresh_hash(bench, frames), f"with the state after {frames} frames")


def place(bench):
    """The bar stands between scene and overlay, beside the panel, and goes with the overlay."""
    file = bench.folder / "bar.png"
    with bench.open("--paused", "--size", "1000x700", "--picture", str(file), *LONG) as window:
        window.press_key("s")
        window.wait_for_control("Timeline")
        x0, y0, x1, y1 = window.controls()["Timeline"]
        check(318 < x0 < x1 < 1000, f"beside the panel: {x0:.0f} to {x1:.0f}")
        window.press_key("h")
        wait_for("wider bar", lambda: window.controls().get("Timeline", [999])[0] < 200)
        for _ in range(2):
            window.press_key("o")
        window.wait_for_control("Timeline", there=False)
        window.press_key("o")
        window.wait_for_control("Timeline")
        window.press_key("h")
        time.sleep(0.3)
        head = window.controls()["Timeline head"]
        window.stop()
    picture = read_png(file)
    red, green, blue = picture.at(round(head[0]) + 2, round(head[1]) + 2)
    check(red > 200 and green > 170 and blue < 120, f"its head is drawn: {red}, {green}, {blue}")


MINI = '[scene]\nname = "mini"\n[world]\nboundary = "walls"\n[air]\nnum_parcels = 321\nrestitution = 0.77\n'


def drop(bench):
    """A scene or a cue list that is dropped is loaded; a log is refused with the command to type, the rest with what can be dropped."""
    (bench.folder / "a scene.toml").write_text(MINI)
    (bench.folder / "talk.toml").write_text('[[cue]]\ntitle = "Alpha"\nair.restitution = 0.3\n')
    (bench.folder / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    log = bench.folder / "flight.toml"
    subprocess.run([bench.program, "--headless", "-p", "300", "--seconds", "0.05", "--log", str(log)], check=True,
                   stderr=subprocess.DEVNULL)
    with bench.open() as window:
        source = Source(bench.screen.name)
        for name, line in (("picture.png", "cannot be dropped here; a scene or a cue list can"),
                           ("flight.toml", f"is the log of a flight; type: pickleflight run {log}")):
            source.drop(int(window.id), [bench.folder / name], (500, 300))
            wait_for(f"line about {name}", lambda: any(line in label for label in window.controls()))
            print(f"ok: {name}: {line}")
        source.drop(int(window.id), [bench.folder / "talk.toml"], (500, 300))
        window.wait_for_control("Cue title: Alpha")
        print("ok: a cue list begins with its first cue")
        check(not any("type: pickleflight" in label for label in window.controls()), "and the earlier line is gone")
        source.drop(int(window.id), [bench.folder / "a scene.toml"], (500, 300))
        time.sleep(1.0)
        report = window.stop()
    check(report["scene"] == "mini" and report["num_parcels"] == 321, f"the scene is that dropped: {report['scene']}")
    check(report["restitution"] == 0.77 and report["steps"] > 0, "with its settings, and it runs")


def frames_of(file):
    """Size and number of frames, and how long they are shown, by ffprobe."""
    command = ["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries",
               "stream=width,height,nb_read_frames:format=duration", "-of", "json", file]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    data = json.loads(done.stdout)
    stream = data["streams"][0]
    return stream["width"], stream["height"], int(stream["nb_read_frames"]), float(data["format"].get("duration", 0.0))


def picture_of(file, number):
    name = f"{file}-{number}.png"
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", file, "-vf", f"select=eq(n\\,{number})", "-frames:v", "1", name],
                   check=True)
    return read_png(name)


def clip(bench):
    """F10: the last seconds as a GIF of the scene, without panel, bar and overlay; the ball moves in it."""
    with bench.open("--clip", "2", "--size", "1100x600") as window:
        time.sleep(3.5)
        window.press_key("F10")
        name = wait_for("file", lambda: next((str(path) for path in pathlib.Path(".").glob("court_t*.gif")), None))
        wait_for("line about it", lambda: any(name in label for label in window.controls()))
        window.stop()
    width, height, frames, seconds = frames_of(name)
    check(width <= 640 and height <= 480 and max(width / 640, height / 480) > 0.9, f"it is {width}x{height}")
    check(1.0 < seconds < 2.6 and frames > 3, f"{frames} frames, {seconds} s")
    # It may have been launched again in between.
    pictures = [picture_of(name, (frames - 1) * k // 2) for k in range(3)]
    places = [ball_in(picture) for picture in pictures]
    check(all(places), f"the ball is in it: {places}")
    way = max(abs(a[0] - b[0]) for a in places for b in places)
    check(way > 10, f"and flies: {places}")
    first = pictures[0]
    corner = [first.at(x, y) for x, y in ((3, 3), (width // 2, height - 3))]
    check(max(max(color) for color in corner) < 70, f"without panel and overlay: {corner}")


def ball_in(picture):
    """Middle of the yellow pixels where they are closest together: fast parcels are yellow, too. None: there are none."""
    size = 6  # pixels, half of the ball's width
    cells = collections.defaultdict(list)
    for x in range(picture.width):
        for y in range(picture.height):
            red, green, blue = picture.at(x, y)[:3]
            if red > 150 and green > 130 and blue < 90:
                cells[x // size, y // size].append((x, y))
    around = [[at for dx in (0, 1) for dy in (0, 1) for at in cells.get((i + dx, j + dy), ())] for i, j in cells]
    yellow = max(around, key=len, default=[])
    return (sum(x for x, _ in yellow) / len(yellow), sum(y for _, y in yellow) / len(yellow)) if yellow else None


def clip_asked(bench):
    """Where the CPU draws, the first F10 begins to keep pictures, the next one writes them, here as WebP."""
    with bench.open("--clip-format", "webp") as window:
        window.press_key("F10")
        window.wait_for_control("Notice: From now on the last 5 s are kept; F10 again writes them")
        time.sleep(1.5)
        window.press_key("F10")
        name = wait_for("file", lambda: next((str(path) for path in pathlib.Path(".").glob("court_t*.webp")), None))
        wait_for("line about it", lambda: any(name in label for label in window.controls()))
        window.stop()
    data = pathlib.Path(name).read_bytes()
    num_frames = data.count(b"ANMF")
    check(data[:4] == b"RIFF" and data[8:12] == b"WEBP" and num_frames > 5, f"{num_frames} frames of WebP")


CASES = {case.__name__: case for case in (drag_back, let_go, place, drop, clip, clip_asked)}


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
                CASES[name](Bench(program, screen, folder, hands_off=False))
                os.chdir("/")


if __name__ == "__main__":
    main()
