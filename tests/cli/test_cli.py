#!/usr/bin/python3
"""The program as a process: its errors for invalid input, and its end after a signal.

test_cli.py PROGRAM CASE...   exit code 0: passed, 1: failed, 77: skipped, since something is missing
"""
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
LIMIT_S = 60
SOFTWARE = {"LIBGL_ALWAYS_SOFTWARE": "1"}


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def skip_without(*tools):
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if missing:
        print(f"SKIPPED: {' and '.join(missing)} not found")
        sys.exit(SKIPPED)


class Bench:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)

    def run(self, *words, environment=None, before=None):
        environment_of_run = {**os.environ, **SOFTWARE, **(environment or {})}
        return subprocess.run([self.program, *words], env=environment_of_run, preexec_fn=before, capture_output=True, text=True,
                              errors="replace", timeout=LIMIT_S)

    def refused(self, exit_code, parts, *words, **how):
        """Checks the exit code, and for a single line of error output that contains all parts."""
        done = self.run(*words, **how)
        shown = " ".join(words)
        check(done.returncode == exit_code, f"{shown}: exit code {done.returncode}, expected {exit_code}")
        # Messages of drivers are not the program's.
        lines = [line for line in done.stderr.splitlines() if not line.startswith(("MESA", "libEGL warning"))]
        last = lines[-1] if lines else ""
        check(last.startswith("pickleflight: "), f"   {last}")
        for part in parts:
            check(part in last, f"   names {part!r}")
        check(len(lines) == 1 and done.stdout == "", "   in one line, before any work")

    def write(self, name, content):
        (self.folder / name).write_bytes(content)
        return str(self.folder / name)


def settings(bench):
    """Flags and --set: infinite, absurd, zero, negative, unknown."""
    for words, parts in (
            (("--ball-vx", "inf"), ("--ball-vx: 'inf' is not a finite number", "from -100000 to 100000 m/s")),
            (("--ball-vy", "3e8"), ("--ball-vy: '3e8' is out of range", "100000 m/s")),
            (("--ball-spin", "nan"), ("--ball-spin: 'nan' is not a finite number",)),
            (("--dt", "-1"), ("--dt: '-1' is out of range", "run.dt_s")),
            (("--threads", "-1"), ("--threads: '-1' is out of range", "from 0 to 1024")),
            (("--set", "air.area_fraction=0.8"), ("--set air.area_fraction: '0.8'", "to 0.7")),
            (("--set", "air.parcel_radius_m=1"), ("parcels of radius 1 m fill", "at most 0.7 can be spawned")),
            (("--set", "air.parcel_radius_m=1e-12"), ("smaller than positions can resolve", "at least")),
            (("--set", "ball.radius_m=0"), ("--set ball.radius_m: '0' is out of range", "from 1e-06")),
            (("--set", "ball.radius_m=50"), ("does not fit the world", "lower ball.radius_m")),
            (("--set", "ball.x_m=50"), ("outside the world", "ball.x_m")),
            (("--set", "ball.mass_kg=-1"), ("--set ball.mass_kg: '-1' is out of range",)),
            (("--set", "air.restituton=1"), ("'air.restituton' is not a setting", "the nearest is air.restitution")),
            (("--draw-target", "interop"), ("--draw-target: interop needs the CUDA backend", "host")),
            (("--method", "spring", "--dt", "0.01", "--set", "run.spring_contact_s=0.01"),
             ("stability bound of method spring, 0.006", "--force")),
            (("--method", "spring", "--set", "run.method=exact"), ("run.method: is given twice", "--method", "--set run.method")),
            (("--set", "air.restitution=0.1", "--set", "air.restitution=0.7"), ("air.restitution: is given twice",)),
            (("-p", "1"), ("more than half the world's smaller side", "raise air.num_parcels"))):
        bench.refused(2, parts, "--headless", *words)


def no_cuda(bench):
    """Without a CUDA device or backend: an error with --cuda-no-fallback, otherwise a message and the CPU."""
    has_backend = "CUDA backend: no" not in bench.run("--version").stdout
    reason = "no CUDA device (" if has_backend else "this build has no CUDA backend"
    hidden = {"CUDA_VISIBLE_DEVICES": ""}
    bench.refused(3, (f"--cuda-no-fallback: {reason}",), "--headless", "--cuda-no-fallback", environment=hidden)
    done = bench.run("--headless", "--cuda", "--seconds", "0.02", "-p", "100", environment=hidden)
    told = [line for line in done.stderr.splitlines() if line.startswith(f"--cuda: {reason}")]
    check(done.returncode == 0 and len(told) == 1 and told[0].endswith("falling back to the CPU"),
          "--cuda falls back, with a message of one line")


def scenes(bench):
    """Invalid scene files."""
    junk = bytes(i * i % 251 for i in range(1, 5000))
    for file, parts in (
            (bench.write("junk.toml", junk), ("junk.toml:1: not valid TOML",)),
            (bench.write("latin.toml", b'[scene]\nname = "caf\xe9"\n'), ("latin.toml:2: not valid TOML", "utf-8")),
            (bench.write("empty.toml", b""), ("empty.toml: is empty",)),
            (bench.write("key.toml", b"[ball]\nspn_radps = 1\n"), ("key.toml:2: 'ball.spn_radps'", "ball.spin_radps")),
            (bench.write("value.toml", b"[ball]\n\nmass_kg = inf\n"), ("value.toml:3: 'inf' is not a finite number",)),
            (str(bench.folder / "none.toml"), ("none.toml: cannot be read",))):
        bench.refused(2, parts, "--headless", "--scene", file)
    soft = bench.write("soft.toml", b'[run]\nmethod = "spring"\ndt_s = 0.01\nspring_contact_s = 0.01\n')
    bench.refused(2, ("stability bound of method spring, 0.006",), "--headless", "--scene", soft)
    done = bench.run("--headless", "--scene", soft, "--force", "--seconds", "0.02", "-p", "100")
    check(done.returncode == 0, f"--force allows it: exit code {done.returncode}")
    huge = bench.write("huge.toml", b"")
    os.truncate(huge, 100_000_000)
    bench.refused(2, ("larger than 1 MiB", "100000000 bytes"), "--headless", "--scene", huge)
    (bench.folder / "folder.toml").mkdir()
    bench.refused(2, ("is a folder",), "--headless", "--scene", str(bench.folder / "folder.toml"))


def files(bench):
    """Unwritable files are refused before the run."""
    missing = str(bench.folder / "none" / "a.mp4")
    for words in (("--record", missing), ("--picture", missing.replace("mp4", "png")), ("--report", missing),
                  ("--panel-map", missing)):
        bench.refused(2, (f"{words[0]}: ", "the folder", "does not exist"), "--headless", *words)
    bench.refused(2, ("--record: ", "must end in .mp4 or .mkv"), "--headless", "--record", "a.avi")
    # What somebody else wrote is not replaced.
    for flag, name in (("--report", "scene.toml"), ("--overlay-csv", "notes.md"), ("--profile-csv", "report.json"),
                       ("--checkpoint", "notes.txt"), ("--dump", "run.h5")):
        kept = bench.folder / name.replace(".h5", ".xdmf")
        kept.write_text("by hand")
        done = bench.run("--headless", "-p", "100", "--seconds", "0.02", "--set", "run.profile=x", flag, str(bench.folder / name))
        check(done.returncode in (2, 3) and kept.read_text() == "by hand" and (done.returncode == 3 or f"{flag}: " in done.stderr),
              f"{flag} {name}: {kept.name} is kept: {done.stderr.splitlines()[-1]}")
    open_file = bench.folder / "open.txt"
    for flag, found in (("--report", '"state_hash"'), ("--overlay-csv", "frame,simulated_s"),
                        ("--profile-csv", "frame,simulated_s")):
        with open_file.open("w") as stream:
            stream.write("before\n")
            stream.flush()
            done = subprocess.run([bench.program, "--headless", "-p", "100", "--seconds", "0.05", "--set", "run.profile=x",
                                   flag, "/dev/stdout"], stdout=stream, stderr=subprocess.DEVNULL)
            subprocess.run(["echo", "after"], stdout=stream)
        text = open_file.read_text()
        check(done.returncode in (0, 3) and text.startswith("before\n") and text.endswith("after\n"),
              f"{flag} /dev/stdout goes on where the open file is: {text[:20]!r} ... {text[-20:]!r}")
        check(done.returncode == 3 or found in text, f"{flag}: {found} in it")


def memory(bench):
    """More parcels than memory: an error with both figures, before any allocation. The process has a limit."""
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
    for command in ("run", "bench"):
        words = (command, "-p", "1e8", "--threads", "2") + (("--headless",) if command == "run" else ())
        bench.refused(2, ("100000000 parcels need", "GiB are available", "(-p)"), *words, before=limit)


def old_gl(bench):
    """No GL, or an old one: the error names it."""
    old = {"MESA_GL_VERSION_OVERRIDE": "3.3"}
    if bench.run("--headless", "--seconds", "0.02", "-p", "100").returncode != 0:
        print("SKIPPED: no GL here")
        sys.exit(SKIPPED)
    if bench.run("--headless", "--seconds", "0.02", "-p", "100", environment=old).returncode == 0:
        print("SKIPPED: the driver here is not Mesa's")
        sys.exit(SKIPPED)
    bench.refused(3, ("no OpenGL 4.5", "with OpenGL 3.3", "graphics driver"), "--headless", environment=old)
    none = {"__EGL_VENDOR_LIBRARY_DIRS": str(bench.folder)}
    bench.refused(3, ("no OpenGL", "install"), "--headless", environment=none)


def old_gl_window(bench):
    skip_without("Xvfb", "xdotool")
    sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "gui"))
    from window import Screen
    with Screen() as screen:
        old = {"DISPLAY": screen.name, "MESA_GL_VERSION_OVERRIDE": "3.3"}
        bench.refused(3, ("no window with OpenGL 4.5", "with OpenGL 3.3", "--headless"), environment=old)


def stopped_film(bench, number, name):
    film, report = bench.folder / "film.mp4", bench.folder / "report.json"
    film.unlink(missing_ok=True)
    command = [bench.program, "--headless", "--size", "160x90", "-p", "500", "--seconds", "600", "--record", str(film),
               "--report", str(report)]
    process = subprocess.Popen(command, env={**os.environ, **SOFTWARE}, stderr=subprocess.DEVNULL)
    try:
        end = time.monotonic() + LIMIT_S
        while not (film.exists() and film.stat().st_size > 1000) and time.monotonic() < end:
            time.sleep(0.05)
        process.send_signal(number)
        check(process.wait(timeout=LIMIT_S) == 0, f"{name} in a run of ten minutes: exit code 0")
    finally:
        process.kill()
    figures = json.loads(report.read_text())
    check(figures["steps"] > 0 and figures["interrupted"], f"with a report of {figures['steps']} steps, which says so")
    # Decodes every frame.
    done = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v", "-show_entries",
                           "stream=nb_read_frames,width", "-of", "json", str(film)], capture_output=True, text=True)
    stream = json.loads(done.stdout)["streams"][0]
    check(done.stderr == "" and stream["width"] == 160, "and a film that plays to its end without errors")
    check(int(stream["nb_read_frames"]) > 0, f"of {stream['nb_read_frames']} frames")


def signals(bench):
    skip_without("ffmpeg", "ffprobe")
    stopped_film(bench, signal.SIGINT, "SIGINT")
    stopped_film(bench, signal.SIGTERM, "SIGTERM")
    # Background jobs of a shell, such as this test may be, start with SIGINT ignored.
    process = subprocess.Popen([bench.program, "bench", "-p", "1000", "--steps", "1000000", "--repeats", "1000"],
                               stdout=subprocess.DEVNULL,
                               preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    try:
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        check(process.wait(timeout=LIMIT_S) == -signal.SIGINT, "SIGINT ends a benchmark at once")
    finally:
        process.kill()


def cues(bench):
    """Lists of cues: refused with file and line before any flight; without a window all cues fly, and their log replays."""
    head = b'[[cue]]\ntitle = "A"\n'
    for words, parts in (
            (("--cues", bench.write("key.toml", head + b"air.restituton = 1\n")),
             ("--cues: ", "key.toml:3: 'air.restituton' is not a setting", "air.restitution")),
            (("--cues", bench.write("late.toml", head + head + b"ball.x_m = 50\n")),
             ("late.toml:3: this cue cannot run", "outside the world", "ball.x_m")),
            (("--cues", bench.write("none.toml", b"[scene]\n")), ("none.toml: is not a list of cues", "[[cue]]")),
            (("--cues", str(bench.folder / "missing.toml")), ("missing.toml: cannot be read",)),
            (("--cues", "tolk"), ("--cues: 'tolk' is no list of cues; the nearest is talk", "or give a file ending in .toml")),
            (("--cues", "talk", "--scene", "gas"), ("each cue has its own scene", "leave out --scene")),
            (("--cues", "talk", "--accuracy", "1%"), ("leave out --accuracy",)),
            (("--cues", "talk", "--ball-vx", "inf"), ("--ball-vx: 'inf' is not a finite number",)),
            (("--cues", "talk", "--set", "ball.x_m=50"),
             ("with the settings of the command line: ", "talk.toml:5: this cue cannot run"))):
        bench.refused(2, parts, "--headless", *words)
    log = str(bench.folder / "log.toml")
    talk = bench.write("two.toml", head + b"paused = true\n" + head + b"air.restitution = 0.5\n")
    bench.refused(2, ("two.toml: is a list of cues", "--cues"), "run", talk)
    reports = [bench.folder / "first.json", bench.folder / "again.json"]
    small = ("--headless", "--size", "64x64")
    done = bench.run(*small, "--cues", talk, "-p", "400", "--seconds", "0.1", "--log", log, "--report", str(reports[0]))
    told = [line for line in done.stderr.splitlines() if line.startswith("cue ")]
    check(done.returncode == 0 and told == ["cue 1 of 2: A", "cue 2 of 2: A"], f"both fly, paused or not: {told}")
    done = bench.run("run", log, *small, "--report", str(reports[1]))
    first, again = (json.loads(report.read_text()) for report in reports)
    check(first["restitution"] == 0.5 and first["num_parcels"] == 400 and first["steps"] > 3, "the last cue is reported")
    check(done.returncode == 0 and again["replay"]["same"] and again["state_hash"] == first["state_hash"], "the log replays")
    shown, gone = (title_pixels(bench, seconds) for seconds in (5, 0.2))
    check(shown > 60 and gone < 5, f"the last picture has the title, or has it no more: {shown} and {gone} bright pixels")


def title_pixels(bench, title_s):
    """Bright pixels at the lower left after 0.8 s of a cue."""
    sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
    from png import read_png
    talk = bench.write("title.toml", f'[[cue]]\ntitle = "HHHH"\ntitle_s = {title_s}\nair.kind = "vacuum"\n'.encode())
    file = bench.folder / "title.png"
    bench.run("--headless", "--cues", talk, "--size", "640x360", "--seconds", "0.8", "--record-overlay", "off", "--picture",
              str(file))
    picture = read_png(file)
    return sum(1 for y in range(300, 355) for x in range(14, 150) if min(picture.at(x, y)) > 200)


def stood_still(bench):
    """A flight that stopped cannot go on from its checkpoint, which says so."""
    state, words = str(bench.folder / "a.state"), ("--headless", "--size", "64x64")
    hot = ("--set", "air.impulse_scale=2", "--set", "air.area_fraction=0.6", "--set", "air.restitution=1")
    done = bench.run(*words, "--scene", "gas", "-p", "1000", *hot, "--seconds", "2", "--checkpoint", state)
    check(done.returncode == 1 and "Paused: " in done.stderr, f"it stops: {done.stderr.strip()[-120:]}")
    done = bench.run(*words, "--from", state, "--seconds", "3")
    check(done.returncode == 1, f"exit code {done.returncode}, expected 1")
    check("--from: the flight stood still when this state was saved" in done.stderr, f"and why: {done.stderr.strip()[-200:]}")
    old = bench.folder / "o.csv"
    old.write_text("frame,old")
    bench.refused(2, ("--from: the flight stood still",), *words, "--from", state, "--seconds", "3", "--overlay-csv", str(old))
    check(old.read_text() == "frame,old", "an older table is kept")
    done = bench.run("bench", "--flight", "--scene", "gas", "-p", "1000", *hot, "--seconds", "2", "--json", str(bench.folder / "f.json"))
    flown = json.loads((bench.folder / "f.json").read_text())
    check(flown["ended_early"] and flown["interrupted"] is False and "gpu_ms" not in flown, f"the report says so: {flown['ended_early']}")
    check(done.returncode == 1 and "the flight ended early: Paused: " in done.stderr, f"bench: {done.stderr.strip()[-120:]}")


def lost_streams(bench):
    """Streams and files that can no longer be written, and a terminal that closes, cost a run none of its other files."""
    environment, report = {**os.environ, **SOFTWARE}, bench.folder / "r.json"
    fly = [bench.program, "--headless", "--size", "64x64", "-p", "1000", "--report", str(report)]
    how = {"env": environment, "timeout": LIMIT_S, "stdout": subprocess.DEVNULL}
    with open("/dev/full", "w") as full:
        done = subprocess.run([*fly, "--seconds", "0.1"], stderr=full, **how)
        check(done.returncode == 0 and report.exists(), f"without standard error: exit code {done.returncode}")
        check(not json.loads(report.read_text())["interrupted"], "the report says that it came to its end")
        done = subprocess.run([*fly, "--seconds", "0.1", "--cuda"], stderr=full, **how)
        check(done.returncode == 0, f"nor does a message about the device end a run: exit code {done.returncode}")
        listed = subprocess.run([bench.program, "scenes"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=LIMIT_S)
        check(listed.returncode == 1 and "standard output cannot be written" in listed.stderr, "lost output is told")
    dump = bench.folder / "d.xyz"
    subprocess.run([*fly, "--seconds", "0.1", "--dump", str(dump)], preexec_fn=lambda: os.close(2), **how)
    check(dump.read_text().startswith("1000\n"), "a file does not become the standard error that was closed")
    report.unlink()
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
    done = subprocess.run([*fly, "--seconds", "1", "--dump", str(dump)], stderr=subprocess.PIPE, preexec_fn=limit, **how)
    check(done.returncode == 1 and report.exists(), f"a file-size limit: exit code {done.returncode}, with a report")
    state = bench.folder / "h.state"
    process = subprocess.Popen([*fly, "--seconds", "100000", "--checkpoint", str(state)], env=environment,
                               stderr=subprocess.PIPE, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL))
    try:
        process.stderr.readline()  # "drawing: ..."
        process.send_signal(signal.SIGHUP)
        check(process.wait(timeout=LIMIT_S) == 0 and state.exists(), "SIGHUP: the checkpoint is written")
    finally:
        process.kill()


# The input of bash-completion: the words of the command line so far, and a sign of names of files.
COMPLETE = """_init_completion() { words=($LINE '') cword=$((${#words[@]} - 1)) cur='' prev=${words[cword-1]}; }
_filedir() { COMPREPLY+=("files${1:+ in }$1"); }
source "$SCRIPT" && words=($LINE) && _pickleflight "${words[0]}" && printf '%s\\n' "${COMPREPLY[@]}"
"""


def completion(bench):
    """Bash completes what the program takes now: options for files, studies, names."""
    skip_without("bash")
    script = pathlib.Path(__file__).resolve().parents[2] / "scripts/package/completion.bash"

    # As CLI11 breaks long lines of --help since 2.5: at a space, 40 letters or more into the description.
    broken = bench.folder / "pickleflight"
    indent = 30 * " "
    broken.write_text(f"#!/bin/sh\n{bench.program} \"$@\" | sed -E 's/^(  .{{28}})(.{{40}}[^ ]*) (.*)$/\\1\\2\\n{indent}\\3/'\n")
    broken.chmod(0o755)

    def completed(program, line):
        environment = {**os.environ, "SCRIPT": str(script), "LINE": f"{program} {line}"}
        return subprocess.run(["bash", "-c", COMPLETE], env=environment, capture_output=True, text=True,
                              timeout=LIMIT_S).stdout.split()

    for line, expected in {"lab": ["validate", "contact-clock", "gas-dynamics", "plot"], "--profile-csv": ["files"],
                           "run --dump": ["files"], "bench --json": ["files"], "--method": ["impulse", "exact"],
                           "--scene": ["court", "gas"], "": ["run", "bench"]}.items():
        for program in (bench.program, broken):
            found = completed(program, line)
            check(all(word in found for word in expected), f"{line!r} is followed by {' '.join(expected)}")


CASES = {case.__name__: case for case in (settings, no_cuda, scenes, cues, files, memory, old_gl, old_gl_window, signals,
                                          stood_still, lost_streams, completion)}


def main():
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[2:]:
            CASES[name](Bench(sys.argv[1], folder))


if __name__ == "__main__":
    main()
