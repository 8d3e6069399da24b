#!/usr/bin/python3
"""Writes report.html: one page of all studies in a folder, with their pictures.

report.py FOLDER    reads NAME.json and the pictures that the other scripts wrote
Needs nothing but Python.
"""
import base64
import html
import json
import pathlib
import sys

from terms_text import saved_text

ORDER = ["work-precision", "stability", "contact-clock", "terms", "gas-dynamics", "validate"]
CAPTIONS = {"-order": "Order of convergence. Each line is a method; first order falls one decade per decade of the "
                      "time step.",
            "-parcels": "Scatter of the flight over 16 seeds. Where the scatter exceeds a method's error, only more "
                        "parcels help, not a better method.",
            "-frames": "Worst frame over mean frame of a flight. A point high up is a flight whose picture stops.",
            "-curves": "Breaking points that theory knows. Lines are theory; dots are measured."}
STYLE = """body{font:16px/1.5 system-ui,sans-serif;color:#222;max-width:1180px;margin:2.5em auto;padding:0 1em}
h1{font-size:1.9em;margin-bottom:.1em}h2{margin-top:2.2em;border-top:1px solid #ddd;padding-top:1em}
img{width:100%;margin:.6em 0}code{background:#f3f3f0;padding:.1em .35em;border-radius:3px}
table{border-collapse:collapse}td,th{text-align:left;padding:.2em 1.4em .2em 0;border-bottom:1px solid #eee}
.faint{color:#777;font-size:.9em}"""


def picture(file):
    data = base64.b64encode(file.read_bytes()).decode()
    return f'<img alt="{html.escape(file.stem)}" src="data:image/png;base64,{data}">'


def table(head, rows):
    cells = "".join(f"<tr>{''.join(f'<td>{html.escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><tr>{''.join(f'<th>{name}</th>' for name in head)}</tr>{cells}</table>"


def sentences(study):
    return "".join(f"<li>{html.escape(text)}</li>" for text in study.get("words", [])).join(("<ul>", "</ul>"))


def summary(study):
    if study["study"] == "work-precision" and study.get("orders"):
        return sentences(study) + table(["device", "method", "area fraction", "order of convergence"],
                     [(entry.get("device", "cpu"), entry["method"], entry["area_fraction"],
                       "not fitted" if entry["order"] is None else f"{entry['order']:.2f}") for entry in study["orders"]])
    if study["study"] == "terms":
        return table(["term", "shift of exit", "across", "change of speed", "cost", "verdict"],
                     [(row["term"], bounded(row, "exit_shift", "{:.2g} %"), f"{row['deflection_m']:+.2g} m",
                       bounded(row, "speed_shift", "{:+.2g} %"), saved_text(row), row["verdict"])
                      for row in study["points"] if "verdict" in row])
    if study["study"] == "gas-dynamics":
        return table(["case", "figure", "method", "step", "expected", "measured", "error", "standard error", "verdict"],
                     [(row["case"], row["figure"], row["method"], f"{row['displacement_per_step']:g}", f"{row['expected']:.5g}",
                       f"{row['measured']:.5g}", f"{100 * row['error']:+.2f} %", f"{100 * row['sigma']:.2f} %", row["verdict"])
                      for row in study.get("table", []) if row["error"] is not None])
    if study["study"] == "validate":
        return table(["reference", "method", "expected", "measured", "error", "standard error", "verdict"],
                     [(row["yardstick"], row["method"], f"{row['expected']:.6g}", f"{row['measured']:.6g}",
                       share(row, "error"), share(row, "sigma"), row["verdict"]) for row in study["points"]])
    return ""


def bounded(row, key, form):
    """A share in per cent, or its upper bound where the runs do not resolve it, as in the chart."""
    value, sigma = row[key], row[f"{key}_sigma"]
    return form.format(100 * value) if abs(value) >= 2 * sigma else f"< {100 * (abs(value) + 2 * sigma):.2g} %"


def share(row, key):
    return f"{100 * row[key]:.3f} %" if row["relative"] else f"{row[key]:.2g}"


def section(folder, study):
    name, machine = study["study"], study["machine"]
    parts = [f"<h2>{html.escape(study['title'])}</h2><p>{html.escape(study['reading'])}</p>"]
    for file in [folder / f"{name}.png", *sorted(folder.glob(f"{name}-*.png"))]:
        if not file.exists():
            parts.append(f"<p class=faint>No picture {file.name}: {name}.csv has the figures.</p>")
            continue
        parts.append(picture(file))
        caption = CAPTIONS.get(file.stem.removeprefix(name))
        if caption:
            parts.append(f"<p>{html.escape(caption)}</p>")
    parts.append(summary(study))
    devices = "; ".join(entry["device"] for entry in machine["devices"])
    load = " The machine was under load: times are upper bounds." if machine["measured_under_load"] else ""
    state = "" if study["complete"] else " Not complete: continue with --resume."
    parts.append(f"<p class=faint>Repeat: <code>{html.escape(study['command'])}</code>. Measured on {html.escape(devices)}, "
                 f"{machine['cores']} cores, pickleflight {html.escape(study['version'])}.{load}{state} "
                 f"Data: {name}.json, {name}.csv.</p>")
    return "\n".join(parts)


def study_in(file):
    """None if the file is damaged."""
    try:
        study = json.loads(file.read_text())
    except (OSError, ValueError):
        return None
    return study if isinstance(study, dict) and study.get("study") == file.stem else None


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    files = [file for name in ORDER if (file := folder / f"{name}.json").exists()]
    read = {file: study_in(file) for file in files}
    studies = [study for study in read.values() if study is not None]
    damaged = [file.name for file, study in read.items() if study is None]
    if not files:
        sys.exit(f"{folder} holds no study; measure one: pickleflight lab all --out {folder}")
    body = "\n".join(section(folder, study) for study in studies)
    page = (f"<!doctype html><html lang=en><meta charset=utf-8><title>Pickleball Flight: the lab</title><style>{STYLE}</style>"
            f"<h1>Pickleball Flight: the lab</h1><p>Accuracy, cost and limits of each collision "
            f"method.</p>{body}</html>\n")
    try:
        (folder / "report.html").write_text(page)
    except OSError as error:
        sys.exit(f"{folder}/report.html cannot be written: {error}")
    if damaged:
        sys.exit(f"{folder}/report.html is written without the damaged {', '.join(damaged)}")


if __name__ == "__main__":
    main()
