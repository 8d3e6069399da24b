#!/usr/bin/python3
"""Two methods at once without a window: films, pictures, report, log, refusals.

test_split.py PROGRAM CASE...   exit code 0: passed, 1: failed, 77: skipped, since something is missing
"""
import pathlib
import re
import shutil
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "golden"))
from film import frame, mean_difference, probe
from png import read_png
from test_record import Bench, check, skip

SIZE = (640, 360)
SMALL = ("--size", f"{SIZE[0]}x{SIZE[1]}", "-p", "400", "--time-scale", "0.2", "--overlay", "off")


def hash_alone(bench, *words):
    return bench.run(*SMALL, "--seconds", "0.5", *words)["state_hash"]


def halves(bench):
    """A film of two halves; the report has both flights, each with the state that it has alone."""
    report = bench.run(*SMALL, "--seconds", "0.5", "--split", "method=exact", "--split", "restitution=0.3", "--record",
                       "a.mp4", "--picture", "a.png")
    split = report["split"]
    check(split["set"] == ["run.method = exact", "air.restitution = 0.3"], f"the difference: {split['set']}")
    check(report["method"] == "impulse" and split["second"]["method"] == "exact", "both methods")
    check(split["second"]["restitution"] == 0.3 and report["restitution"] == 0.9, "both restitutions")
    check(split["second"]["simulated_s"] == report["simulated_s"], "one clock")
    said = re.search(r"the second flight \(exact.*\) beside the first, 0\.1 s after the launch; balls \S+ \S+ apart, \S+ \S+ at most; "
                     r"energy -\S+ %, the first's \S+ %; \S+ times the computing time", bench.messages)
    check(said, f"it is said: {bench.messages.splitlines()[-1]}")
    figures = split["compared"]
    check(figures["distance_m"]["max"] >= figures["distance_m"]["final"] > 0.0, f"distance: {figures['distance_m']}")
    check(figures["cost_ms_per_s"]["ratio"] > 0.0, f"cost: {figures['cost_ms_per_s']}")
    check(figures["energy_drift"]["difference"] < 0.0, f"energy: {figures['energy_drift']}")
    check(report["state_hash"] == hash_alone(bench), "the first is the same alone")
    alone = hash_alone(bench, "--method", "exact", "--set", "air.restitution=0.3")
    check(split["second"]["state_hash"] == alone, "the second is the same alone")
    picture = read_png(bench.folder / "a.png")
    bench.run(*SMALL, "--seconds", "0.5", "--picture", "b.png")
    one = read_png(bench.folder / "b.png")
    check(mean_difference(picture.rgb, one.rgb) > 5.0, "the picture is another than that of one flight")
    if shutil.which("ffmpeg") is None:
        skip("ffmpeg not found")
    found, complaints = probe(bench.folder / "a.mp4")
    check(complaints == "" and (found["width"], found["height"]) == SIZE and found["nb_read_frames"] == 30, f"film: {found}")
    check(mean_difference(frame(bench.folder / "a.mp4", 29), picture.rgb) < 4.0, "its last frame is the picture")


def picture(bench):
    """Both in one picture: the second ball is drawn, the divider is not; a film of another size shows the same."""
    words = (*SMALL, "--set", "air.kind=vacuum", "--ball-spin", "1500", "--split", "magnus=false", "--seconds", "0.4")
    bench.run(*words, "--split-view", "picture", "--picture", "one.png", "--record", "f/%05d.png", "--record-size", "960x540")
    bench.run(*words, "--picture", "two.png")
    one, two = (read_png(bench.folder / name) for name in ("one.png", "two.png"))
    check(mean_difference(one.rgb, two.rgb) > 3.0, "one picture is not two halves")
    film = read_png(sorted((bench.folder / "f").iterdir())[-1])
    check((film.width, film.height) == (960, 540), "the film has its own size")
    yellow = [sum(is_ball(image.at(x, y)) for x in range(image.width) for y in range(image.height)) for image in (one, film)]
    check(yellow[0] > 20 and yellow[1] > yellow[0], f"with balls: {yellow} pixels")


def is_ball(color):
    return color[0] > 150 and color[1] > 140 and color[2] < 100


def replay(bench):
    """The log of a split run flies both flights again, and compares both."""
    report = bench.run(*SMALL, "--seconds", "1.2", "--split", "--log", "a.toml")
    again = bench.run("a.toml", "--size", "320x180")
    check(again["replay"]["same"] and again["replay"]["checks"] == 4, f"compared: {again['replay']}")
    check(again["state_hash"] == report["state_hash"], "the first is the same")
    check(again["split"]["second"]["state_hash"] == report["split"]["second"]["state_hash"], "the second is the same")
    log = bench.folder / "a.toml"
    text = log.read_text()
    check("run.method = spring" in text, "the method that was next is in the log")
    log.write_text(text.replace("run.method = spring", "air.restitution = 0.2"))
    bench.run("a.toml", "--size", "320x180", exit_code=1)


def dropped(bench):
    """A second flight that a cue cannot take along ends, and the run says so."""
    cue = "[[cue]]\ntitle = '{}'\nrun.seconds = 0.1\nair.num_parcels = 300\n{}"
    (bench.folder / "c.toml").write_text(cue.format("a", "") + cue.format("b", "run.dt_s = 0.01\nrun.spring_contact_s = 1e-6\n"))
    report = bench.run("--cues", "c.toml", "--size", "64x64", "--split", "method=spring")
    last = bench.messages.splitlines()[-1]
    check(report["split"] is None and "its second half cannot follow: run.dt_s: 0.01 s is beyond" in last, f"it is said: {last}")


def refusals(bench):
    """What cannot be compared is refused in one line."""
    log = bench.folder / "a.toml"
    both = bench.folder / "both.toml"
    bench.run(*SMALL, "--seconds", "0.1", "--log", "a.toml")
    bench.run(*SMALL, "--seconds", "0.1", "--split", "--log", "both.toml")
    for words, part in ((("--split", "air.num_parcels=3"), "air.num_parcels cannot differ"),
                        (("--split", "run.methods=spring"), "run.method"),
                        (("--split", "method=sprong"), "spring"),
                        (("--split", "method=spring", "--dt", "0.01", "--set", "run.spring_contact_s=1e-6"),
                         "the second half cannot fly"),
                        (("--split-view", "picture"), "needs --split"),
                        (("--split", "--split-view", "both"), "one of halves, picture"),
                        ((str(log), "--split"), "a log of two flights has its own"),
                        (("--split", "--dump", "a.h5"), "--dump has one flight only"),
                        (("--split", "--checkpoint", "a.pfc"), "--checkpoint has one flight only"),
                        (("--split", "--picture-size", "2000x1000"), "--picture-size has one flight only"),
                        (("--split", "--still", "0.1", "a.svg"), "--still with .svg has one flight only"),
                        ((str(both), "--dump", "b.h5"), "--dump has one flight only")):
        bench.run(*words, exit_code=2)
        lines = bench.messages.strip().splitlines()
        check(part in lines[-1] and sum(line.startswith("pickleflight: ") for line in lines) == 1, f"{words}: {lines[-1]}")


CASES = {case.__name__: case for case in (halves, picture, replay, dropped, refusals)}


def main():
    for name in sys.argv[2:]:
        with tempfile.TemporaryDirectory() as folder:
            CASES[name](Bench(sys.argv[1], folder))


if __name__ == "__main__":
    main()
