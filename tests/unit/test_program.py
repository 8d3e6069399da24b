#!/usr/bin/python3
"""Jobs of the whole program that write files: the sweep, films without ffmpeg, timing of whole frames.

test_program.py PROGRAM sweep|sweep_stopped|frames|frames_of_no_film|frames_without_ffmpeg|bench_clocks|bench_recording
exit code 0: passed, 1: failed, 77: skipped, since nothing can be drawn
"""
import json
import math
import os
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

NO_GL = ("no OpenGL 4.5 without a display", "libEGL cannot be loaded")  # context_egl.cpp
CPU_SERIES = [f"CPU, {threads}, {search}" for search in ("all-pairs", "grid") for threads in ("1 thread", "all threads")]
PROGRAM = pathlib.Path(sys.argv[1])


def require(condition, message):
    if not condition:
        sys.exit(f"FAILED: {message}")


def skip_without_gl(text):
    if any(reason in text for reason in NO_GL):
        print("skipped: no OpenGL 4.5 here")
        sys.exit(77)


def run(arguments, folder, **more):
    done = subprocess.run([PROGRAM, *arguments], cwd=folder, capture_output=True, text=True, timeout=60, **more)
    skip_without_gl(done.stdout + done.stderr)
    return done


def sweep(folder):
    done = run(["bench", "--sweep", "--sweep-max", "1000", "--json", "s.json"], folder)
    require(done.returncode == 0, f"exit code {done.returncode}: {done.stdout} {done.stderr}")
    result = json.loads((folder / "s.json").read_text())
    require(result["complete"] is True, "complete is not true")
    series = {entry["name"]: entry for entry in result["series"]}
    for name in CPU_SERIES:
        require(name in series and name in done.stdout, f"series '{name}' is missing")
        require(len(series[name]["points"]) == 1, f"{name}: {len(series[name]['points'])} points")
        point = series[name]["points"][0]
        require(point["num_parcels"] == 1000 and not point["extrapolated"], f"{name}: {point}")
        require(point["frames"] == 60 and point["warmup_frames"] == 10, f"{name}: {point}")
        parts = [point[f"{part}_ms"] for part in ("physics", "render", "overhead")]
        require(min(parts) > 0, f"{name}: a part costs nothing: {parts}")
        # The three parts add up to the frame.
        require(math.isclose(sum(parts), point["frame_ms"], rel_tol=1e-9), f"{name}: parts {parts} of {point}")
        shares = [point[f"{part}_percent"] for part in ("physics", "render", "overhead")]
        require(math.isclose(sum(shares), 100.0, rel_tol=1e-9), f"{name}: shares {shares}")
        require(math.isclose(point["total_ms"], 60 * point["frame_ms"], rel_tol=1e-9), f"{name}: {point}")
        # Positions, velocities and ids take 20 bytes a parcel. A program that draws needs over 10 MB.
        require(point["parcel_memory_bytes"] >= 20_000 and point["process_peak_bytes"] > 10_000_000, f"{name}: {point}")
    gone = {entry["name"]: entry["reason"] for entry in result["skipped"]}
    for name in ("CUDA, all-pairs", "CUDA, grid"):
        require((name in series) != (name in gone), f"{name} is neither measured nor reported as skipped")
        require(name in series or gone[name], f"{name}: no reason")


def sweep_stopped(folder):
    """Ctrl-C after the first point keeps it, adds no others, and leaves no process."""
    file = folder / "s.json"
    child = subprocess.Popen([PROGRAM, "bench", "--sweep", "--json", file], cwd=folder, text=True,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    end = time.monotonic() + 30
    while time.monotonic() < end and child.poll() is None and not (file.exists() and file.stat().st_size):
        time.sleep(0.02)
    child.send_signal(signal.SIGINT)
    try:
        text = child.communicate(timeout=10)[0]
    except subprocess.TimeoutExpired:
        child.kill()
        sys.exit("FAILED: Ctrl-C does not stop it")
    skip_without_gl(text)
    require(child.returncode == 1 and "stopped" in text, f"exit code {child.returncode}: {text}")
    result = json.loads(file.read_text())
    require(result["complete"] is False, "an unfinished sweep is marked complete")
    require(result["series"][0]["points"][0]["num_parcels"] == 1000, "the finished point is missing")
    require(sum(len(entry["points"]) for entry in result["series"]) < 16, "the sweep continued")


def check_frames(frames, width, height):
    """Checks for complete, different PNG files of this size with some content."""
    for file in frames:
        data = file.read_bytes()
        require(data[:8] == b"\x89PNG\r\n\x1a\n" and data[-8:-4] == b"IEND", f"{file} is not a complete PNG")
        require(struct.unpack(">II", data[16:24]) == (width, height), f"{file} has another size")
        require(len(data) > 2000, f"{file} shows nothing: {len(data)} bytes")
    require(len({zlib.crc32(file.read_bytes()) for file in frames}) == len(frames), "frames repeat")


FIVE_FRAMES = ["--headless", "-p", "200", "--size", "320x180", "--seconds", "0.0833333"]


def frames(folder):
    older = run([*FIVE_FRAMES[:-1], "0.15", "--record", "f/%03d.png"], folder)
    require(older.returncode == 0 and (folder / "f" / "008.png").exists(), f"an older film of 9 frames: {older.stderr}")
    foreign = (folder / "f" / "007.png").read_bytes().replace(b"pickleflight", b"anotherthing")  # by another program
    (folder / "f" / "007.png").write_bytes(foreign)
    done = run([*FIVE_FRAMES, "--record", "f/%03d.png"], folder)
    require(done.returncode == 0, done.stderr)
    require("ffmpeg" not in done.stderr, f"mentions ffmpeg: {done.stderr}")
    names = sorted(file.name for file in (folder / "f").iterdir())
    require(names == ["000.png", "001.png", "002.png", "003.png", "004.png", "007.png", "008.png"], f"left: {names}")
    require((folder / "f" / "007.png").read_bytes() == foreign, "a picture by another program has changed")
    check_frames([folder / "f" / name for name in names[:5]], 320, 180)


def frames_of_no_film(folder):
    """A run without a frame leaves the frames of an earlier one."""
    first = run([*FIVE_FRAMES, "--record", "f/%03d.png", "--checkpoint", "c.state"], folder)
    done = run(["--headless", "--size", "320x180", "--from", "c.state", "--seconds", "0.01", "--record", "f/%03d.png"], folder)
    names = sorted(file.name for file in (folder / "f").iterdir())
    require(first.returncode == 0 and len(names) == 5, f"left: {names}: {done.stderr}")
    require("has lasted its 0.01 s already" in done.stderr and done.returncode == 2, f"said: {done.stderr}")


def frames_without_ffmpeg(folder):
    bare = dict(os.environ, PATH=str(folder))
    done = run([*FIVE_FRAMES, "--record", "flight.mp4"], folder, env=bare)
    require(done.returncode == 0, done.stderr)
    require(done.stderr.count("no ffmpeg on the PATH") == 1, f"not one message: {done.stderr}")
    require("flight_frames/%05d.png" in done.stderr, f"the message lacks the folder: {done.stderr}")
    require(not (folder / "flight.mp4").exists(), "an empty film was written")
    found = sorted((folder / "flight_frames").iterdir())
    require([file.name for file in found] == [f"{i:05d}.png" for i in range(5)], f"left: {found}")
    check_frames(found, 320, 180)


TIMED_FRAMES = ["bench", "--frames", "40", "-p", "500", "--scene", "court"]


def bench_clocks(folder):
    """Times of drawing by the clocks of host and GL exist, are positive, and are shorter than the frame."""
    reports = {}
    for name, words in (("plain", []), ("panel", ["--panel"])):
        done = run([*TIMED_FRAMES, "--size", "640x480", *words, "--json", f"{name}.json"], folder)
        require(done.returncode == 0, done.stderr)
        report = reports[name] = json.loads((folder / f"{name}.json").read_text())
        whole = report["frame_ms"]["median"]
        for part in ("draw", "panel"):
            host, gpu = (report[f"{clock}_ms"][part]["median"] for clock in ("host", "gpu"))
            require(f"{part}, host" in done.stdout and f"{part}, GPU" in done.stdout, f"no row: {done.stdout}")
            require(host is not None and 0 < host < whole, f"{name} {part}: {host} ms of the host's {whole}")
            require(gpu is not None and 0 < gpu < whole, f"{name} {part}: {gpu} ms of GL in a frame of {whole}")
            require(report["gpu_ms"][part]["p99"] < 1e4, f"{name} {part}: {report['gpu_ms'][part]}")
    require(reports["plain"]["state_hash"] == reports["panel"]["state_hash"], "the panel changes the flight")
    # The panel has many times the letters of the overlay, which is in both runs.
    more = reports["panel"]["host_ms"]["panel"]["median"] / reports["plain"]["host_ms"]["panel"]["median"]
    require(more > 1.1, f"the panel is not drawn: {more:.2f} times the cost")


def bench_recording(folder):
    """Times frames without and with a film in one command. The film has every frame."""
    small = ["--size", "320x180", "--json", "r.json"]
    done = run([*TIMED_FRAMES, *small, "--record", "film.rgb"], folder)
    require(done.returncode == 0, done.stderr)
    cost = json.loads((folder / "r.json").read_text())["recording"]
    require(cost["ratio"] > 0 and math.isclose(cost["ratio"], cost["frame_ms_with"] / cost["frame_ms_without"]),
            f"ratio: {cost}")
    require(cost["film_frames"] == 40 and cost["dropped"] == 0, f"frames: {cost}")
    require((folder / "film.rgb").stat().st_size == 40 * 320 * 180 * 4, "frames are missing in the file")
    require(cost["write_ms_per_frame"] > 0 and cost["encoder"] == "raw", f"writing: {cost}")
    require(f"ratio {cost['ratio']:.3f}" in done.stdout, f"not in the table: {done.stdout}")
    done = run([*TIMED_FRAMES, *small, "--record", "/dev/null"], folder)
    require(done.returncode == 0, done.stderr)
    cost = json.loads((folder / "r.json").read_text())["recording"]
    require(cost["film_frames"] == 40 and cost["dropped"] == 0 and cost["ratio"] > 0, f"dropped frames: {cost}")
    require(not pathlib.Path("/dev/null.toml").exists(), "a log was written beside /dev/null")


with tempfile.TemporaryDirectory(prefix="pf_test_") as name:
    {"sweep": sweep, "sweep_stopped": sweep_stopped, "frames": frames, "frames_of_no_film": frames_of_no_film, "frames_without_ffmpeg": frames_without_ffmpeg,
     "bench_clocks": bench_clocks, "bench_recording": bench_recording}[sys.argv[2]](pathlib.Path(name))
