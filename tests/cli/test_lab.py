#!/usr/bin/python3
"""`pickleflight lab` on the command line.

test_lab.py PROGRAM refusals|terms|resume|stopped|damaged|no_matplotlib|validate
exit code 0: passed, 1: failed, 77: skipped
"""
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

PROGRAM = pathlib.Path(sys.argv[1])


def require(condition, message):
    if not condition:
        sys.exit(f"FAILED: {message}")


def environment(folder):
    return {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}


def lab(folder, *arguments):
    return subprocess.run([PROGRAM, "lab", *arguments], cwd=folder, capture_output=True, text=True, errors="replace",
                          timeout=100, env=environment(folder))


def refusals(folder):
    done = lab(folder, "work-precisoin")
    require(done.returncode == 2, f"exit code {done.returncode}")
    for part in ("nearest is work-precision", "stability", "terms", "all"):
        require(part in done.stderr, f"'{part}' is not in: {done.stderr}")
    (folder / "full").mkdir()
    (folder / "full/notes").write_text("mine")
    done = lab(folder, "terms", "--quick", "--out", "full")
    require(done.returncode == 2 and "--resume" in done.stderr and "--force" in done.stderr, done.stderr)
    require([file.name for file in (folder / "full").iterdir()] == ["notes"], "the folder was written to")
    done = lab(folder, "terms", "--quick", "--scene", "gas")
    require(done.returncode == 2 and "--scene" in done.stderr, done.stderr)
    done = lab(folder, "all", "--quick", "--scene", "gas")
    require(done.returncode == 2 and "--scene" in done.stderr, done.stderr)
    done = lab(folder, "terms", "--quick", "--scene", b"a\xff.toml")
    require(done.returncode == 2 and "is not UTF-8; rename the file" in done.stderr, done.stderr)
    require(not (folder / "lab-all").exists(), "other studies ran before the scene of terms was refused")
    done = lab(folder, "plot", "full")
    require(done.returncode == 2 and "no result of a study" in done.stderr, done.stderr)
    done = lab(folder, "plot")
    require(done.returncode == 2 and "takes only the folder" in done.stderr, done.stderr)
    done = lab(folder, "terms", "full")
    require(done.returncode == 2, f"a folder without --out was accepted: {done.stderr}")


def terms(folder):
    done = lab(folder, "terms", "--quick", "--out", "t")
    require(done.returncode == 0, f"exit code {done.returncode}: {done.stderr}")
    require("\r" not in done.stderr, "a progress display in a pipe")
    study = json.loads((folder / "t/terms.json").read_text())
    require(study["complete"] is True, "complete is not true")
    rows = {row["term"]: row for row in study["points"]}
    # The court's spin bends the flight by 2.8 m. Without Magnus the exit moves by about as much, to the right.
    require(-3.5 < rows["Magnus"]["deflection_m"] < -2.2, rows["Magnus"])
    require(rows["Magnus"]["verdict"] == "keep", rows["Magnus"])
    # Without air the ball keeps its speed of 15 m/s. With air it loses about a third.
    require(abs(rows["air altogether"]["flights"][0][2] - 15.0) < 1e-9, rows["air altogether"])
    require(0.1 < rows["air altogether"]["speed_shift"] < 0.6, rows["air altogether"])
    lines = list(csv.DictReader((folder / "t/terms.csv").open()))
    require(len(lines) == len(study["points"]), f"{len(lines)} rows in the CSV")
    require(lines[3]["verdict"] == "keep", lines[3])
    page = (folder / "t/report.html").read_text()
    for part in ("pickleflight lab terms --quick", "Magnus", "src=\"data:image/png" if drawn(folder) else "terms.csv"):
        require(part in page, f"'{part}' is not in the report")


def drawn(folder):
    return (folder / "t/terms.png").exists()


def resume(folder):
    """Ctrl-C keeps finished points; --resume measures only the others."""
    process = subprocess.Popen([PROGRAM, "lab", "terms", "--quick", "--out", "t"], cwd=folder, stderr=subprocess.PIPE,
                               text=True, env=environment(folder))
    until = time.monotonic() + 60
    while not (folder / "t/terms.json").exists() and time.monotonic() < until:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    errors = process.communicate(timeout=60)[1]
    require(process.returncode == 1 and "--resume" in errors, f"exit code {process.returncode}: {errors}")
    before = json.loads((folder / "t/terms.json").read_text())
    require(before["complete"] is False and 0 < len(before["points"]) < 6, f"{len(before['points'])} points")
    before["machine"] |= {"cores": 64, "devices": [{"series": "cpu", "device": "another one"}]}
    (folder / "t/terms.json").write_text(json.dumps(before))
    done = lab(folder, "terms", "--quick", "--out", "t", "--resume")
    require(done.returncode == 0, done.stderr)
    after = json.loads((folder / "t/terms.json").read_text())
    machine = after["machine"]
    require(machine["cores"] == 64 and machine["devices"][0]["device"] == "another one" and len(machine["devices"]) == 2,
            f"the run was started elsewhere, but the file has {machine}")
    require(after["complete"] is True and len(after["points"]) == 6, f"{len(after['points'])} points")
    first = before["points"][0]
    # Wall times never repeat: an equal one is that of the old point.
    require(after["points"][0]["ms_per_simulated_s"] == first["ms_per_simulated_s"], "a finished point was measured again")
    # Costs of two machines are not compared.
    after["points"][0]["timed_on"] = "another one"
    (folder / "t/terms.json").write_text(json.dumps(after))
    done = lab(folder, "terms", "--quick", "--out", "t", "--resume")
    costs = [row["saved_share"] for row in json.loads((folder / "t/terms.json").read_text())["points"][1:]]
    require(done.returncode == 0 and costs == [None] * 5, f"{costs}, {done.stderr}")
    require("timed on another machine" in (folder / "t/report.html").read_text(), "the report compares two machines")
    whole = (folder / "t/terms.json").read_text()
    # Flights of two scenes are not, either, also if the scene had the same name.
    (folder / "t/terms.json").write_text(json.dumps(json.loads(whole) | {"scene_settings": "name = 'court'"}))
    done = lab(folder, "terms", "--quick", "--out", "t", "--resume")
    require(done.returncode == 2 and "when scene court had other settings" in done.stderr, done.stderr)
    (folder / "t/terms.json").write_text(whole)
    done = lab(folder, "terms", "--quick", "--scene", "regulation", "--out", "t", "--resume")
    require(done.returncode == 2 and "was measured with --scene court; give that" in done.stderr, done.stderr)
    require((folder / "t/terms.json").read_text() == whole, "the flights of another scene were touched")


def stopped(folder):
    """A study that is stopped after its first points has its pictures; a new start removes those of the old one."""
    process = subprocess.Popen([PROGRAM, "lab", "gas-dynamics", "--quick", "--out", "g"], cwd=folder,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(folder))
    require("0 of " in process.stderr.readline(), "no line on the first point")
    process.send_signal(signal.SIGINT)
    words, errors = process.communicate(timeout=100)
    require(process.returncode == 1 and "--resume" in errors, f"exit code {process.returncode}: {errors}")
    require(" failed: " not in errors, errors)
    require(all(line.startswith("so far: ") for line in words.splitlines()), words)
    done = lab(folder, "gas-dynamics", "--out", "g", "--resume")
    require(done.returncode == 2 and "add it" in done.stderr, f"a --quick run is to be continued with it: {done.stderr}")
    (folder / "t").mkdir()
    (folder / "t/terms-old.png").write_text("a picture of the figures before")
    done = lab(folder, "terms", "--quick", "--out", "t", "--force")
    require(done.returncode == 0 and not (folder / "t/terms-old.png").exists(), f"an old picture stays: {done.stderr}")


def damaged(folder):
    """A damaged result stops no program and no report of the others."""
    done = lab(folder, "terms", "--quick", "--out", "t")
    require(done.returncode == 0, done.stderr)
    whole = json.loads((folder / "t/terms.json").read_text())
    for text in ("{", '{"study": 5}', json.dumps(whole | {"points": [{"key": "court/all terms"}]})):
        (folder / "t/terms.json").write_text(text)
        done = lab(folder, "terms", "--quick", "--out", "t", "--resume")
        require(done.returncode == 2 and "terms.json' " in done.stderr, f"{text}: {done.returncode}, {done.stderr}")
        require((folder / "t/terms.json").read_text() == text, "the file was written to")
    (folder / "t/terms.json").write_text(json.dumps(whole))
    (folder / "t/stability.json").write_text("{")
    done = lab(folder, "plot", "t")
    require(done.returncode == 1 and "Traceback" not in done.stderr and "stability.json" in done.stderr, done.stderr)
    require("Magnus" in (folder / "t/report.html").read_text(), "the report lacks the study that is whole")


def no_matplotlib(folder):
    """A Python without matplotlib, simulated by a module of that name that raises ModuleNotFoundError."""
    (folder / "hidden/matplotlib").mkdir(parents=True)
    (folder / "hidden/matplotlib/__init__.py").write_text("raise ModuleNotFoundError(\"No module named 'matplotlib'\")\n")
    done = subprocess.run([PROGRAM, "lab", "terms", "--quick", "--out", "t"], cwd=folder, capture_output=True, text=True,
                          timeout=100, env={**environment(folder), "PYTHONPATH": str(folder / "hidden")})
    require(done.returncode == 0, f"exit code {done.returncode}: {done.stderr}")
    require("apt install python3-matplotlib" in done.stderr, done.stderr)
    require((folder / "t/terms.csv").exists() and not (folder / "t/terms.png").exists(), "no CSV, or a picture")
    require("terms.csv has the figures" in (folder / "t/report.html").read_text(), "the report does not name the CSV")
    require("pickleflight lab plot t" in done.stderr, done.stderr)
    # With matplotlib, the folder is drawn elsewhere without measuring.
    (folder / "t").rename(folder / "taken away")
    before = (folder / "taken away/terms.json").read_bytes()
    done = lab(folder, "plot", "taken away")
    if "matplotlib is missing" in done.stderr:
        require(done.returncode == 1, f"exit code {done.returncode}: {done.stderr}")
        return
    require(done.returncode == 0, f"exit code {done.returncode}: {done.stderr}")
    require((folder / "taken away/terms.png").exists(), "no picture")
    require("src=\"data:image/png" in (folder / "taken away/report.html").read_text(), "no picture in the report")
    require((folder / "taken away/terms.json").read_bytes() == before, "the results were written to")


def validate(folder):
    """The validation as a study, resumed after a stop. It is stopped after the first cases, since all take a minute."""
    study = validate_until(folder, 2)
    require(study["failed"] == [] and study["complete"] is False, study)
    require([row["key"] for row in study["points"]][:2] == ["two bodies", "heavy ball"], study["points"])
    require(all(row["verdict"] in ("pass", "-") for row in study["points"]), study["points"])
    require("two bodies" in (folder / "v/report.html").read_text(), "the cases are not in the report")
    more = validate_until(folder, len(study["points"]), "--resume")
    # The rows contain measured times: equal rows were not measured again.
    require(more["points"][:len(study["points"])] == study["points"], "a finished row was measured again")


def validate_until(folder, num_rows, *words):
    """Content of its file after Ctrl-C at more than num_rows rows."""
    process = subprocess.Popen([PROGRAM, "lab", "validate", "--quick", "--out", "v", *words], cwd=folder,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment(folder))
    file, until = folder / "v/validate.json", time.monotonic() + 60
    while time.monotonic() < until and not (file.exists() and len(json.loads(file.read_text())["points"]) > num_rows):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    errors = process.communicate(timeout=60)[1]
    require(process.returncode == 1 and "--resume" in errors, f"exit code {process.returncode}: {errors}")
    return json.loads(file.read_text())


CASES = {case.__name__: case for case in (refusals, terms, resume, stopped, damaged, no_matplotlib, validate)}


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="pickleflight-lab-"))
    try:
        CASES[sys.argv[2]](folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
