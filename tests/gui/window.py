"""A window of the program on an X server of its own, and hands for it (xdotool)."""
import contextlib
import ctypes
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

SKIPPED = 77
NEEDED = ("Xvfb", "xdotool", "setxkbmap")
# ImGui 1.86 reads the state of buttons and keys once per frame, so each lasts for two frames or more. The frame that is
# being drawn counts as well.
HOLD_FRAMES = 3
LIMIT_S = 30.0  # for anything to happen
SLIDER_END_PX = 2 + 6 / 2  # the grab's middle stops this far from a slider's end (gui.cpp, GrabMinSize)


def skip_if_missing():
    missing = [tool for tool in NEEDED if shutil.which(tool) is None]
    if missing:
        print(f"SKIPPED: {' and '.join(missing)} not found (Debian, Ubuntu: apt install xvfb xdotool x11-xkb-utils)")
        sys.exit(SKIPPED)


def wait_for(what, test, limit_s=LIMIT_S):
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        value = test()
        if value:
            return value
        time.sleep(0.03)
    raise AssertionError(f"after {limit_s:.0f} s still no {what}")


class Screen:
    """Xvfb on a display that is free; ended with the block."""
    connection = None  # to it, once it is needed

    def __enter__(self):
        # The server itself looks for a free number and writes it. Without -noreset it begins anew when a window closes, and
        # a program that starts just then finds no display.
        self.server = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp",
                                        "-noreset"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        number = self.server.stdout.readline().strip()
        if not number:
            raise AssertionError("Xvfb did not start")
        self.name = f":{number}"
        return self

    def __exit__(self, *_):
        self.server.terminate()
        self.server.wait(timeout=10)

    @contextlib.contextmanager
    def layout(self, name):
        """A keyboard of that country for windows that are opened meanwhile."""
        def choose(layout):
            subprocess.run(["setxkbmap", "-display", self.name, layout], check=True, timeout=LIMIT_S)

        choose(name)
        try:
            yield
        finally:
            choose("us")

    def set_dpi(self, dpi):
        """As a desktop tells its programs: Xft.dpi among the resources of the root window."""
        x11 = ctypes.CDLL("libX11.so.6")
        x11.XOpenDisplay.restype = ctypes.c_void_p
        x11.XDefaultRootWindow.restype = ctypes.c_ulong
        # Kept open: the server forgets all properties when the last one closes.
        self.connection = self.connection or ctypes.c_void_p(x11.XOpenDisplay(self.name.encode()))
        root = ctypes.c_ulong(x11.XDefaultRootWindow(self.connection))
        text = f"Xft.dpi:\t{dpi}\n".encode()
        resource_manager, string, replace = ctypes.c_ulong(23), ctypes.c_ulong(31), 0  # Xatom.h
        x11.XChangeProperty(self.connection, root, resource_manager, string, 8, replace, text, len(text))
        x11.XSync(self.connection, 0)


class Window:
    """The program, running. hands_off: no key or button is pressed, to see that the tests notice. launcher: words that
    start it, as several processes."""

    def __init__(self, program, screen, folder, words=(), hands_off=False, environment=None, fresh=True, launcher=()):
        self.folder = pathlib.Path(folder)
        self.map_file, self.report_file = self.folder / "panel.json", self.folder / "report.json"
        for file in (self.map_file, pathlib.Path(f"{self.map_file}.frames"), self.report_file):
            file.unlink(missing_ok=True)
        self.hands_off = hands_off
        self.environment = {**os.environ, "DISPLAY": screen.name, "LIBGL_ALWAYS_SOFTWARE": "1", **(environment or {})}
        self.environment.pop("WAYLAND_DISPLAY", None)
        # High enough that nothing of the panel is scrolled out of sight.
        defaults = [("--size", "800x700")] + [("-p", "2000")] * fresh  # a run that goes on has its parcels
        usual = [part for flag, value in defaults if flag not in words
                 for part in (flag, value)]
        files = ["--panel-map", str(self.map_file), "--report", str(self.report_file)]
        command = [*launcher, program, "run", *usual, *files, *words]
        self.process = subprocess.Popen(command, env=self.environment)
        self.search = ("--name", ".") if launcher else ("--pid", str(self.process.pid))
        wait_for("panel map", lambda: self.is_running() and self.map_file.exists())
        self.id = wait_for("window", self._find)
        # There is no window manager that would do it.
        self._xdotool("windowmove", self.id, "0", "0", "windowfocus", self.id)
        self.wait_frames(2 * HOLD_FRAMES)

    def is_running(self):
        if self.process.poll() is None:
            return True
        raise AssertionError(f"the program ended by itself with exit code {self.process.returncode}")

    def _find(self):
        words = ["xdotool", "search", "--onlyvisible", *self.search]
        done = subprocess.run(words, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        return done.stdout.split()[0] if done.stdout.split() else None

    def _xdotool(self, *words):
        subprocess.run(["xdotool", *words], env=self.environment, check=True, timeout=LIMIT_S)

    def _press(self, *words):
        if not self.hands_off:
            self._xdotool(*words)
            self.wait_frames()

    def resize(self, width, height):
        self._press("windowsize", self.id, str(width), str(height))

    def _num_frames(self):
        file = pathlib.Path(f"{self.map_file}.frames")
        text = file.read_text().strip() if file.exists() else ""
        return int(text) if text else 0

    def wait_frames(self, num=HOLD_FRAMES):
        """Until the program has drawn so many more frames, or has ended."""
        end = self._num_frames() + num
        limit = time.monotonic() + LIMIT_S
        while self._num_frames() < end and self.process.poll() is None:
            assert time.monotonic() < limit, f"no {num} frames in {LIMIT_S:.0f} s"
            time.sleep(0.004)

    def controls(self):
        """Rectangles of the panel's controls by label; empty while the panel is hidden."""
        return json.loads(self.map_file.read_text()) or {}

    def wait_for_control(self, label, there=True):
        """Until the map has the label (or has it no more): the map is what shows a change at once."""
        wait_for(f"{label!r} {'in' if there else 'gone from'} the panel",
                 lambda: self.is_running() and (label in self.controls()) == there, 1.0 if self.hands_off else LIMIT_S)

    def press_key(self, key):
        self._press("keydown", key)
        self._press("keyup", key)

    def _move_to(self, label, share=0.5):
        x0, y0, x1, y1 = self.controls()[label]
        low, high = x0 + SLIDER_END_PX, x1 - SLIDER_END_PX
        self._press("mousemove", str(round(low + share * (high - low))), str(round(0.5 * (y0 + y1))))

    def move_to(self, label, share):
        """The pointer, to a share of the slider's range."""
        self._move_to(label, share)

    def hold(self, label, share):
        """The button goes down there and stays."""
        self._move_to(label, share)
        self._press("mousedown", "1")

    def move_by(self, right, down):
        self._press("mousemove_relative", "--", str(right), str(down))

    def release(self):
        self._press("mouseup", "1")

    def click(self, label):
        self._move_to(label)
        self._press("mousedown", "1")
        self._press("mouseup", "1")

    def drag_slider(self, label, start, end):
        """From one share of the slider's range to another, with the button down."""
        self._move_to(label, start)
        self._press("mousedown", "1")
        for share in (0.5 * (start + end), end):
            self._move_to(label, share)
        self._press("mouseup", "1")

    def point_at(self, label, off):
        """The pointer so far from a place."""
        x0, y0, x1, y1 = self.controls()[label]
        self._press("mousemove", str(round(0.5 * (x0 + x1)) + off[0]), str(round(0.5 * (y0 + y1)) + off[1]))

    def drag(self, label, moves, shift=False, off=(0, 0)):
        """From a place, or so far off it, with the button down by so many pixels, each (right, down)."""
        x0, y0, x1, y1 = self.controls()[label]
        x, y = round(0.5 * (x0 + x1)) + off[0], round(0.5 * (y0 + y1)) + off[1]
        self._press("mousemove", str(x), str(y))
        if shift:
            self._press("keydown", "shift")
        self._press("mousedown", "1")
        for right, down in moves:
            x, y = x + right, y + down
            self._press("mousemove", str(x), str(y))
        self._press("mouseup", "1")
        if shift:
            self._press("keyup", "shift")

    def press_with(self, modifier, key):
        self._press("keydown", modifier)
        self.press_key(key)
        self._press("keyup", modifier)

    def press_shifted(self, key):
        self.press_with("shift", key)

    def type_text(self, label, text):
        """Into a field for text."""
        self.click(label)
        self._press("type", "--delay", "60", text)

    def choose(self, label, item):
        """An item of a menu that opens."""
        self.click(label)
        self.wait_for_control(f"{label}.{item}")
        self.wait_frames()  # it is placed in its second frame
        self.click(f"{label}.{item}")
        self.wait_for_control(f"{label}.{item}", there=False)

    def type_value(self, label, text, tap=False):
        """Control and click, a number, Return. tap: it is pressed and released at once, perhaps between two frames."""
        self._press("keydown", "ctrl")
        self.click(label)
        self._press("keyup", "ctrl")
        for letter in text:  # a letter for each pair of frames
            self._press("key", {".": "period", ",": "comma", "-": "minus"}.get(letter, letter))
        if tap:
            self._press("key", "--delay", "0", "Return")
        else:
            self.press_key("Return")
        time.sleep(0.3)  # until the text has ended, it takes all keys

    def scroll(self, x, y, notches):
        """With the wheel, nearer."""
        self._press("mousemove", str(x), str(y))
        for _ in range(notches):
            self._press("click", "4")

    def scroll_over(self, label, notches):
        """With the wheel, nearer, over the middle of a place."""
        self._move_to(label)
        for _ in range(notches):
            self._press("click", "4")

    def end(self):
        """Esc twice, as a person would; the report."""
        self.press_key("Escape")
        self.press_key("Escape")
        try:
            exit_code = self.process.wait(timeout=2.0 if self.hands_off else LIMIT_S)
        except subprocess.TimeoutExpired:
            raise AssertionError("Esc twice does not end the program") from None
        assert exit_code == 0, f"exit code {exit_code} after Esc"
        return self.report()

    def stop(self):
        """By a signal, which also ends in a report: for what is not about Esc."""
        self.process.terminate()
        assert self.process.wait(timeout=LIMIT_S) == 0, "exit code after SIGTERM"
        return self.report()

    def report(self):
        return json.loads(self.report_file.read_text())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
