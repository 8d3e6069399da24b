#!/usr/bin/python3
"""The documents: short enough, with a purpose, naming files that exist and showing commands that work.

test_documents.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: something that the case needs is missing
"""
import fnmatch
import importlib.util
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
README_WORDS = 800
README_HEADINGS = ["Two commands", "What is special", "Fly", "Three methods", "Error against cost", "How it compares",
                   "How it works", "Read on"]
ROOMS = ("src", "cuda", "tests", "docs", "scripts", "assets", "shaders", "third_party")
ENDINGS = ("hpp", "cpp", "cuh", "cu", "py", "md", "frag", "vert", "comp", "glsl", "cmake", "svg")
LIMIT_S = 60

# Named in texts, but made by a build or by the program.
MADE = {"tests/determinism_tests", "sweep.svg", "paths.svg"}
# Commands that a test cannot run, and why. Their scripts exist and can be started.
NOT_RUN = {"scripts/pictures": "needs a screen and minutes", "scripts/fresh-root": "needs root, the network and minutes"}


class Missing(Exception):
    """Something that a case needs is not on this machine."""


def check(holds, text):
    print(("ok: " if holds else "NOT: ") + text)
    assert holds, text


def check_none(faults, text):
    for fault in faults:
        print("NOT: " + fault)
    check(not faults, text)


class Project:
    def __init__(self, root, program):
        self.root, self.program = pathlib.Path(root), program
        self.known_good = set()  # commands that need not be run

    def files(self):
        """Paths of all files of the project, relative to its root."""
        if (self.root / ".git").exists() and shutil.which("git"):
            listed = subprocess.run(["git", "-C", self.root, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                                    capture_output=True, text=True, check=True).stdout.split("\0")
            return sorted(name for name in listed if name and (self.root / name).is_file())
        found = []
        for folder, folders, names in os.walk(self.root):
            folders[:] = [name for name in folders if name not in ("build", "out", ".git", "__pycache__")]
            found += [str((pathlib.Path(folder) / name).relative_to(self.root)) for name in names]
        return sorted(found)

    def text(self, name):
        return (self.root / name).read_text(encoding="utf-8")

    def documents(self):
        return ["README.md", "CONTRIBUTING.md"] + sorted(
            f"docs/{file.name}" for file in (self.root / "docs").glob("*.md"))

    def run(self, *words, cwd=None, limit_s=LIMIT_S):
        surroundings = {**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": "", "LIBGL_ALWAYS_SOFTWARE": "1", "XDG_CACHE_HOME": str(cwd or self.root)}
        return subprocess.run([str(word) for word in words], cwd=cwd, env=surroundings, capture_output=True, text=True,
                              errors="replace", timeout=limit_s)


# ---- length and purpose

def words(project):
    """The README is one page, in the order that a newcomer asks."""
    text = project.text("README.md")
    num = len(text.split())
    check(num <= README_WORDS, f"README.md has {num} words, at most {README_WORDS}")
    headings = re.findall(r"^## (.*)", text, re.MULTILINE)
    check(headings == README_HEADINGS, f"README.md has its sections in order: {headings}")


def purposes(project):
    """Below the title of each document a sentence says what it is for."""
    for name in project.documents():
        title, _, rest = project.text(name).partition("\n")
        paragraph = rest.strip().split("\n\n")[0].replace("\n", " ")
        is_sentence = re.match(r"[A-Z][^|]*\.", paragraph) and len(paragraph.split()) >= 6
        check(title.startswith("# ") and is_sentence, f"{name}: says what it is for: {paragraph[:60]!r}")


# ---- files that texts name

PATH = re.compile(r"(?<![\w./<$-])((?:%s)/[\w./*-]*|[\w./*-]+\.(?:%s))(?![\w/])" % ("|".join(ROOMS), "|".join(ENDINGS)))


def comments(name, text):
    """What a person reads in a source file: comments, and what Python calls docstrings."""
    if name.endswith((".hpp", ".cpp", ".cu", ".cuh", ".frag", ".vert", ".comp", ".glsl")):
        return "\n".join(re.findall(r"(?<![:\"'])//(.*)", text))
    docstrings = re.findall(r'^\s*"""(.*?)"""', text, re.DOTALL | re.MULTILINE) if name.endswith(".py") else []
    return "\n".join(docstrings + re.findall(r"(?:^|\s)#(?!!)(.*)", text))


def is_source(name):
    return name.startswith(ROOMS) and (name.endswith(ENDINGS) or name.endswith("CMakeLists.txt")) and not name.endswith(
        (".md", ".svg")) or name in ("check", "demo", "CMakeLists.txt") or name.startswith("scripts/")


def exists(path, files, folders):
    path = path.rstrip("./")
    if path in files or path in folders:
        return True
    if "*" in path:
        return any(fnmatch.fnmatch(file, path) or fnmatch.fnmatch(file, "*/" + path) for file in files)
    return any(file.endswith("/" + path) for file in files | folders)


def is_made(path, in_document):
    """By a build or by the program; FILE.cpp stands for any file, and what a script draws is no source."""
    return path in MADE or re.search(r"(^|/)[A-Z]+\.\w+$", path) or (path.endswith(".svg") and not in_document)


def headings_of(text):
    return re.findall(r"^#+ (.*)", text, re.MULTILINE)


def anchor(heading):
    return re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")


def faults_of_links(project, name):
    """Links and pictures of a document: files, and headings within them."""
    for target in re.findall(r"\]\(([^)\s]+)\)", project.text(name)):
        if "://" in target:
            continue
        path, _, part = target.partition("#")
        file = (project.root / name).parent / path if path else project.root / name
        if not file.exists():
            yield f"{name}: {target}: no such file"
        elif part and part not in [anchor(heading) for heading in headings_of(file.read_text(encoding="utf-8"))]:
            yield f"{name}: {target}: no such heading"


def files(project):
    """Every file, link and section that a document or a comment names is there."""
    all_files = set(project.files())
    folders = {str(parent) for file in all_files for parent in pathlib.PurePath(file).parents}
    sections = headings_of(project.text("docs/physics.md"))
    faults = []
    for name in sorted(all_files):
        is_document = name in project.documents()
        if not is_document and not is_source(name):
            continue
        whole = project.text(name)
        text = re.sub(r"\]\([^)]*\)|https?://\S+", "", whole) if is_document else comments(name, whole)
        faults += [f"{name}: names {path}, which is not there" for path in PATH.findall(text)
                   if not is_made(path, is_document) and not exists(path, all_files, folders)]
        joined = re.sub(r"\s*\n\s*(//|#)?\s*", " ", text)
        faults += [f"{name}: docs/physics.md has no section {section!r}"
                   for section in re.findall(r"docs/physics\.md, '([^']*)'", joined) if section not in sections]
        faults += [f"{name}: names {word}, which is no part of the project"
                   for word in re.findall(r"\b(?:PHYSICS|DESIGN)\b(?:\.md)?", text)]
        if is_document:
            faults += faults_of_links(project, name)
    check_none(faults, "every file, link and section that a text names is there")


# ---- commands that documents show

COMMAND = re.compile(r"(mpirun|pickleflight|\./demo|\./check|cmake)( |$)|python3 |scripts/[\w-]+( |$)")


def shown_commands(text):
    """In the order of the text: lines of code blocks, and inline code, that begin like a command."""
    codes, paragraph, in_fence, in_block = [], [], False, False

    def end_paragraph():
        codes.extend(" ".join(code.split()) for code in re.findall(r"`([^`]+)`", "\n".join(paragraph)))
        paragraph.clear()

    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            end_paragraph()
            in_fence = not in_fence
            continue
        in_block = line.startswith("    ") and (in_block or not paragraph)
        if in_fence or in_block:
            codes.append(re.sub(r"\s{2,}#.*", "", line).strip())
        elif line.strip():
            paragraph.append(line)
        else:
            end_paragraph()
    end_paragraph()
    return [code for code in codes if COMMAND.match(code) and not re.search(r"^scripts/.*\.\w+$", code)]


def with_value(options, flag, value):
    """options with that flag set, wherever it stood before."""
    options = list(options)
    if flag in options:
        options[options.index(flag) + 1] = value
        return options
    return options + [flag, value]


class Commands:
    """Runs what one document shows, in its order and in one folder, with small sizes and without a window."""

    started = set()  # of all documents

    def __init__(self, project, folder):
        self.project, self.folder = project, pathlib.Path(folder)
        (self.folder / "src").symlink_to(project.root / "src")
        shutil.copytree(project.root / "assets/lab", self.folder / "assets/lab")
        (self.folder / "frames").mkdir()

    def run(self, command):
        """What is wrong with the command, or nothing."""
        for part in command.split(" && "):
            first, *rest = shlex.split(part)
            if first in NOT_RUN:
                fault = "" if os.access(self.project.root / first, os.X_OK) else "cannot be started"
            else:
                fault = {"pickleflight": self.fly, "./demo": self.demo, "./check": self.check_script, "cmake": self.cmake,
                         "python3": self.draw, "mpirun": self.launch}.get(first, lambda _: "is no known command")(rest)
            if fault:
                return fault
        return ""

    def ended(self, *words):
        done = self.project.run(*words, cwd=self.folder)
        lines = (done.stderr or done.stdout).strip().splitlines()
        return "" if done.returncode == 0 else f"exit code {done.returncode}: {lines[-1] if lines else ''}"

    def fly(self, options):
        if not options:
            options = ["run"]
        if options == ["lab"]:  # as the name of the whole
            options = ["lab", "--help"]
        if options[0] == "scenes" or "--help" in options or "--version" in options:
            return self.ended(self.project.program, *options)
        if options[:2] == ["lab", "plot"]:  # of a study that was told to end, perhaps before it had a result
            (self.folder / options[2]).mkdir(exist_ok=True)
            shutil.copy(self.folder / "assets/lab/work-precision.json", self.folder / options[2])
        if options[0] == "lab":
            return self.starts(options)
        return self.bench(options) if options[0] == "bench" else self.run_flight(options)

    def run_flight(self, options):
        if "--paused" in options:  # the space bar would start it
            if "--paused" not in self.project.run(self.project.program, "run", "--help").stdout:
                return "--paused is no option"
            options = [word for word in options if word != "--paused"]
        # Options of windows are refused with --headless. Without a display such a run has no window either.
        if not {"--headless", "--full-screen", "--clip"} & set(options):
            options = [*options, "--headless"]
        if len(options) > 1 and options[0] == "run" and options[1].endswith(".toml"):
            return self.ended(self.project.program, *options)
        if "--from" not in options:  # which has its parcels
            options = with_value(options, "-p", "500")
        options = with_value(options, "--size", "320x180")
        if "--picture-size" in options:
            options = with_value(options, "--picture-size", "640x360")
        if "--still" in options:
            options[options.index("--still") + 1] = "0.002"
        else:
            options = with_value(options, "--seconds", "0.05")
        return self.ended(self.project.program, *options)

    def bench(self, options):
        if "--sweep" in options:
            return self.starts(options)
        options = with_value(options, "-p", "500")
        if "--frames" in options:
            options = with_value(with_value(options, "--frames", "2"), "--size", "320x180")
        elif "--flight" in options:
            options = with_value(options, "--seconds", "0.05")
        else:
            options = [*options, "--steps", "2", "--warmup", "1", "--repeats", "1"]
        return self.ended(self.project.program, *options)

    def starts(self, options):
        """Takes minutes: it must begin, and is then told to end (how it ends has tests of its own). What began for one
        document begins for the next."""
        if tuple(options) in self.started:
            return ""
        self.started.add(tuple(options))
        with open(self.folder / "output.txt", "w+", encoding="utf-8") as output:
            running = subprocess.Popen([self.project.program, *options], cwd=self.folder, stdout=output, stderr=output,
                                       env={**os.environ, "XDG_CACHE_HOME": str(self.folder), "LIBGL_ALWAYS_SOFTWARE": "1"})
            for wait_s, end in ((1.0, lambda: running.send_signal(signal.SIGINT)), (1.0, running.kill), (LIMIT_S, running.kill)):
                try:
                    running.wait(wait_s)
                    break
                except subprocess.TimeoutExpired:
                    end()
            output.seek(0)
            lines = [line for line in output.read().splitlines() if line.startswith("pickleflight: ")]
        return f"exit code {running.returncode}: {' '.join(lines)}" if running.returncode in (2, 3) else ""

    def launch(self, words):
        """What each process does; tests/cli/test_ranks.py starts several."""
        return self.fly(words[words.index("pickleflight") + 1:]) if words else ""

    def demo(self, options):
        """As ./demo hands its arguments on."""
        is_command = options and re.fullmatch(r"[a-z]+", options[0])
        return self.fly(options if is_command or not options else ["run", *options])

    def check_script(self, options):
        known = self.project.text("tests/CMakeLists.txt")
        if options[:1] == ["--all"]:
            return "" if "--all" in self.project.text("check") else "./check knows no --all"
        if options[:1] == ["-L"]:
            has_label = re.search(r"^# Labels:[^\n]*\b%s\b" % re.escape(options[1]), known, re.MULTILINE)
            return "" if has_label else f"no test has the label {options[1]}"
        return "" if not options or options[0] in ("-R",) else f"{options[0]} is not known here"

    def cmake(self, options):
        presets = {entry["name"] for entry in json.loads(self.project.text("CMakePresets.json"))["configurePresets"]}
        lists = "".join(self.project.text(name) for name in self.project.files()
                        if name.endswith(("CMakeLists.txt", ".cmake")))
        for word, following in zip(options, options[1:] + [""]):
            if word == "--preset" and following not in presets:
                return f"no preset {following}"
            if word == "--build" and following.removeprefix("build/") not in presets:
                return f"no preset {following}"
            if word == "--target" and following not in ("package", "install") and f"({following} " not in lists:
                return f"no target {following}"
            if word.startswith("-DPF_") and word[2:].partition("=")[0] not in lists:
                return f"no option {word}"
        return ""

    def draw(self, options):
        if not (self.project.root / options[0]).is_file():
            return f"no {options[0]}"
        if self.project.run("/usr/bin/python3", "-c", "import matplotlib").returncode != 0:
            print(f"not run, matplotlib is missing: {options[0]}")
            return ""
        if "sweep.json" in options:  # the sweep itself was not run to its end
            shutil.copy(self.project.root / "assets/bench/sweep-nvidia-h200.json", self.folder / "sweep.json")
        return self.ended("/usr/bin/python3", "-B", *options)


def commands(project):
    """Every command that a document shows runs, or at least begins."""
    faults = []
    for name in project.documents():
        with tempfile.TemporaryDirectory() as folder:
            place = Commands(project, folder)
            for command in dict.fromkeys(shown_commands(project.text(name))):
                if command in project.known_good:
                    continue
                began = time.monotonic()
                fault = place.run(command)
                print(f"{name}: {command}: {fault or 'good'} ({time.monotonic() - began:.1f} s)", flush=True)
                faults += [f"{name}: {command}: {fault}"] if fault else []
    check_none(faults, "every command that a document shows is taken")


def options(project):
    """Every option and setting that a document names is known to the program or to a script."""
    texts = [project.run(project.program, *command, "--help").stdout for command in ((), ("run",), ("bench",), ("lab",))]
    texts += [project.text(name) for name in ("check", "CMakePresets.json", "scripts/fresh-root")]
    texts += [project.text(name) for name in project.files() if name.startswith("src/lab/plots/")]
    texts.append("--preset --build --target")  # of CMake
    known = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", "\n".join(texts)))
    settings = set(re.findall(r"^  ([a-z]+\.\w+) =", texts[1], re.MULTILINE))
    sections = {setting.split(".")[0] for setting in settings} - {"scene"}
    report = project.text("src/app/report.cpp")
    faults = []
    for name in project.documents():
        for code in re.findall(r"`([^`]+)`", project.text(name)):
            faults += [f"{name}: option {word} is not known" for word in re.findall(r"(?<![\w-])--[a-z][a-z-]+", code)
                       if word not in known]
            named = set(re.findall(r"\b((?:%s)\.[a-z_]\w+)\b" % "|".join(sections), code)) - settings
            faults += [f"{name}: setting {word} is not known" for word in sorted(named)
                       if word.split(".")[1] not in ENDINGS and f'"{word.split(".")[1]}"' not in report]
    check_none(faults, "every option and setting that a document names is known")


def keys(project):
    """The table of keys and gestures in docs/using.md is the program's, as --help and its card of keys show it."""
    shown = project.run(project.program, "run", "--help").stdout.partition("Mouse and keys in the window:\n")[2]
    known = {tuple(re.split(r"  +", line.strip(), maxsplit=1)) for line in shown.partition("\n\n")[0].splitlines()}
    table = project.text("docs/using.md").partition("## Mouse and keys")[2].partition("\n## ")[0]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line.startswith("|")]
    told = {tuple(row[at:at + 2]) for row in cells[2:] for at in (0, 3)} - {("", ""), ("**key**", "**does**")}
    check(len(known) > 15, f"--help has {len(known)} rows of keys and gestures")
    check_none([f"--help alone has {row}" for row in sorted(known - told)] +
               [f"docs/using.md alone has {row}" for row in sorted(told - known)], "docs/using.md has the same")


def reports(project):
    """docs/data.md has the keys of a report and the columns of the tables, and no others."""
    with tempfile.TemporaryDirectory() as folder:
        done = project.run(project.program, "--headless", "-p", "200", "--seconds", "0.05", "--size", "320x180", "--set",
                           "run.profile=x", "--report", "r.json", "--overlay-csv", "o.csv", "--profile-csv", "p.csv",
                           cwd=folder)
        check(done.returncode == 0, f"a run with a report ends with {done.returncode} {done.stderr.strip()}")
        made = {name: (pathlib.Path(folder) / name).read_text(encoding="utf-8") for name in ("r.json", "o.csv", "p.csv")}
    text = project.text("docs/data.md")
    section = {name: text.partition(f"\n## {name}\n")[2].partition("\n## ")[0] for name in ("Reports", "Tables")}
    cells = [line.split("|")[1] for line in section["Reports"].splitlines() if line.startswith("| `")]
    told, known = set(re.findall(r"`(\w+)`", "".join(cells))), set(json.loads(made["r.json"]))
    faults = [f"the report alone has {key}" for key in sorted(known - told)]
    faults += [f"docs/data.md alone has {key}" for key in sorted(told - known)]
    told = set(re.findall(r"`(\w+)`", section["Tables"]))
    for name in ("o.csv", "p.csv"):
        columns = made[name].splitlines()[0].split(",")
        of_phases = {column for column in columns if column.endswith(("_median_ms", "_p99_ms"))}
        of_phases |= {column.replace("_median_ms", "_ms") for column in of_phases}
        faults += [f"no word of the column {column}" for column in columns if column not in told | of_phases]
    check_none(faults, "docs/data.md has the keys of a report and the columns of the tables")


# ---- drawings and spelling

def drawings(project):
    """The SVGs are what the script draws, and the worked example tells what it computes."""
    with tempfile.TemporaryDirectory() as folder:
        made = project.run("/usr/bin/python3", "-B", project.root / "scripts/drawings.py", folder)
        check(made.returncode == 0, f"scripts/drawings.py ends with {made.returncode} {made.stderr.strip()}")
        kept = project.root / "docs/drawings"
        names = sorted(file.name for file in pathlib.Path(folder).iterdir())
        check(names == sorted(file.name for file in kept.iterdir()), f"docs/drawings has {', '.join(names)}")
        for name in names:
            check((pathlib.Path(folder) / name).read_bytes() == (kept / name).read_bytes(),
                  f"{name} is what scripts/drawings.py draws")
    sys.dont_write_bytecode = True
    spec = importlib.util.spec_from_file_location("drawings", project.root / "scripts/drawings.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    first, second, tested, whole = script.worked_merge()
    told = re.sub(r"\s+", " ", project.text("docs/exact.md").partition("## A worked example")[2].partition("\n## ")[0])
    at_start, after, events = script.worked_epoch()
    check(at_start["E"] is None and after["F"] is None, "E keeps nothing at first, and nothing is to come for F")
    facts = [f"an epoch of {script.EPOCH} ticks", f"a window of {script.LENGTH} ticks",
             "A and B keep each other at tick %d, C and D at tick %d" % (at_start["A"][0], at_start["C"][0]),
             "F keeps %s at tick %d" % at_start["F"][::-1], "keeps %s at tick %d" % after["C"][::-1],
             "A and D keep each other at tick %d" % after["D"][0], "E keeps %s at tick %d" % after["E"][::-1],
             ", ".join(f"{a}-{b} at {tick}" for tick, a, b in events[len(whole[0]):]), "A-B at tick %d" % first[0][0][0], "C-D at tick %d" % second[0][0][0],
             "collide at tick %d" % tested["AD"], "collide at tick %d" % tested["BC"],
             ", ".join(f"{a}-{b} at {tick}" for tick, a, b in whole[0])]
    for fact in facts:
        check(fact in told, f"docs/exact.md tells: {fact}")


def spelling(project):
    """No word that codespell knows as a misspelling; .codespellrc has those that are right here."""
    if shutil.which("codespell") is None:
        raise Missing("codespell")
    names = [name for name in project.files() if not name.endswith((".png", ".webp", ".json", ".svg"))]
    done = project.run("codespell", "--config", project.root / ".codespellrc", *names, cwd=project.root)
    check_none(done.stdout.splitlines(), "nothing is misspelt")


# ---- the checks themselves

def plant(project, name, old, new):
    text = project.text(name)
    assert old in text, f"{name}: no {old!r}"
    (project.root / name).write_text(text.replace(old, new, 1), encoding="utf-8")


# Each fault, where it goes, and the check that must see it.
FAULTS = [
    (words, "README.md", "## Read on", "word " * 800 + "\n\n## Read on"),
    (words, "README.md", "## Fly", "## Flying"),
    (purposes, "docs/lab.md", "This page explains", "- This page explains"),
    (files, "docs/lab.md", "](../assets/pictures/sweep.png)", "](../assets/pictures/swept.png)"),
    (files, "docs/exact.md", "`src/lab/reference.hpp`", "`src/lab/referent.hpp`"),
    (files, "docs/lab.md", "#choosing-an-accuracy", "#choosing-accuracy"),
    (files, "src/model/kinetic_theory.hpp", "docs/physics.md, 'Collision rate'", "docs/physics.md, 'Collision rates'"),
    (files, "src/model/kinetic_theory.hpp", "// Collisions per parcel", "// See backend/nowhere.hpp. Collisions per parcel"),
    (commands, "docs/using.md", "pickleflight scenes", "pickleflight scenery"),
    (commands, "docs/using.md", "--report flight.json", "--reports flight.json"),
    (commands, "docs/using.md", "cmake --preset package", "cmake --preset parcel"),
    (commands, "docs/lab.md", "pickleflight lab plot lab", "pickleflight lab plots lab"),
    (commands, "docs/architecture.md", "./check -L physics", "./check -L physic"),
    (options, "docs/using.md", "`--still` writes", "`--stills` writes"),
    (options, "docs/exact.md", "`run.contact_clock_s`", "`run.contact_clocks`"),
    (keys, "docs/using.md", "begin, end a film", "begin a film"),
    (reports, "docs/data.md", "| `clock_s` |", "| `clock` |"),
    (reports, "docs/data.md", "`ball_hits`; of", "`hits`; of"),
    (drawings, "docs/drawings/merge.svg", "find_conflicts", "find_conflict"),
    (drawings, "docs/exact.md", "collide at tick 58", "collide at tick 59"),
    (drawings, "docs/exact.md", "B-C at 43", "B-C at 44"),
    (drawings, "docs/exact.md", "C-E at 75", "C-E at 76"),
    (drawings, "docs/exact.md", "F keeps D at tick 63", "F keeps D at tick 64"),
    (spelling, "README.md", "the next method", "t" "eh next method"),
]


def refuses_broken(project):
    """Each check sees the faults that it is for."""
    for look, name, old, new in FAULTS:
        if look is spelling and shutil.which("codespell") is None:
            print("not tried, codespell is missing")
            continue
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder) / "project"
            for file in project.files():
                (copy / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(project.root / file, copy / file)
            broken = Project(copy, project.program)
            plant(broken, name, old, new)
            # Unbroken documents have a test of their own.
            for document in project.documents():
                broken.known_good |= set(shown_commands(project.text(document)))
            try:
                look(broken)
            except AssertionError:
                print(f"ok: {look.__name__} refuses {new.strip()[:60]!r} in {name}", flush=True)
                continue
            check(False, f"{look.__name__} does not see {new!r} in {name}")


CASES = {case.__name__: case for case in (words, purposes, files, commands, options, keys, reports, drawings, spelling,
                                        refuses_broken)}


def main():
    if len(sys.argv) < 3 or any(name not in CASES for name in sys.argv[2:]):
        sys.exit(f"{__doc__}\ncases: {' '.join(CASES)}")
    project = Project(ROOT, os.path.abspath(sys.argv[1]))
    for name in sys.argv[2:]:
        try:
            CASES[name](project)
        except Missing as what:
            print(f"SKIPPED: {what} not found")
            sys.exit(SKIPPED)
        except AssertionError:
            sys.exit(1)


if __name__ == "__main__":
    main()
