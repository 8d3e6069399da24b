#!/usr/bin/python3
"""Draws the SVGs of the documents. The same text comes out on every machine; tests/docs compares it.

scripts/drawings.py [FOLDER]     into FOLDER, docs/drawings if none is given

data-flow.svg   how a setting becomes a picture
rooms.svg       the folders of the sources and which of them includes which
merge.svg       two clusters of method `exact` that conflict and are merged (docs/exact.md); computed, not sketched
"""
import math
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
INK, FAINT, PAPER, EDGE = "#1F2328", "#59636E", "#FFFFFF", "#C4CBD3"
# Okabe and Ito (2008), as in the charts of the lab.
BLUE, ORANGE, GREEN = "#0072B2", "#D55E00", "#009E73"
PALE = {BLUE: "#E3F0F8", ORANGE: "#FBEADF", GREEN: "#DFF3EC", FAINT: "#F3F4F6"}


class Drawing:
    """An SVG on a ground of its own, so that it can be read on a light page and on a dark one."""

    def __init__(self, width, height, title):
        self.size, self.parts = (width, height), []
        self.parts.append(f"<title>{title}</title>")
        self.parts.append(f'<rect x="0.5" y="0.5" width="{width - 1}" height="{height - 1}" rx="10" fill="{PAPER}" '
                          f'stroke="{EDGE}"/>')

    def add(self, part):
        self.parts.append(part)

    def text(self, x, y, text, size=14, colour=INK, anchor="middle", weight="normal", family="sans-serif"):
        text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        self.add(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{colour}" text-anchor="{anchor}" '
                 f'font-weight="{weight}" font-family="DejaVu Sans, Verdana, Arial, {family}">{text}</text>')

    def box(self, x, y, width, height, lines, colour=FAINT):
        """A rounded box; the first line is bold."""
        self.add(f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" rx="7" fill="{PALE[colour]}" '
                 f'stroke="{colour}" stroke-width="1.3"/>')
        top = y + height / 2 - 8.5 * (len(lines) - 1) + 5
        for k, line in enumerate(lines):
            self.text(x + width / 2, top + 17 * k, line, 14 if k == 0 else 12, INK if k == 0 else FAINT,
                      weight="bold" if k == 0 else "normal")

    def line(self, points, colour=INK, width=1.5, dash="", arrow=True):
        path = "M" + " L".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.add(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}"'
                 + (f' stroke-dasharray="{dash}"' if dash else "") + "/>")
        if arrow:
            self.head(points[-2], points[-1], colour)

    def head(self, start, end, colour):
        """Of an arrow; no markers, which some viewers leave out."""
        angle = math.atan2(end[1] - start[1], end[0] - start[0])
        corner = [(end[0] - 9 * math.cos(angle + side), end[1] - 9 * math.sin(angle + side)) for side in (-0.38, 0.38)]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in (end, *corner))
        self.add(f'<polygon points="{points}" fill="{colour}"/>')

    def circle(self, x, y, radius, colour, fill="none", width=1.5, dash=""):
        self.add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{fill}" stroke="{colour}" '
                 f'stroke-width="{width}"' + (f' stroke-dasharray="{dash}"' if dash else "") + "/>")

    def svg(self):
        width, height = self.size
        return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
                f'viewBox="0 0 {width} {height}">\n' + "\n".join(self.parts) + "\n</svg>\n")


# ---- data flow

def data_flow():
    d = Drawing(960, 330, "From a scene file to the window and the film")
    y, height = 92, 62
    stops = [(24, 112, ["scene.toml", "command line"], FAINT), (166, 104, ["Settings", "one table"], BLUE),
             (300, 104, ["Physics", "SI units"], BLUE), (434, 148, ["Backend::submit", "steps of a frame"], GREEN),
             (612, 108, ["DrawTarget", "GL memory"], ORANGE), (750, 90, ["Renderer", "OpenGL"], ORANGE)]
    for x, width, lines, colour in stops:
        d.box(x, y, width, height, lines, colour)
    for (x, width, _, _), (following, *_) in zip(stops, stops[1:]):
        d.line([(x + width, y + height / 2), (following - 1, y + height / 2)])
    d.box(870, y, 74, height, ["Window"], ORANGE)
    d.line([(840, y + height / 2), (869, y + height / 2)])

    d.box(166, 22, 104, 36, ["Panel"], ORANGE)
    d.line([(218, 58), (218, y - 1)])
    d.text(280, 44, "edits a copy, returns Commands", 12, FAINT, "start")

    d.box(434, 196, 68, 40, ["cpu"], GREEN)
    d.box(514, 196, 68, 40, ["cuda"], GREEN)
    d.line([(468, y + height), (468, 195)])
    d.line([(548, y + height), (548, 195)])
    d.box(414, 268, 188, 44, ["src/model", "every formula once"], BLUE)
    d.line([(468, 236), (468, 267)], arrow=False)
    d.line([(548, 236), (548, 267)], arrow=False)
    d.text(400, 212, "either one computes", 12, FAINT, "end")
    d.text(400, 228, "the same bits", 12, FAINT, "end")

    d.box(750, 196, 90, 40, ["Film"], ORANGE)
    d.line([(795, y + height), (795, 195)])
    d.box(870, 196, 74, 40, ["ffmpeg"], FAINT)
    d.line([(840, 216), (869, 216)])
    d.text(847, 262, "no copy after GL's read-back", 12, FAINT)
    return d


# ---- rooms

def rooms():
    d = Drawing(960, 300, "The folders of the sources; an arrow points to what is included")
    box = {"core": (24, 122, 118, ["core", "vectors, threads"]), "model": (178, 122, 118, ["model", "formulas"]),
           "scene": (332, 62, 130, ["scene", "settings, files"]), "backend": (332, 182, 130, ["backend", "CPU, interface"]),
           "app": (498, 122, 118, ["app", "loop, options"]), "data": (652, 118, 118, ["data", "states in files"]), "view": (652, 190, 118, ["view", "GL, panel, film"]),
           "lab": (652, 52, 118, ["lab", "studies"]), "main": (816, 122, 118, ["main.cpp", "joins all"])}
    colours = {"data": FAINT, "core": FAINT, "model": BLUE, "scene": BLUE, "backend": GREEN, "app": FAINT, "view": ORANGE, "lab": FAINT,
               "main": FAINT}
    for name, (x, y, width, lines) in box.items():
        d.box(x, y, width, 52, lines, colours[name])

    def arrow(start, end):
        (x, y, _, _), (to_x, to_y, to_width, _) = box[start], box[end]
        offset = 10 * ((y > to_y) - (y < to_y))
        d.line([(x, y + 26), (to_x + to_width + 1, to_y + 26 + offset)])

    for start, end in (("model", "core"), ("scene", "model"), ("backend", "model"), ("app", "scene"), ("app", "backend"),
                       ("data", "app"), ("view", "app"), ("lab", "app"), ("main", "data"), ("main", "view"), ("main", "lab")):
        arrow(start, end)
    d.box(332, 250, 130, 36, ["cuda"], GREEN)
    d.line([(397, 250), (397, 235)])
    d.box(186, 250, 102, 36, ["mpi"], FAINT)
    d.line([(289, 268), (345, 235)])
    d.box(652, 262, 118, 30, ["cuda/gl"], ORANGE)
    d.line([(652, 277), (463, 277)])
    d.line([(711, 262), (711, 243)])
    d.line([(711, 190), (711, 171)])
    d.text(24, 34, "An arrow points to what is included", 14, FAINT, "start")
    return d


# ---- a merge

DIAMETER = 1.0
SPEED = 0.1  # diameters per tick
LENGTH = 56  # ticks of the window
EPOCH = 120


class Disc:
    """A trajectory: anchor, velocity, and the tick of the anchor."""

    def __init__(self, anchor, velocity, tick=0.0):
        self.anchor, self.velocity, self.tick = anchor, velocity, tick

    def at(self, tick):
        return tuple(a + v * (tick - self.tick) for a, v in zip(self.anchor, self.velocity))


def collision_tick(one, other):
    """When the centres are a diameter apart; None if never. Rounded to a tick, as the program does."""
    start = max(one.tick, other.tick)
    offset = [b - a for a, b in zip(one.at(start), other.at(start))]
    velocity = [b - a for a, b in zip(one.velocity, other.velocity)]
    b = sum(e * v for e, v in zip(offset, velocity))
    v2 = sum(v * v for v in velocity)
    gap2 = sum(e * e for e in offset) - DIAMETER ** 2
    root2 = b * b - v2 * gap2
    if b >= 0 or root2 < 0:
        return None
    return round(start + gap2 / (-b + math.sqrt(root2)))


def collide(one, other, tick):
    """The two trajectories after an elastic collision of equal discs."""
    p, q = one.at(tick), other.at(tick)
    distance = math.dist(p, q)
    normal = [(b - a) / distance for a, b in zip(p, q)]
    speed = sum((b - a) * n for a, b, n in zip(one.velocity, other.velocity, normal))
    change = [speed * n for n in normal]
    return (Disc(p, tuple(v + c for v, c in zip(one.velocity, change)), tick),
            Disc(q, tuple(v - c for v, c in zip(other.velocity, change)), tick))


def start_of_window():
    """B and C rest; A hits B at tick 10, D hits C at tick 16, both at 45 degrees."""
    half = math.sqrt(0.5) * DIAMETER
    return {"A": Disc((-half - SPEED * 10, -half), (SPEED, 0.0)), "B": Disc((0.0, 0.0), (0.0, 0.0)),
            "C": Disc((4.0, 0.0), (0.0, 0.0)), "D": Disc((4.0 + half + SPEED * 16, -half), (-SPEED, 0.0))}


def solve(discs, end=LENGTH):
    """All events among the discs before a tick, in the order of time, and every trajectory of each disc."""
    now, events = dict(discs), []
    trajectories = {name: [disc] for name, disc in discs.items()}
    while True:
        names = sorted(now)
        due = [(tick, a, b) for k, a in enumerate(names) for b in names[k + 1:]
               if (tick := collision_tick(now[a], now[b])) is not None and tick < end]
        if not due:
            return events, trajectories
        tick, a, b = min(due)
        now[a], now[b] = collide(now[a], now[b], tick)
        for name in (a, b):
            trajectories[name].append(now[name])
        events.append((tick, a, b))


def worked_merge():
    """What docs/exact.md tells: each cluster alone, their conflict, and the two as one."""
    discs = start_of_window()
    first = solve({name: discs[name] for name in "AB"})
    second = solve({name: discs[name] for name in "CD"})
    ends = {name: paths[-1] for _, trajectories in (first, second) for name, paths in trajectories.items()}
    tested = {a + b: collision_tick(ends[a], ends[b]) for a in "AB" for b in "CD"}
    return first, second, tested, solve(discs)


def kept_events(discs):
    """The next event of each disc on these trajectories, up to the epoch's end: tick and partner, or None."""
    ticks = {a: [(collision_tick(discs[a], discs[b]), b) for b in discs if b != a] for a in discs}
    return {a: min(((tick, b) for tick, b in of_a if tick is not None and tick < EPOCH), default=None)
            for a, of_a in ticks.items()}


def worked_epoch():
    """What docs/exact.md tells about E and F: events kept at the epoch's start and after the window, and all events."""
    discs = {**start_of_window(), "E": Disc((5.0, 2.0), (0.0, 0.0)), "F": Disc((0.1, -8.0), (0.0, SPEED))}
    after = {name: paths[-1] for name, paths in solve(discs)[1].items()}
    return kept_events(discs), kept_events(after), solve(discs, EPOCH)[0]


MERGE_COLOUR = {"A": BLUE, "B": BLUE, "C": ORANGE, "D": ORANGE}


class Scene:
    """A picture of the discs in a part of the drawing; y up."""

    def __init__(self, drawing, x, y, scale):
        self.drawing, self.x, self.y, self.scale = drawing, x, y, scale

    def place(self, point):
        return self.x + self.scale * point[0], self.y - self.scale * point[1]

    def disc(self, name, point, colour, start=False):
        x, y = self.place(point)
        self.drawing.circle(x, y, 0.5 * self.scale, colour, PALE[colour] if start else "none", 1.4, "" if start else "3 2.5")
        if start:
            self.drawing.text(x, y + 5, name, 13, INK, weight="bold")

    def trajectories(self, name, paths, colour, width=2.0):
        for k, path in enumerate(paths):
            end = paths[k + 1].tick if k + 1 < len(paths) else LENGTH
            if path.velocity != (0.0, 0.0):
                self.drawing.line([self.place(path.at(path.tick)), self.place(path.at(end))], colour, width,
                                  arrow=k + 1 == len(paths))

    def all_of(self, trajectories, colour_of):
        for name, paths in trajectories.items():
            self.trajectories(name, paths, colour_of(name))
        for name, paths in trajectories.items():
            self.disc(name, paths[0].at(0), colour_of(name), True)
            self.disc(name, paths[-1].at(LENGTH), colour_of(name))


def timeline(d, x, y, width, events, colour_of, note=""):
    """Ticks of the step as a line with the events on it."""
    d.line([(x, y), (x + width, y)], FAINT, 1.2, arrow=False)
    for tick in (0, LENGTH):
        at = x + width * tick / LENGTH
        d.line([(at, y - 4), (at, y + 4)], FAINT, 1.2, arrow=False)
        d.text(at, y + 18, str(tick), 11, FAINT)
    for tick, a, b in events:
        at = x + width * tick / LENGTH
        d.circle(at, y, 4.5, colour_of(a, b), colour_of(a, b))
        d.text(at, y - 10, a + b, 12, INK, weight="bold")
        d.text(at, y + 18, str(tick), 11, INK)
    if note:
        d.text(x + width / 2, y + 40, note, 12, FAINT)


def merge():
    first, second, tested, whole = worked_merge()
    d = Drawing(960, 350, "Two clusters that conflict, and the cluster that they are merged into")
    width, scale = 306, 29
    titles = ["1  solve: each cluster alone", "2  find_conflicts", "3  merged, solved again"]
    for k, title in enumerate(titles):
        d.text(20 + 313 * k, 32, title, 15, INK, "start", "bold")
        if k:
            d.line([(10 + 313 * k, 20), (10 + 313 * k, 330)], EDGE, 1, arrow=False)
    origin = [(94 + 313 * k, 150) for k in range(3)]

    alone = Scene(d, *origin[0], scale)
    both = {**first[1], **second[1]}
    alone.all_of(both, MERGE_COLOUR.get)
    timeline(d, 30, 278, width - 40, first[0] + second[0], lambda a, b: MERGE_COLOUR[a],
             "blue: cluster AB, orange: cluster CD")

    test = Scene(d, *origin[1], scale)
    tick = tested["BC"]
    for name, paths in both.items():
        bold = name in "BC"
        test.trajectories(name, paths[1:], MERGE_COLOUR[name] if bold else EDGE, 2.4 if bold else 1.4)
    for name in "BC":
        at = both[name][-1].at(tick)
        x, y = test.place(at)
        d.circle(x, y, 0.5 * scale, MERGE_COLOUR[name], PALE[MERGE_COLOUR[name]], 1.6)
        d.text(x, y + 5, name, 13, INK, weight="bold")
    for name in "AD":
        x, y = test.place(both[name][-1].at(LENGTH))
        d.circle(x, y, 0.5 * scale, EDGE, "none", 1.4)
        d.text(x, y + 5, name, 13, FAINT, weight="bold")
    timeline(d, 343, 278, width - 40, [(tick, "B", "C")], lambda a, b: INK,
             f"conflict: B and C would collide at tick {tick}")

    merged = Scene(d, *origin[2], scale)
    merged.all_of(whole[1], lambda name: GREEN)
    timeline(d, 656, 278, width - 40, whole[0], lambda a, b: GREEN, "one cluster ABCD, nothing conflicts")
    return d


DRAWINGS = {"data-flow": data_flow, "rooms": rooms, "merge": merge}


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/drawings"
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in DRAWINGS.items():
        (folder / f"{name}.svg").write_text(draw().svg(), encoding="utf-8")


if __name__ == "__main__":
    main()
