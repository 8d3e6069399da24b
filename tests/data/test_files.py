#!/usr/bin/python3
"""Dumps and checkpoints of the program, opened with the readers that people have, and after the program was killed.

test_files.py PROGRAM CASE...   exit code 0: passed, 1: failed, 77: skipped, since a reader is missing
"""
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from xml.etree import ElementTree

SKIPPED = 77
LIMIT_S = 60
ENVIRONMENT = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"}
SMALL = ("--size", "64x48", "--overlay", "off")
SYSTEM_PYTHON = "/usr/bin/python3"


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def skip(reason):
    print(f"SKIPPED: {reason}")
    sys.exit(SKIPPED)


def reader(name, package):
    """The module; the system's Python may have it where this one does not."""
    try:
        return __import__(name)
    except ImportError:
        if os.path.exists(SYSTEM_PYTHON) and "PF_SECOND_PYTHON" not in os.environ:
            os.execve(SYSTEM_PYTHON, [SYSTEM_PYTHON, "-B", *sys.argv], {**os.environ, "PF_SECOND_PYTHON": "1"})
        skip(f"no {name} here ({package})")


class Bench:
    def __init__(self, program, folder):
        self.program, self.folder = os.path.abspath(program), pathlib.Path(folder)
        if "HDF5: no" in self.run("--version", report=False).stdout:
            skip("this build has no HDF5 (libhdf5-dev)")

    def words(self, *words, report=True):
        return [self.program, *words, *(("--report", "report.json") if report else ())]

    def run(self, *words, exit_code=0, report=True):
        done = subprocess.run(self.words(*words, report=report), cwd=self.folder, env=ENVIRONMENT, capture_output=True,
                              text=True, timeout=LIMIT_S)
        if "no OpenGL 4.5" in done.stderr:
            skip("no OpenGL 4.5 here")
        if done.returncode != exit_code:
            print(done.stderr)
        check(done.returncode == exit_code, f"{' '.join(words)}: exit code {done.returncode}")
        return done

    def fly(self, *words):
        """Runs headless and returns the report."""
        self.messages = self.run("--headless", *SMALL, *words).stderr
        return json.loads((self.folder / "report.json").read_text())

    def start(self, *words):
        return subprocess.Popen(self.words("--headless", *SMALL, *words), cwd=self.folder, env=ENVIRONMENT,
                                stderr=subprocess.DEVNULL)

    def refused(self, part, *words):
        done = self.run("--headless", *words, exit_code=2, report=False)
        lines = done.stderr.splitlines()
        check(len(lines) == 1 and part in lines[0], f"   {lines[-1] if lines else ''}")

    def path(self, name):
        return str(self.folder / name)


SCENE = ("--scene", "court", "-p", "300", "--seconds", "0.4", "--set", "world.boundary=periodic")
# Some parcels leave, the ball does not.
OPEN_SCENE = ("--scene", "court", "-p", "300", "--ball-vx", "5", "--seconds", "1", "--time-scale", "1")


def frames_of(text):
    """Frames of an extended XYZ: {id: numbers}."""
    lines, frames = text.splitlines(), []
    while lines:
        count = int(lines[0])
        frames.append({int(words[0]): [float(word) for word in words[1:]]
                       for words in (line.split() for line in lines[2:2 + count])})
        lines = lines[2 + count:]
    return frames


def mix64(numpy, x):
    """As core/random.hpp has it."""
    with numpy.errstate(over="ignore"):
        x = x.astype(numpy.uint64) + numpy.uint64(0x9E3779B97F4A7C15)
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            x = (x ^ (x >> numpy.uint64(shift))) * numpy.uint64(factor)
    return x ^ (x >> numpy.uint64(31))


def hash_of_frame(numpy, file, k):
    """The state hash (model/measures.hpp) from what the frame has."""
    parcels = file["particles/parcels"]
    join = lambda pair: (pair[:, 0].astype(numpy.uint64) << numpy.uint64(32)) | pair[:, 1].astype(numpy.uint64)
    h = mix64(numpy, numpy.arange(parcels["id"].shape[0]))
    h = mix64(numpy, h ^ join(parcels["position_units/value"][k].view(numpy.uint32)))
    velocity = numpy.ascontiguousarray(parcels["velocity/value"][k][:, :2])
    h = mix64(numpy, h ^ join(velocity.view(numpy.uint32)))
    ball = file["observables"]
    b = numpy.array([0x62616C6C], dtype=numpy.uint64)
    for number in (*ball["ball_position/value"][k], *ball["ball_velocity/value"][k], ball["ball_spin/value"][k]):
        b = mix64(numpy, b ^ numpy.array([number], dtype=numpy.float64).view(numpy.uint64))
    return int(h.sum(dtype=numpy.uint64) + b[0])


def check_frames(numpy, file, name):
    """Each complete frame has the hash that the program gave it. Returns their number."""
    num = file["particles/parcels/position/value"].shape[0]
    wrong = [k for k in range(num) if hash_of_frame(numpy, file, k) != int(file["observables/state_hash/value"][k])]
    check(not wrong, f"{name}: {num} frames with the hashes of their states{f', but not {wrong}' if wrong else ''}")
    return num


def h5py(bench):
    """Structure, positions, velocities, ids, box, ball, hashes, parameters."""
    h5, numpy = reader("h5py", "python3-h5py"), reader("numpy", "python3-numpy")
    report = bench.fly(*OPEN_SCENE, "--dump", "a.h5", "--dump-every", "0.1", "--dump-compression", "4")
    bench.fly(*OPEN_SCENE, "--dump", "a.xyz", "--dump-every", "0.1")
    texts = frames_of((bench.folder / "a.xyz").read_text())
    with h5.File(bench.path("a.h5"), "r") as file:
        parcels = file["particles/parcels"]
        position, velocity = parcels["position/value"][:], parcels["velocity/value"][:]
        num = check_frames(numpy, file, "a.h5")
        check_xdmf(bench.folder / "a.xdmf", file)
        check(num == len(texts) == report["files"]["dump"]["written"] == 11, f"{num} frames, one each 0.1 s")
        check(f"{int(file['observables/state_hash/value'][-1]):016x}" == report["state_hash"], "the last is the run's end")
        check(list(file["h5md"].attrs["version"]) == [1, 1] and parcels["box"].attrs["dimension"] == 3, "H5MD 1.1, 3 dimensions")
        check(parcels["box/edges/step"] == parcels["position/step"] == parcels["velocity/step"]
              and parcels["box/edges/time"] == file["observables/ball_position/time"], "step and time are hard links")
        step, time_s = parcels["position/step"][:], parcels["position/time"][:]
        check((numpy.diff(step) > 0).all() and (numpy.diff(time_s) > 0).all() and step[-1] == report["steps"], "they grow")
        check(list(parcels["id"][:]) == list(range(300)), "ids in order")
        check(numpy.allclose(parcels["box/edges/value"][0].diagonal()[:2], (13.4, 6.1)), "edges")
        gone = 0
        for k, text in enumerate(texts):
            here = parcels["present/value"][k] == 1
            check(set(numpy.flatnonzero(here)) == set(text), f"frame {k}: {len(text)} parcels are there")
            numbers = numpy.array([text[i] for i in sorted(text)])
            check(numpy.array_equal(position[k][here], numbers[:, :3].astype("f4")), "   positions as in the .xyz")
            check(numpy.array_equal(velocity[k][here], numbers[:, 3:6].astype("f4")), "   velocities")
            check(numpy.isnan(position[k][~here]).all(), "   the others have the fill value")
            gone = len(here) - len(text)
        check(gone > 0 and gone == report["num_retired"], f"{gone} parcels have left")
        energy_j = [0.5 * file["parameters/parcel_mass_kg"][()] * (v[here == 1].astype("f8") ** 2).sum()
                    for v, here in zip(velocity, parcels["present/value"][:])]
        check(numpy.allclose(energy_j, file["observables/kinetic_energy/value"][:], rtol=1e-12), "energy of those that are there")
        check(numpy.isnan(parcels["position/value"].fillvalue), "the fill value is NaN")
        parameters = file["parameters"]
        check(b"[ball]" in parameters["scene"][()] and b"run.seed = 1" in parameters["settings"][()], "whole scene file")
        check(parameters["seed"][()] == 1 and parameters["version"][()].decode() == report["version"], "seed and version")
        check(parameters["units/length"][()] == b"m", "units")
        check(numpy.allclose(file["observables/ball_position/value"][-1], (report["ball"]["x_m"], report["ball"]["y_m"])),
              "the ball")


def check_xdmf(name, file):
    """Every frame is there with its time, and what it names is in the dump."""
    grids = ElementTree.parse(name).getroot().findall("./Domain/Grid/Grid")
    times = [float(grid.find("Time").get("Value")) for grid in grids]
    check(times == list(file["particles/parcels/position/time"][:]), f"{name.name}: {len(grids)} frames with their times")
    for k, grid in enumerate(grids):
        for item in grid.iter("DataItem"):
            if item.get("Format") == "HDF":
                h5_name, path = item.text.split(":")
                extent = [int(number) for number in item.get("Dimensions").split()]
                assert h5_name == "a.h5" and extent == [k + 1, *file[path].shape[1:]], (k, item.text, extent)


def pyh5md(bench):
    module, numpy = reader("pyh5md", "PyPI, pip install pyh5md"), reader("numpy", "python3-numpy")
    bench.fly(*SCENE, "--dump", "a.h5")
    with module.File(bench.path("a.h5"), "r") as file:
        parcels = file.particles_group("parcels")
        position, velocity = module.element(parcels, "position"), module.element(parcels, "velocity")
        edges = module.element(parcels["box"], "edges")
        check(position.value.shape[1:] == (300, 3) and position.value.shape[0] == len(position.step) > 3, "positions, steps")
        check(velocity.value.shape == position.value.shape, "velocities")
        check(numpy.allclose(edges.value[0].diagonal()[:2], (13.4, 6.1)) and len(edges.time) == len(position.time), "edges")


def mdanalysis(bench):
    h5, module, numpy = reader("h5py", "python3-h5py"), reader("MDAnalysis", "python3-mdanalysis"), reader("numpy", "python3-numpy")
    bench.fly(*SCENE, "--dump", "a.h5")
    universe = module.Universe.empty(300, trajectory=False)
    universe.load_new(bench.path("a.h5"), format="H5MD", convert_units=False)
    with h5.File(bench.path("a.h5"), "r") as file:
        parcels = file["particles/parcels"]
        check(universe.trajectory.n_frames == parcels["position/value"].shape[0] > 3, f"{universe.trajectory.n_frames} frames")
        for k, frame in enumerate(universe.trajectory):
            same = (numpy.array_equal(frame.positions, parcels["position/value"][k], equal_nan=True)
                    and numpy.array_equal(frame.velocities, parcels["velocity/value"][k])
                    and numpy.allclose(frame.dimensions[:2], (13.4, 6.1)) and frame.time == parcels["position/time"][k])
            check(same, f"frame {k}: positions, velocities, box, time")


def xdmf(bench):
    """VTK's reader of XDMF, as ParaView uses it."""
    h5, numpy = reader("h5py", "python3-h5py"), reader("numpy", "python3-numpy")
    reader("vtkmodules.vtkIOXdmf2", "PyPI, pip install vtk; Debian's python3-vtk9 lacks it")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader
    bench.fly(*SCENE, "--dump", "a.h5")
    source = vtkXdmfReader()
    source.SetFileName(bench.path("a.xdmf"))
    source.UpdateInformation()
    times = source.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    with h5.File(bench.path("a.h5"), "r") as file:
        parcels = file["particles/parcels"]
        check(list(times) == list(parcels["position/time"][:]), f"{len(times)} times")
        for k in (0, len(times) - 1):
            source.UpdateTimeStep(times[k])
            data = source.GetOutputDataObject(0)
            points = vtk_to_numpy(data.GetPoints().GetData())
            velocity = vtk_to_numpy(data.GetPointData().GetArray("velocity"))
            check(numpy.array_equal(points, parcels["position/value"][k], equal_nan=True), f"frame {k}: positions")
            check(numpy.array_equal(velocity, parcels["velocity/value"][k]), "   velocities")


def killed(bench):
    """kill -9 at random moments: the dump opens, with all frames up to the last complete one."""
    h5, numpy = reader("h5py", "python3-h5py"), reader("numpy", "python3-numpy")
    moments, most = random.Random(3), 0
    for k in range(10):
        for name in ("k.h5", "k.xdmf"):
            (bench.folder / name).unlink(missing_ok=True)
        compression = ("--dump-compression", "1") if k % 3 == 2 else ()
        process = bench.start("-p", "400", "--method", ("impulse", "exact")[k % 2], "--seconds", "600", "--dump", "k.h5",
                              *compression)
        wait_until("dump", lambda: is_begun(bench.folder / "k.h5"))
        time.sleep(moments.uniform(0.0, 0.5))
        if k == 9:  # is gone on from below
            wait_until("frames", lambda: (bench.folder / "k.xdmf").read_text().count("<Time ") > 2)
        process.send_signal(signal.SIGKILL)
        process.wait()
        with h5.File(bench.path("k.h5"), "r") as file:
            most = max(most, check_frames(numpy, file, f"killed, {k}"))
        if shutil.which("h5ls"):
            done = subprocess.run(["h5ls", "-r", bench.path("k.h5")], capture_output=True, text=True)
            check(done.returncode == 0 and "/particles/parcels/position/value" in done.stdout,
                  f"   h5ls opens it{done.stderr and ': ' + done.stderr[-500:]}")
        if (bench.folder / "k.xdmf").exists():
            check((bench.folder / "k.xdmf").read_text().endswith("</Xdmf>\n"), "   the XDMF file is whole")
    check(most > 2, f"up to {most} frames were written")
    last = bench.fly("--from", "k.h5", "--seconds", "0.01")
    check(last["steps"] > 0, "a killed dump is gone on from")


def wait_until(what, holds):
    end = time.monotonic() + LIMIT_S
    while not holds():
        if time.monotonic() > end:
            raise AssertionError(f"no {what} after {LIMIT_S} s")
        time.sleep(0.005)


def is_begun(file):
    """The program tries first whether it can write: then the file is empty for a moment."""
    try:
        return file.stat().st_size > 0
    except FileNotFoundError:
        return False


def goes_on(bench):
    """--from a checkpoint, and a frame of a dump: the report has the same hashes as that of the whole run."""
    for method in ("impulse", "spring", "exact"):
        words = ("--scene", "court", "-p", "300", "--method", method, "--set", "air.restitution=0.7", "--set",
                 "world.boundary=walls", "--time-scale", "0.5")
        whole = bench.fly(*words, "--seconds", "0.6", "--dump", "w.h5")
        half = bench.fly(*words, "--seconds", "0.3", "--checkpoint", "c.state", "--threads", "1")
        check(half["state_hash"] != whole["state_hash"], f"{method}: half the run has another state")
        for source in (("c.state",), ("w.h5", "--from-frame", "11")):
            ended = bench.fly("--from", *source, "--seconds", "0.6")
            for key in ("state_hash", "steps", "num_retired"):
                check(ended[key] == whole[key], f"   {source[0]}: {key} {ended[key]}")
            for part, key in (("collisions", "count"), ("ball", "distance_m"), ("energy", "initial_j")):
                check(ended[part][key] == whole[part][key], f"   {part}.{key} {ended[part][key]}")
            if method == "exact":
                check(ended["exact"]["event_hash"] == whole["exact"]["event_hash"], "   and the same events")


def checkpoint_killed(bench):
    """kill -9 while checkpoints are written: there is always a whole one, never older than one that was there."""
    words = ("-p", "3000", "--method", "impulse", "--seconds", "600", "--checkpoint", "c.state", "--checkpoint-every", "1e-4")
    moments, before_s = random.Random(5), -1.0
    for k in range(6):
        source = ("--from", "c.state") if k else ()
        process = bench.start(*(source + words[4:] if k else words))
        wait_until("checkpoint", lambda: is_begun(bench.folder / "c.state"))
        time.sleep(0.3 + moments.uniform(0.0, 0.3))
        process.send_signal(signal.SIGKILL)
        process.wait()
        report = bench.fly("--from", "c.state", "--seconds", "0.001")
        check(report["simulated_s"] >= before_s, f"killed, {k}: a whole checkpoint of {report['simulated_s']:.5f} s")
        before_s = report["simulated_s"]
    check(before_s > 0.0, "the run has gone on from kill to kill")


def log_replays(bench):
    """The log of a run that goes on from a checkpoint replays from there."""
    bench.fly("-p", "300", "--seconds", "0.2", "--checkpoint", "c.state")
    ended = bench.fly("--from", "c.state", "--seconds", "0.5", "--log", "l.toml")
    again = bench.run("run", "l.toml", "--headless", *SMALL)
    check("the same flight" in again.stderr, again.stderr.splitlines()[-1])
    replayed = json.loads((bench.folder / "report.json").read_text())
    check(replayed["state_hash"] == ended["state_hash"], "to the same state")
    bench.fly("-p", "300", "--seconds", "0.3", "--checkpoint", "c.state")
    other = bench.run("run", "l.toml", "--headless", *SMALL, exit_code=2)
    check("it was replaced since" in other.stderr, other.stderr)


def refusals(bench):
    bench.fly("-p", "100", "--seconds", "0.1", "--checkpoint", "c.state", "--dump", "p.h5", "--dump-fields", "position,velocity")
    bench.refused("--dump: 'a.txt' has the wrong ending; the file must end in .h5 or .xyz", "--dump", "a.txt")
    bench.refused("--dump-every: needs --dump", "--dump-every", "1")
    bench.refused("--dump-every: '0' is not a time", "--dump", "a.h5", "--dump-every", "0")
    bench.refused("--dump-fields: 'speed' is unknown; one of", "--dump", "a.h5", "--dump-fields", "position,speed")
    bench.refused("--dump-fields: position is missing", "--dump", "a.h5", "--dump-fields", "velocity")
    bench.refused("a .xyz has position and velocity as text", "--dump", "a.xyz", "--dump-compression", "1")
    bench.refused("--dump-compression: '10' cannot be used", "--dump", "a.h5", "--dump-compression", "10")
    bench.refused("--checkpoint-every: needs --checkpoint", "--checkpoint-every", "1")
    bench.refused("the last frame before a --still may be shorter", "--still", "0.01", "s.png", "--checkpoint", "s.state")
    bench.refused("--from: the file has its own scene and settings; leave out -p", "--from", "c.state", "-p", "200")
    bench.refused("leave out --scene", "--from", "c.state", "--scene", "gas")
    bench.refused("--from-frame: needs --from", "--from-frame", "1")
    bench.refused("--from-frame: 'c.state' is not a dump", "--from", "c.state", "--from-frame", "1")
    bench.refused("--from: 'none.state': does not exist", "--from", "none.state")
    bench.refused("was dumped without the field state", "--from", "p.h5")
    # A run that is over, or is to end before its start, leaves the files of the one before as they are.
    old_text = "# Inputs of a flight. Replay it with: pickleflight run THIS_FILE\n"
    olds = [bench.folder / name for name in ("o.xyz", "o.csv", "o.mp4", "o.toml", "o.png")]
    for old in olds:
        old.write_text(old_text)
    outputs = ("--dump", "o.xyz", "--overlay-csv", "o.csv", "--record", "o.mp4", "--log", "o.toml")
    bench.refused("the run has lasted its 0.1 s already", "--from", "c.state", "--picture", "o.png", *outputs)
    bench.refused("--still: the run starts at", "--from", "c.state", "--still", "0.001", "s.png", *outputs)
    bench.fly("-p", "100", "--set", "run.time_scale=1", "--checkpoint", "e.state")
    bench.refused("the run has ended with its flight", "--from", "e.state", "--picture", "o.png", *outputs)
    check(all(old.read_text() == old_text for old in olds), "older files are whole")
    bench.fly("-p", "100", "--seconds", "0.1", "--dump", "q.h5", "--dump-fields", "position,state")
    bench.fly("--from", "q.h5", "--seconds", "0.2")
    bench.refused("is the file of --from as well", "--from", "p.h5", "--dump", "p.h5")
    data = bytearray((bench.folder / "c.state").read_bytes())
    data[-100] ^= 4
    (bench.folder / "d.state").write_bytes(data)
    bench.refused("its checksum is not that of its content", "--from", "d.state")
    (bench.folder / "d.state").write_bytes(data[:-1000])
    bench.refused("is cut off:", "--from", "d.state")


CASES = {case.__name__: case for case in (h5py, pyh5md, mdanalysis, xdmf, killed, goes_on, checkpoint_killed, log_replays,
                                          refusals)}


def main():
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[2:]:
            CASES[name](Bench(sys.argv[1], folder))


if __name__ == "__main__":
    main()
