#!/usr/bin/python3
"""Films, pictures and logs of a headless run, and films after failures.

test_record.py PROGRAM CASE...   exit code 0: passed, 1: failed, 77: skipped, since something is missing
"""
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from film import frame, mean_difference, probe
from png import read_png

SKIPPED = 77
LIMIT_S = 60
ENVIRONMENT = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"}
WIDTH, HEIGHT = 320, 180
SMALL = ("--size", f"{WIDTH}x{HEIGHT}", "-p", "500")


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def skip(reason):
    print(f"SKIPPED: {reason}")
    sys.exit(SKIPPED)


def skip_without(*tools):
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if missing:
        skip(f"{' and '.join(missing)} not found")


def wait_for(what, test):
    end = time.monotonic() + LIMIT_S
    while time.monotonic() < end:
        if test():
            return
        time.sleep(0.02)
    raise AssertionError(f"no {what} after {LIMIT_S} s")


class Bench:
    def __init__(self, program, folder):
        self.program, self.folder = os.path.abspath(program), pathlib.Path(folder)

    def words(self, *words):
        return [self.program, "run", *words, "--report", "report.json"]

    def run(self, *words, exit_code=0):
        """Runs headless and returns the report."""
        done = subprocess.run(self.words("--headless", *words), cwd=self.folder, env=ENVIRONMENT, capture_output=True,
                              text=True, timeout=LIMIT_S)
        if "no OpenGL 4.5" in done.stderr:
            skip("no OpenGL 4.5 here")
        self.messages = done.stderr
        if done.returncode != exit_code:
            print(done.stderr)
        check(done.returncode == exit_code, f"{' '.join(words)}: exit code {done.returncode}")
        return json.loads((self.folder / "report.json").read_text())

    def start(self, *words):
        """Starts a run of ten minutes in the background."""
        self.errors = open(self.folder / "errors.txt", "w+", encoding="utf-8")
        return subprocess.Popen(self.words("--headless", *SMALL, "--seconds", "600", *words), cwd=self.folder,
                                env=ENVIRONMENT, stderr=self.errors)

    def error_output(self):
        return (self.folder / "errors.txt").read_text()

    def fragments(self, name):
        """Number of fragments, of a second each, in an mp4."""
        file = self.folder / name
        return file.read_bytes().count(b"moof") if file.exists() else 0

    def picture(self, name):
        return read_png(self.folder / name).rgb


def check_film(bench, name, min_frames):
    found, complaints = probe(bench.folder / name)
    check(found["nb_read_frames"] >= min_frames, f"the film plays: {found['nb_read_frames']} frames {complaints}")


def decoded(bench):
    """Number, rate and size of frames. First and last frame equal the pictures."""
    skip_without("ffmpeg", "ffprobe")
    look = (*SMALL, "--record-overlay", "off", "--set", "run.frame_rate_hz=30")
    bench.run(*look, "--seconds", str(1 / 30), "--picture", "first.png")
    # In between, the ball moves by several of its diameters.
    report = bench.run(*look, "--seconds", "1.5", "--time-scale", "0.3", "--picture", "last.png", "--record", "a.mp4")
    check(report["record"]["frames"] == 45 and report["record"]["dropped"] == 0, f"45 frames: {report['record']}")
    check(report["record"]["encoder"] in ("libx264", "h264_nvenc"), f"by {report['record']['encoder']}")
    found, complaints = probe(bench.folder / "a.mp4")
    check(complaints == "", f"no complaints: {complaints}")
    check(found == {"codec_name": "h264", "width": WIDTH, "height": HEIGHT, "r_frame_rate": "30/1",
                    "nb_read_frames": 45}, f"the film: {found}")
    first, last = bench.picture("first.png"), bench.picture("last.png")
    for name, index, same, other in (("first", 0, first, last), ("last", 44, last, first)):
        shown = frame(bench.folder / "a.mp4", index)
        near, far = mean_difference(shown, same), mean_difference(shown, other)
        # The encoder blurs the colour of discs of two pixels. In another frame all discs are elsewhere.
        check(near < 6.0 and near < 0.5 * far, f"{name} frame: {near:.2f} from its picture, {far:.2f} from the other")


def raw(bench):
    """Raw frames equal the pictures in every byte and in order."""
    look = (*SMALL, "--record-overlay", "off")
    pictures = []
    for num in (1, 2, 7):
        bench.run(*look, "--seconds", str(num / 60), "--picture", "p.png")
        pictures.append((num - 1, bench.picture("p.png")))
    report = bench.run(*look, "--seconds", str(7 / 60), "--record", "a.rgb")
    data = (bench.folder / "a.rgb").read_bytes()
    size = 4 * WIDTH * HEIGHT
    check(len(data) == 7 * size and report["record"]["encoder"] == "raw", f"7 frames: {len(data) / size}")
    for index, picture in pictures:
        rgba = bytearray(data[index * size:(index + 1) * size])
        del rgba[3::4]
        check(bytes(rgba) == picture, f"frame {index} equals its picture in every byte")


def sizes(bench):
    """A film of 1080p is drawn in that size. Panel and overlay appear as requested."""
    size = 4 * 1920 * 1080
    few = ("-p", "500", "--seconds", str(3 / 60), "--record", "a.rgb")
    report = bench.run(*few, "--size", f"{WIDTH}x{HEIGHT}", "--record-size", "1920x1080")
    data = (bench.folder / "a.rgb").read_bytes()
    check(len(data) == 3 * size and report["record"]["width"] == 1920, "three frames of 1920x1080")
    # In an enlarged picture, groups of six neighbours in a row would be nearly equal.
    row = [data[4 * (1920 * 700 + x):4 * (1920 * 700 + x) + 3] for x in range(1920)]
    steps = sum(max(abs(a - b) for a, b in zip(row[x], row[x + 1])) > 60 for x in range(1919))
    check(steps > 4, f"it is drawn in that size: {steps} sharp edges in a row")
    bench.run(*few, "--size", "1280x720", "--record-overlay", "off")
    bare = (bench.folder / "a.rgb").read_bytes()[:4 * 1280 * 720]
    for flag, value, column in (("--record-overlay", "on", None), ("--record-panel", None, 100)):
        overlay = () if value else ("--record-overlay", "off")
        bench.run(*few, "--size", "1280x720", flag, *([value] if value else []), *overlay)
        full = (bench.folder / "a.rgb").read_bytes()[:4 * 1280 * 720]
        x, y = (600, 690) if column is None else (column, 30)
        region = [full[4 * (1280 * (y + i) + x + j)] != bare[4 * (1280 * (y + i) + x + j)]
                  for i in range(20) for j in range(100)]
        check(sum(region) > 200, f"{flag} is in the film: {sum(region)} of 2000 points differ")


def real_time(bench):
    """The film lasts as long as the clock, for any number of drawn frames."""
    skip_without("ffmpeg", "ffprobe")
    for kind, words in (("fast", ("--size", "160x90", "-p", "100", "--seconds", "6")),
                        ("slow", ("--size", "640x360", "-p", "300000", "--seconds", "0.2"))):
        report = bench.run(*words, "--record", "a.mkv", "--record-time", "real")
        film, drawn = report["record"], round(60 * float(words[-1]))
        check(film["frames"] == drawn - film["surplus"] - film["dropped"] + film["duplicated"],
              f"{kind}: every frame is accounted for: {drawn} drawn, {film}")
        check_film(bench, "a.mkv", film["frames"])
        # The clock of the film starts with its first frame.
        off_s = report["wall_s"] - film["frames"] / 60
        check(-0.05 < off_s < 0.15 + 0.3 * report["wall_s"],
              f"{kind}: the film is {off_s:.3f} s shorter than the run of {report['wall_s']:.3f} s")
    check(film["duplicated"] > 0, "and a slow run repeats frames")


def child_of(process):
    listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, text=True)
    return [int(word) for word in listed.stdout.split()]


def encoder_killed(bench):
    skip_without("ffmpeg", "ffprobe", "ps")
    process = bench.start("--record", "a.mp4")
    try:
        wait_for("second of film", lambda: bench.fragments("a.mp4") >= 3)
        for child in child_of(process):
            os.kill(child, signal.SIGKILL)
        wait_for("message", lambda: "recording stopped, the run continues" in bench.error_output())
        check("ffmpeg was killed" in bench.error_output(), "the message names ffmpeg")
        time.sleep(0.3)
        check(process.poll() is None, "the run continues")
        process.send_signal(signal.SIGTERM)
        check(process.wait(timeout=LIMIT_S) == 1, "exit code 1: the film is incomplete")
    finally:
        process.kill()
    report = json.loads((bench.folder / "report.json").read_text())
    film = report["record"]
    check("ffmpeg was killed" in film["failure"] and film["dropped"] > 0, f"the report has the failure: {film}")
    # 2 steps a frame.
    check(report["steps"] > 2 * (film["frames"] + film["dropped"]), "and has the steps of the whole run")
    check_film(bench, "a.mp4", 60)


def tables_broken_off(bench):
    """Files of figures on a full disk."""
    for words in (["--overlay-csv"], ["--set", "run.profile=x", "--profile-csv"]):
        (bench.folder / "full").unlink(missing_ok=True)
        (bench.folder / "full").symlink_to("/dev/full")
        bench.run(*SMALL, "--seconds", "0.1", *words, "full", exit_code=1)
        check(f"{words[-1]}: the file broke off" in bench.messages, f"{bench.messages.strip()[-200:]}")


def pictures_broken_off(bench):
    """A last picture on a full disk: report and checkpoint or dump are there all the same."""
    for words in (["--picture", "full.png"], ["--picture", "full.svg"], ["--still", "0.05", "full.png"],
                  ["--still", "0.05", "full.svg"]):
        full, other = bench.folder / words[-1], bench.folder / ("a.xyz" if words[0] == "--still" else "a.state")
        full.unlink(missing_ok=True)
        full.symlink_to("/dev/full")
        other.unlink(missing_ok=True)
        more = ["--dump", "a.xyz"] if words[0] == "--still" else ["--seconds", "0.1", "--checkpoint", "a.state"]
        report = bench.run(*SMALL, *more, *words, exit_code=1)
        check("cannot be written" in bench.messages, f"{bench.messages.strip()[-200:]}")
        check(report["steps"] > 0 and other.exists(), f"   report and {other.name} are there")


def program_killed(bench):
    skip_without("ffmpeg", "ffprobe")
    process = bench.start("--record", "a.mp4")
    try:
        wait_for("second of film", lambda: bench.fragments("a.mp4") >= 2)
    finally:
        process.kill()
        process.wait()
    # ffmpeg reads the rest and exits.
    wait_for("complete film", lambda: probe(bench.folder / "a.mp4")[1] == "")
    check_film(bench, "a.mp4", 60)
    report = bench.run("a.mp4.toml")
    check(report["replay"]["same"] and report["replay"]["checks"] >= 1, f"and its log, too: {report['replay']}")


FULL_DISK = """
mount -t tmpfs -o size=$1 none disk || exit 77
shift
"$@"
code=$?
cp disk/a.mp4 kept.mp4
exit $code
"""


def disk_full(bench):
    skip_without("ffmpeg", "ffprobe", "unshare")
    (bench.folder / "disk").mkdir()

    def record(size, seconds):
        words = ["unshare", "--map-root-user", "--mount", "sh", "-c", FULL_DISK, "sh", size,
                 *bench.words("--headless", *SMALL, "--seconds", seconds, "--record", "disk/a.mp4")]
        return subprocess.run(words, cwd=bench.folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=LIMIT_S)

    done = record("120k", "8")
    if not (bench.folder / "report.json").exists():
        skip(f"no disk of 120 kB can be mounted here: {done.stderr.strip()}")
    check("recording stopped, the run continues" in done.stderr and "No space left on device" in done.stderr,
          f"the messages: {done.stderr.strip()[-300:]}")
    check(done.returncode == 1, f"exit code {done.returncode}, expected 1: the film is incomplete")
    report = json.loads((bench.folder / "report.json").read_text())
    check(report["frame_ms"]["median"] and report["simulated_s"] > 0.79, f"the whole flight: {report['simulated_s']} s")
    check(report["record"]["frames"] + report["record"]["dropped"] <= 480 and report["record"]["dropped"] > 0,
          f"frames and dropped: {report['record']}")
    check_film(bench, "kept.mp4", 60)
    # ffmpeg writes a film this short when it has all frames.
    done = record("20k", "0.5")
    check(done.returncode == 1 and "No space left on device" in done.stderr,
          f"a short film, exit code {done.returncode}: {done.stderr.strip()[-200:]}")


def replay(bench):
    """A replay on another number of threads gives the same flight. A changed line is detected."""
    first = bench.run(*SMALL, "--seconds", "2.2", "--threads", "2", "--log", "a.toml", "--ball-spin", "-30.1")
    check(first["replay"] is None and first["record"] is None, "a first flight is not a replay")
    again = bench.run("a.toml", "--size", "160x90")
    check(again["replay"]["same"] and again["replay"]["checks"] == 3, f"three states agree: {again['replay']}")
    check(again["state_hash"] == first["state_hash"] and again["steps"] == first["steps"], "the same state at the end")
    check("replay: the same flight" in bench.messages, "a message says so")
    text = (bench.folder / "a.toml").read_text()
    threads = text.replace("run.threads = 2", "run.threads = 1")
    (bench.folder / "b.toml").write_text(threads)
    check(threads != text and bench.run("b.toml")["state_hash"] == first["state_hash"], "also on one thread")
    changed = text.replace("\n[[frame]]\nnumber = 59",
                           '\n[[frame]]\nnumber = 59\nset = ["ball.spin_radps = -30"]', 1)
    check(changed != text, "one line is changed, in the last frame of the first second")
    (bench.folder / "c.toml").write_text(changed)
    found = bench.run("c.toml", exit_code=1)["replay"]["first_divergence"]
    check(found["frame"] == 59 and found["last_same_frame"] is None, f"the first divergence: {found}")
    later = text.replace("\n[[frame]]\nnumber = 119", '\n[[frame]]\nnumber = 100\npress = ["launch"]\n'
                         "\n[[frame]]\nnumber = 119", 1)
    (bench.folder / "d.toml").write_text(later)
    found = bench.run("d.toml", exit_code=1)["replay"]["first_divergence"]
    check(found["frame"] == 119 and found["last_same_frame"] == 59, f"an additional input: {found}")
    check("diverged: frame 119" in bench.messages and "frame 59 was the same" in bench.messages, "a message says so")
    done = subprocess.run([bench.program, "run", "a.toml", "-p", "100"], cwd=bench.folder, capture_output=True, text=True)
    check(done.returncode == 2 and "a log has its own scene" in done.stderr, f"other settings: {done.stderr.strip()}")


def texts_of(file):
    """tEXt chunks of a PNG."""
    data, found, at = file.read_bytes(), {}, 8
    while at < len(data):
        size, name = struct.unpack(">I4s", data[at:at + 8])
        if name == b"tEXt":
            key, _, text = data[at + 8:at + 8 + size].partition(b"\0")
            found[key.decode()] = text.decode()
        at += 12 + size
    return found


def stills(bench):
    """Pictures at a simulated time contain the scene."""
    for text in ("0", "0.1234567", "0.05"):
        bench.run(*SMALL, "--ball-spin", "12.5", "--time-scale", "0.2", "--still", text, "a.png")
        texts = texts_of(bench.folder / "a.png")
        at = float(texts["Simulated time"].split()[0])
        # The shortest frame takes 1e-6 / 60 s (the smallest time scale).
        check(abs(at - float(text)) < 2e-8, f"at {texts['Simulated time']}, asked {text}")
    bench.run(*SMALL, "--set", "run.dt_s=0.01", "--still", "0.05", "b.png")
    check("--still" not in bench.messages, "a step ends then")
    bench.run(*SMALL, "--set", "run.dt_s=0.01", "--still", "0.053", "b.png")
    check("--still: no step of 0.01 s ends at 0.053 s; the picture is of 0.06 s" in bench.messages, "or is said not to")
    check(texts["Software"].startswith("pickleflight ") and texts["Backend"] == "cpu", f"{texts['Software']}")
    check("spin_radps = 12.5" in texts["Scene"] and "time_scale = 0.2 " in texts["Scene"], "and the scene as TOML")
    (bench.folder / "scene.toml").write_text(texts["Scene"])
    bench.run("--size", f"{WIDTH}x{HEIGHT}", "--scene", "scene.toml", "--record-overlay", "off", "--still", "0.05", "b.png")
    bench.run(*SMALL, "--ball-spin", "12.5", "--time-scale", "0.2", "--record-overlay", "off", "--still", "0.05", "c.png")
    check(bench.picture("b.png") == bench.picture("c.png"), "that scene gives the same picture")
    done = subprocess.run([bench.program, *SMALL, "--set", "run.relaunch=false", "--time-scale", "1", "--still", "9",
                           "d.png"], cwd=bench.folder, env=ENVIRONMENT, capture_output=True, text=True)
    check(done.returncode == 2 and "give an earlier time" in done.stderr, f"too late: {done.stderr.strip()[-120:]}")


CASES = {case.__name__: case for case in (decoded, raw, sizes, real_time, encoder_killed, program_killed, disk_full,
                                          tables_broken_off, pictures_broken_off, replay, stills)}


def main():
    for name in sys.argv[2:]:
        with tempfile.TemporaryDirectory() as folder:
            CASES[name](Bench(sys.argv[1], folder))


if __name__ == "__main__":
    main()
