#!/usr/bin/env python3
"""Plants faults in src/model, one at a time, and lists which test detects each.

    tests/faults/plant_faults.py SCRATCH_FOLDER [--only NAME ...] [--table killed.md]
    tests/faults/plant_faults.py --check

All faults (faults.py, faults_exact.py) are built into one program, in a copy of the sources under SCRATCH_FOLDER:
each wrong expression stands beside the right one, and PF_PLANTED_FAULT in the environment chooses. So the program
is built once, and without a fault it must pass. --check only verifies that the sources contain the text of every
fault exactly once.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from faults import STEPPED
from faults_exact import EQUIVALENT, EXACT

FAULTS = STEPPED + EXACT
SOURCE = Path(__file__).resolve().parents[2]
HEADER = """// Number of the fault that is planted in this process; 0: none.
#pragma once
#include <cstdlib>
namespace pf {
inline const int planted_fault = [] {
  const char* text = std::getenv("PF_PLANTED_FAULT");
  return text == nullptr ? 0 : std::atoi(text);
}();
}
#define PF_EITHER(number, wrong, right) (::pf::planted_fault == (number) ? (wrong) : (right))
"""
# Tests of more than a second each: run only for faults that the others do not detect.
SLOW = ("Gas.Collision*:Gas.MomentumIs*:Determinism.GridEquals*:Discs.OverlapWherever*:Ball.Holds*:*Conserved*:*Tunnel*:"
        "*CannotBeResolved*:*TicksGrow*")
# Threads that wait for each other are slow beside other programs.
NEVER = "*Threads*"
GOLDEN = "GoldenHashes.*"
# Time limits, ten times the usual time; some faults make `exact` repeat one collision without end.
QUICK_LIMIT_S, SLOW_LIMIT_S = 60, 300


def copy_sources(to: Path) -> None:
    names = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=SOURCE, check=True,
                           capture_output=True, text=True).stdout.split("\n")
    for name in filter(None, names):
        if not (SOURCE / name).is_file():
            continue
        target = to / name
        if name.startswith("src/model/") or name == "src/app/scene_run.hpp":
            continue  # written below
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.exists() or target.read_bytes() != (SOURCE / name).read_bytes():
            shutil.copyfile(SOURCE / name, target)


def once(text: str, part: str, fault_name: str) -> int:
    if text.count(part) != 1:
        sys.exit(f"{fault_name}: {part!r} occurs {text.count(part)} times instead of once")
    return text.index(part)


def edits_of(text: str, file: str) -> list:
    """(begin, end, new text) of every fault of a file."""
    edits = []
    for number, fault in enumerate(FAULTS, 1):
        if fault.file != file:
            continue
        begin = once(text, fault.where, fault.name) + once(fault.where, fault.right, fault.name)
        end = begin + len(fault.right)
        edits.append((begin, end, f"PF_EITHER({number}, ({fault.wrong}), ({fault.right}))"))
    return sorted(edits)


def planted(file: str, text: str) -> str:
    """A header of the model with all of its faults. file: its path under src/model."""
    edits = edits_of(text, file)
    for (_, end, _), (begin, _, _) in zip(edits, edits[1:]):
        if begin < end:
            sys.exit(f"{file}: two faults overlap at {text[begin:begin + 40]!r}")
    for begin, end, new in reversed(edits):
        text = text[:begin] + new + text[end:]
    if edits:
        text = text.replace("#pragma once\n", '#pragma once\n#include "model/planted_fault.hpp"\n', 1)
    return text


def planted_headers() -> dict:
    """Every header of the model with its faults, by its path under src/model."""
    model = SOURCE / "src/model"
    files = {path.relative_to(model).as_posix(): path.read_text() for path in model.rglob("*.hpp")}
    for fault in FAULTS:
        if fault.file not in files:
            sys.exit(f"{fault.name}: src/model/{fault.file} does not exist")
    return {file: planted(file, text) for file, text in files.items()}


def plant_all(tree: Path) -> None:
    for file, text in planted_headers().items():
        target = tree / "src/model" / file
        target.parent.mkdir(parents=True, exist_ok=True)
        write_if_other(target, text)
    write_if_other(tree / "src/model/planted_fault.hpp", HEADER)
    one_thread_each(tree)


def one_thread_each(tree: Path) -> None:
    """Threads that wait for each other are slow beside other programs."""
    path = tree / "src/app/scene_run.hpp"
    text = (SOURCE / "src/app/scene_run.hpp").read_text()
    write_if_other(path, text.replace("unsigned threads = 2", "unsigned threads = 1"))


def write_if_other(path: Path, text: str) -> None:
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def build(scratch: Path, jobs: int) -> Path:
    tree, folder = scratch / "tree", scratch / "build"
    copy_sources(tree)
    plant_all(tree)
    if not (folder / "CMakeCache.txt").exists():
        subprocess.run(["cmake", "-S", tree, "-B", folder, "-DPF_CUDA=OFF", "-DCMAKE_BUILD_TYPE=Release",
                        "-DCMAKE_CXX_FLAGS_RELEASE=-O1"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder, "--target", "fault_tests", f"-j{jobs}"], check=True)
    return folder / "tests/faults/fault_tests"


def first_failure(program: Path, number: int, tests: str, limit_s: int = QUICK_LIMIT_S) -> str:
    """The first of the tests that fails with a fault; empty if all pass."""
    environment = dict(os.environ, PF_PLANTED_FAULT=str(number))
    try:
        done = subprocess.run([program, "--gtest_fail_fast", "--gtest_filter=" + tests], env=environment,
                              capture_output=True, text=True, timeout=limit_s, errors="replace")
    except subprocess.TimeoutExpired as late:
        begun = re.findall(r"\[ RUN      \] (\S+)", (late.stdout or b"").decode(errors="replace"))
        return f"{begun[-1] if begun else '?'} (does not end)"
    if done.returncode == 0:
        return ""
    failed = re.findall(r"\[  FAILED  \] ([^\s,]+)", done.stdout)
    if failed:
        return failed[0]
    begun = re.findall(r"\[ RUN      \] (\S+)", done.stdout)
    return f"{begun[-1] if begun else '?'} (crashes)"


def judge(program: Path, number: int) -> tuple:
    physics = (first_failure(program, number, f"*-{GOLDEN}:{SLOW}:{NEVER}") or
               first_failure(program, number, f"{SLOW}:-{NEVER}", SLOW_LIMIT_S))
    return physics, first_failure(program, number, GOLDEN)


def write_table(path: Path, rows: list) -> None:
    lines = ["# Tests that detect each planted fault", "",
             "Written by `plant_faults.py SCRATCH_FOLDER --table killed.md`: the first test that fails with the fault "
             "planted, apart from the golden hashes, and whether these detect it too.", "",
             "| fault | in | effect | first test that fails | golden hashes |",
             "| --- | --- | --- | --- | --- |"]
    for fault, physics, golden in rows:
        lines.append(f"| {fault.name} | {fault.file} | {fault.what} | {physics or '**none**'} | "
                     f"{'yes' if golden else 'no'} |")
    survivors = [fault.name for fault, physics, _ in rows if not physics]
    lines += ["", f"{len(rows)} faults; detected by a test of physics: {len(rows) - len(survivors)}; by the golden "
              f"hashes: {sum(1 for row in rows if row[2])}. The hashes cover states and events, not values that are "
              "only drawn, tallied or expected of a run, nor situations that are too rare in their scenes.", "",
              "## Changes that are not faults", "", "They are not planted, since no result of a run depends on them:",
              ""]
    lines += [f"- {file}: {change}: {why}." for file, change, why in EQUIVALENT]
    path.write_text("\n".join(lines) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scratch", type=Path, nargs="?",
                        help="folder for the copy and its build; kept for the next time")
    parser.add_argument("--check", action="store_true", help="only verify the texts of the faults")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="faults to plant; without it all")
    parser.add_argument("--table", type=Path, help="file for the table")
    parser.add_argument("--jobs", type=int, default=2, help="of the build")
    arguments = parser.parse_args()
    if arguments.check:
        planted_headers()
        return
    if arguments.scratch is None:
        parser.error("SCRATCH_FOLDER is missing")
    program = build(arguments.scratch.resolve(), arguments.jobs)
    without = judge(program, 0)
    if without != ("", ""):
        sys.exit(f"fails without a fault: {without}")
    rows = []
    for number, fault in enumerate(FAULTS, 1):
        if arguments.only and fault.name not in arguments.only:
            continue
        rows.append((fault, *judge(program, number)))
        _, physics, golden = rows[-1]
        print(f"{fault.name}: {physics or 'SURVIVES'}; golden hashes: {golden or 'do not detect it'}", flush=True)
    if arguments.table:
        write_table(arguments.table, rows)
    sys.exit(any(not physics for _, physics, _ in rows))


if __name__ == "__main__":
    main()
