#!/usr/bin/python3
"""Checks the order of the source folders, the size of files and functions, and the twins of method exact.

test_rooms.py CASE   exit code 0: passed, 1: failed

Each case checks the tree, and then a broken copy of it, in which it must report the planted fault.
"""

import pathlib
import re
import shutil
import statistics
import sys
import tempfile

from cpp_functions import functions

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCES = {".hpp", ".cpp", ".cuh", ".cu"}

# The folders that the files of a folder may include, besides those of their own.
MAY_INCLUDE = {
    "core": set(),
    "model": {"core"},
    "model/exact": {"core", "model"},
    "scene": {"core", "model"},
    "backend": {"core", "model", "model/exact", "backend/exact", "backend/time_step"},
    "backend/time_step": {"core", "model", "backend"},
    "backend/domains": {"core", "model", "backend", "backend/time_step"},
    "backend/exact": {"core", "model", "model/exact", "backend"},
    "mpi": {"core", "backend/domains"},
    "app": {"core", "model", "scene", "backend"},
    "data": {"core", "model", "scene", "backend", "app"},
    "lab": {"core", "model", "scene", "backend", "backend/domains", "app"},
    "view": {"core", "model", "scene", "backend", "app", "data"},
    "cuda": {"core", "model", "model/exact", "backend", "backend/exact", "cuda/time_step", "cuda/exact"},
    "cuda/time_step": {"core", "model", "backend", "cuda"},
    "cuda/domains": {"core", "model", "backend", "backend/domains", "backend/time_step", "cuda", "cuda/time_step"},
    "cuda/exact": {"core", "model", "model/exact", "backend", "backend/exact", "cuda", "cuda/time_step"},
    "cuda/gl": {"core", "backend", "cuda", "view"},
    ".": {"core", "scene", "backend", "app", "data", "lab", "view", "cuda", "cuda/gl", "cuda/domains", "backend/domains",
          "mpi"},
}

MAX_FILE_LINES = 350
MAX_FUNCTION_LINES = 60
MAX_MEDIAN_FUNCTION_LINES = 8
MAX_PARAMETERS = 6

# The parts of method exact: the name of its files in src/backend/exact, that in cuda/exact, and what both must contain.
# CONTEXT is the struct that a stage gets: there a window, here a step with its window.
CPU_SIDE, GPU_SIDE = "src/backend/exact", "cuda/exact"
CONTEXT = {CPU_SIDE: "WindowContext", GPU_SIDE: "StepContext"}
TWINS = [
    ("window", "step_state", ["TrajectorySegment", "Member", "Cluster", "ClusterTally"]),
    ("window", "step_context", ["start_trajectory", "owner_of", "is_near_ball", "CONTEXT"]),
    ("predict", "predict", ["predict", "collision_tick", "CONTEXT"]),
    ("refresh", "refresh", ["refresh", "CONTEXT"]),
    ("clusters", "clusters", ["form_clusters", "union_sets", "CONTEXT"]),
    ("solve", "solve", ["solve", "CONTEXT"]),
    ("cluster_members", "solve_block_members", ["Member", "CONTEXT"]),
    ("reconcile", "reconcile", ["find_conflicts", "merge", "CONTEXT"]),
    ("commit", "commit", ["commit", "CONTEXT"]),
    ("positions_at", "positions", ["position_at"]),
    ("timeline", "timeline", ["ExactTimeline"]),
]


def source_files(root, *folders):
    for folder in folders:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in SOURCES:
                yield file


def room_of(file, root):
    """The folder of a file as include directives name it."""
    folder = file.parent.relative_to(root).as_posix()
    return folder.removeprefix("src/") if folder != "src" else "."


def include_errors(root):
    errors = []
    for file in source_files(root, "src", "cuda"):
        room = room_of(file, root)
        if room not in MAY_INCLUDE:
            errors.append(f"{file.relative_to(root)}: the folder is missing in MAY_INCLUDE")
            continue
        for line, text in enumerate(file.read_text().splitlines(), 1):
            match = re.match(r'\s*#\s*include\s*"([^"]+)"', text)
            if not match:
                continue
            included = pathlib.PurePosixPath(match.group(1)).parent.as_posix()
            if included != room and included not in MAY_INCLUDE[room]:
                errors.append(f"{file.relative_to(root)}:{line}: {room} may not include {match.group(1)}")
    return errors


def shape_errors(root):
    errors, lengths = [], []
    for file in source_files(root, "src", "cuda", "tests"):
        name, text = file.relative_to(root), file.read_text()
        num_lines = text.count("\n")
        if num_lines > MAX_FILE_LINES:
            errors.append(f"{name}: {num_lines} lines, at most {MAX_FILE_LINES}")
        for function in functions(text):
            place = f"{name}:{function.line}: {function.name}"
            if function.num_lines > MAX_FUNCTION_LINES:
                errors.append(f"{place} has {function.num_lines} lines, at most {MAX_FUNCTION_LINES}")
            if function.num_parameters > MAX_PARAMETERS:
                errors.append(f"{place} has {function.num_parameters} parameters, at most {MAX_PARAMETERS}")
            if name.parts[0] != "tests":
                lengths.append(function.num_lines)
    median = statistics.median(lengths)
    if median > MAX_MEDIAN_FUNCTION_LINES:
        errors.append(f"the median function has {median} lines, at most {MAX_MEDIAN_FUNCTION_LINES}")
    return errors


def files_of_stage(root, side, stage):
    return [file for file in source_files(root, side) if file.stem == stage]


def twin_errors(root):
    errors = []
    for *stages, names in TWINS:
        for side, stage in zip((CPU_SIDE, GPU_SIDE), stages):
            files = files_of_stage(root, side, stage)
            if not files:
                errors.append(f"{side}/{stage}.*: missing")
            text = "\n".join(file.read_text() for file in files)
            expected = [CONTEXT[side] if name == "CONTEXT" else name for name in names]
            errors += [f"{side}/{stage}.*: {name} is missing" for name in expected
                       if files and not re.search(rf"\b{name}\b", text)]
    stems = [{file.stem for file in source_files(root, side)} for side in (CPU_SIDE, GPU_SIDE)]
    known = {cpu for cpu, gpu, _ in TWINS if cpu == gpu}
    errors += [f"{stem}.*: on both sides, but missing in TWINS" for stem in sorted(stems[0] & stems[1] - known)]
    return errors


def prepend(file, text):
    file.write_text(text + file.read_text())


def add_long_function(root):
    body = "".join(f"  n += {k};\n" for k in range(MAX_FUNCTION_LINES))
    prepend(root / "src/core/thread_team.cpp", f"void planted(int& n) {{\n{body}}}\n")


# Faults by case: a change of a copy of the tree, and a part of the error that it must cause.
FAULTS = {
    "includes": [
        (lambda root: prepend(root / "src/core/text.hpp", '#include "model/world.hpp"\n'),
         "src/core/text.hpp:1: core may not include model/world.hpp"),
        (lambda root: prepend(root / "src/scene/derive.cpp", '#include "backend/backend.hpp"\n'),
         "scene may not include backend/backend.hpp"),
        (lambda root: prepend(root / "src/view/gui.cpp", '#include "lab/lab.hpp"\n'), "view may not include lab/lab.hpp"),
        (lambda root: prepend(root / "cuda/requests.cpp", '#include "view/gl.hpp"\n'), "cuda may not include view/gl.hpp"),
    ],
    "shape": [
        (add_long_function, "planted has 62 lines, at most 60"),
        (lambda root: prepend(root / "src/core/text.hpp", "inline void planted(int, int, int, int, int, int a = {0}, X<1, 2> b) {}\n"),
         "planted has 7 parameters, at most 6"),
        (lambda root: prepend(root / "cuda/check.cuh", "\n" * MAX_FILE_LINES), "cuda/check.cuh: "),
        (lambda root: prepend(root / "src/core/text.hpp", "inline int planted() {\n\n\n\n\n\n\n\n}\n" * 3000),
         "the median function has 9"),
    ],
    "twins": [
        (lambda root: [file.unlink() for file in files_of_stage(root, GPU_SIDE, "commit")], "cuda/exact/commit.*: missing"),
        (lambda root: [file.write_text(re.sub(r"\bMember\b", "Person", file.read_text()))
                       for file in files_of_stage(root, CPU_SIDE, "window")],
         "src/backend/exact/window.*: Member is missing"),
        (lambda root: [file.write_text(re.sub(r"\bStepContext\b", "Context", file.read_text()))
                       for file in files_of_stage(root, GPU_SIDE, "reconcile")],
         "cuda/exact/reconcile.*: StepContext is missing"),
        (lambda root: [(root / side / "planted.hpp").write_text("\n") for side in (CPU_SIDE, GPU_SIDE)],
         "planted.*: on both sides, but missing in TWINS"),
    ],
}
CHECKS = {"includes": include_errors, "shape": shape_errors, "twins": twin_errors}


# Definitions in all their forms, with the expected name, lines and parameters.
SAMPLE = """
namespace a { struct B { int x{}; B(int p, int q) noexcept : x{p}, y(q) {} int y = 0; };
template <class T, int kN = (2 > 1)>
__global__ void __launch_bounds__(256, 2) c_kernel(T a, std::array<int, 3> b,
                                                   int d = f(1, 2)) {
  const auto inner = [](int e, int g) { return e + g; };
}
bool operator()(int a) const { return "}" == '{'; }
constexpr int kTable[2] = {1, 2};
auto d(std::vector<int> v = {}) -> int requires true { return 0; }
enum class E { one, two };  // void no() {}
}
"""
IN_SAMPLE = [("B", 1, 2), ("c_kernel", 5, 3), ("operator_call", 1, 1), ("d", 1, 1)]


def scanner_errors():
    found = [(f.name, f.num_lines, f.num_parameters) for f in functions(SAMPLE)]
    return [] if found == IN_SAMPLE else [f"functions of the sample: {found}, expected {IN_SAMPLE}"]


def missed_faults(case):
    """Planted faults that the check does not report."""
    missed = []
    for plant, expected in FAULTS[case]:
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder)
            for part in ("src", "cuda", "tests"):
                shutil.copytree(ROOT / part, copy / part, ignore=lambda _, names: [n for n in names if n.endswith(".png")])
            plant(copy)
            errors = CHECKS[case](copy)
            if not any(expected in error for error in errors):
                missed.append(f"a planted fault was not reported: {expected}")
    return missed


def main():
    case = sys.argv[1]
    errors = CHECKS[case](ROOT) + missed_faults(case) + scanner_errors()
    for error in errors:
        print(error)
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
