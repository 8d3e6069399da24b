#!/usr/bin/python3
"""The program as several processes, started by mpirun.

test_ranks.py PROGRAM CASE   exit code 0: passed, 1: failed, 77: skipped, since there is no MPI
"""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

LIMIT_S = 300  # of a run: most take seconds, the study a minute on a busy machine
SKIPPED = 77
ENVIRONMENT = {
    **os.environ, "LIBGL_ALWAYS_SOFTWARE": "1",
    # Root, and more processes than cores: as Open MPI 4, then 5, asks for it.
    "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "PRTE_ALLOW_RUN_AS_ROOT": "1", "PRTE_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    # A container may forbid reading another process's memory.
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none", "OMPI_MCA_btl_sm_use_cma": "0",
}


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


class Bench:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)

    def words(self, num_ranks, *words):
        return [*(["mpirun", "-n", str(num_ranks)] if num_ranks else []), self.program, *words]

    def start(self, num_ranks, *words):
        return subprocess.Popen(self.words(num_ranks, *words), cwd=self.folder, env=ENVIRONMENT, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def run(self, num_ranks, *words, exit_code=0, environment=None):
        done = subprocess.run(self.words(num_ranks, *words), cwd=self.folder, env=environment or ENVIRONMENT, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=LIMIT_S, check=False)
        check(done.returncode == exit_code, f"{num_ranks} ranks: {' '.join(words)}: exit code {done.returncode}"
              + ("" if done.returncode == exit_code else ": " + done.stdout[-2000:]))
        return done.stdout

    def report(self, num_ranks, *words):
        self.run(num_ranks, *words, "--report", "report.json")
        return json.loads((self.folder / "report.json").read_text())


COURT = ("run", "--headless", "--size", "160x90", "--threads", "1", "-p", "4000", "--set", "air.area_fraction=0.2")


def same_bits(bench):
    """A flight by any number of processes and domains is that of one."""
    for settings in (("--set", "run.method=spring", "--set", "world.boundary=walls"), ("--set", "world.boundary=periodic"),
                     ("--set", "run.neighbors=all-pairs")):
        words = (*COURT, *settings, "--seconds", "0.2" if "all-pairs" in settings[-1] else "0.4")
        alone = bench.report(0, *words)
        check(alone["collisions"]["count"] > 100, f"{alone['collisions']['count']} collisions")
        for num_ranks, more in ((1, ()), (2, ()), (3, ("--domains", "6"))):
            report = bench.report(num_ranks, *words, *more)
            for key in ("state_hash", "ball", "num_retired", "steps"):
                check(report[key] == alone[key], f"the same {key}: {report[key]}")
            check(report["collisions"]["count"] == alone["collisions"]["count"], "as many collisions")
        check("6 domains, 3 processes" in report["device"], report["device"])


def lab(bench):
    """A study's points are shared out; the table is that of one process. Of that one only two points are measured
    again, which takes less time."""
    words = ("lab", "gas-dynamics", "--quick", "--out")
    bench.run(2, *words, "two")
    file = bench.folder / "two" / "gas-dynamics.json"
    two = json.loads(file.read_text())
    check(two["complete"] and two["machine"]["processes"] == 2, f"{len(two['points'])} points by 2 processes")
    again = ("cpu/drag/R / path 0.1/exact/2", "cpu/layer/impulse/0.25")
    shutil.copytree(bench.folder / "two", bench.folder / "one")
    kept = [row for row in two["points"] if row["key"] not in again]
    check(len(kept) == len(two["points"]) - len(again), "two points are left out")
    (bench.folder / "one" / "gas-dynamics.json").write_text(json.dumps({**two, "points": kept, "complete": False}))
    bench.run(0, *words, "one", "--resume")
    one = json.loads((bench.folder / "one" / "gas-dynamics.json").read_text())

    def without_times(value):
        if isinstance(value, dict):
            return {key: without_times(entry) for key, entry in value.items() if key not in ("ns_per_disc_time", "front")}
        return [without_times(entry) for entry in value] if isinstance(value, list) else value

    for key in ("points", "table", "layer"):
        check(without_times(one[key]) == without_times(two[key]), f"the same {key} but for times")


def picture_and_files(bench):
    """The first process draws and writes what one alone would."""
    words = (*COURT, "--seconds", "0.3", "--picture")
    bench.run(0, *words, "alone.png", "--checkpoint", "alone.state")
    bench.run(2, *words, "two.png", "--checkpoint", "two.state", "--domains", "4")
    bench.run(2, *words, "images.png", "--draw-target", "images")
    alone, *others = ((bench.folder / f"{name}.png").read_bytes() for name in ("alone", "two", "images"))
    check(all(other == alone for other in others), "the picture is the same, of parcels and of their counts")
    goes_on = [bench.report(*how, *COURT[:6], "--seconds", "0.5", "--from", name)["state_hash"]
               for how, name in (((0,), "alone.state"), ((0,), "two.state"), ((2,), "alone.state"))]
    check(len(set(goes_on)) == 1, f"either checkpoint goes on to the same state, by one process or two: {goes_on}")


def refusals(bench):
    def refused(parts, num_ranks, *words):
        text = bench.run(num_ranks, *words, exit_code=2)
        lines = [line for line in text.splitlines() if line.startswith("pickleflight: ")]
        check(len(lines) == 1, f"   {lines}")
        for part in parts:
            check(part in lines[0], f"   names {part!r}")

    refused(("run.method: exact", "impulse or spring"), 2, *COURT, "--method", "exact")
    refused(("--domain-link", "domains on GPUs"), 0, *COURT, "--domains", "2", "--domain-link", "direct")
    refused(("images needs several domains",), 0, *COURT, "--draw-target", "images")
    refused(("not a multiple of the 2", "give 2"), 2, *COURT, "--domains", "3")
    refused(("64 slabs", "give at most"), 0, *COURT, "--domains", "64")
    refused(("1 to 64",), 0, *COURT, "--domains", "65")
    for num_ranks in (1, 2):  # the sweep's runs would join the launcher's processes
        refused(("leave out mpirun",), num_ranks, "bench", "--sweep")
    refused(("only exact is so accurate", "leave out --domains"), 0, *COURT, "--domains", "2", "--accuracy", "0.0001%")
    text = bench.run(2, *COURT, "--seconds", "0.02", "--accuracy", "20%")
    check("several domains can fly: impulse, spring" in text, "--accuracy says among which methods it chooses")
    refused(("is not a scene",), 2, "run", "--scene", "cour")

    hidden = {**ENVIRONMENT, "CUDA_VISIBLE_DEVICES": ""}
    for num_ranks in (0, 2):
        words = (num_ranks, *COURT, "--domains", "2", "--seconds", "0.02")
        text = bench.run(*words, "--cuda", environment=hidden)
        check(text.count("falling back to the CPU") == 1, "without a GPU domains fall back to processors, and say so once")
        text = bench.run(*words, "--cuda-no-fallback", exit_code=3, environment=hidden)
        check(text.count("pickleflight: --cuda-no-fallback: ") == 1, "or refuse, once")

    # By a shell: with two programs (':') Open MPI 5.0.7 crashes in a root without /sys.
    words = f"exec '{bench.program}' scenes ${{OMPI_COMM_WORLD_RANK#0}}"
    text = subprocess.run(["mpirun", "-n", "2", "sh", "-c", words], env=ENVIRONMENT, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=LIMIT_S, check=False)
    check(text.returncode == 2 and text.stdout.count("differ in version or arguments") == 1,
          f"different arguments are refused, by one of the processes: {text.returncode} {text.stdout[-500:]}")

    others = {**ENVIRONMENT, "PMI_SIZE": "2", "PMI_RANK": "0"}  # as another MPI's launcher says
    for name in ("OMPI_COMM_WORLD_SIZE",):
        others.pop(name, None)
    text = subprocess.run([bench.program, "scenes"], env=others, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          timeout=LIMIT_S, check=False)
    check(text.returncode == 2 and "use the launcher of the MPI" in text.stdout, "another MPI's launcher is refused")


def children(pid):
    """Processes of the program that a launcher started."""
    found = []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            status, name = (folder / "status").read_text(), (folder / "comm").read_text().strip()
        except OSError:  # it has ended
            continue
        if f"\nPPid:\t{pid}\n" in status and name == "pickleflight":
            found.append(int(folder.name))
    return sorted(found)


def fly(bench, number, *options):
    """A long flight by so many processes that has written its first checkpoint, run.state: launcher, processes."""
    launcher = bench.start(number, *COURT, "--seconds", "600", "--checkpoint", "run.state", "--checkpoint-every", "0.001",
                           *options)
    state = bench.folder / "run.state"
    deadline = time.time() + LIMIT_S
    while not state.exists() and launcher.poll() is None and time.time() < deadline:
        time.sleep(0.1)
    ranks = children(launcher.pid)
    if not state.exists() or len(ranks) != number:
        launcher.kill()
        check(False, f"no flight of {number} processes with a checkpoint, but {ranks}")
    return launcher, ranks


def killed(bench):
    """A process that dies ends all, and the last checkpoint stands."""
    launcher, ranks = fly(bench, 3)
    try:
        began = time.time()
        os.kill(ranks[-1], signal.SIGKILL)
        text, _ = launcher.communicate(timeout=30)
        check(time.time() - began < 10, f"all ended within {time.time() - began:.1f} s")
        check(launcher.returncode != 0 and "rank" in text.lower(), f"its rank is named: {text.strip()[-300:]}")
        gone = [pid for pid in ranks if pathlib.Path(f"/proc/{pid}/exe").exists()]
        check(not gone, f"no process stays: {gone}")
    finally:
        launcher.kill()
    report = bench.report(0, *COURT[:6], "--from", "run.state", "--set", "run.seconds=0.1")
    check(report["num_parcels"] == 4000, "the checkpoint is whole")


def stopped(bench):
    """SIGTERM to the first process ends a run in its own time, with its files. So does SIGHUP to all, as srun hands it on."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        launcher, ranks = fly(bench, 2, "--report", "report.json")
        first = [pid for pid in ranks
                 if b"\0OMPI_COMM_WORLD_RANK=0\0" in b"\0" + pathlib.Path(f"/proc/{pid}/environ").read_bytes()] or ranks[:1]
        others = [pid for pid in ranks if pid not in first] if number == signal.SIGHUP else []
        for pid in others + first[:1]:
            os.kill(pid, number)
        text, _ = launcher.communicate(timeout=30)
        check((bench.folder / "report.json").exists(), f"{number.name}: the report is there: {text[-500:]}")
        check(not children(launcher.pid), "no process stays")
        for name in ("report.json", "run.state"):
            (bench.folder / name).unlink()


CASES = {function.__name__: function for function in (same_bits, picture_and_files, lab, refusals, killed, stopped)}


def skip_without_mpi(program):
    has_mpi = "MPI: yes" in subprocess.run([program, "--version"], text=True, stdout=subprocess.PIPE, check=True).stdout
    if not has_mpi or shutil.which("mpirun") is None:
        print("SKIPPED: no mpirun, or a program without MPI")
        sys.exit(SKIPPED)


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    skip_without_mpi(program)
    with tempfile.TemporaryDirectory() as folder:
        CASES[sys.argv[2]](Bench(program, folder))


if __name__ == "__main__":
    main()
