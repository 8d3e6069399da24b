"""Drops files on a window as a desktop does: the XDND protocol, version 5, with the C library of X alone."""
import ctypes
import time
import urllib.parse

CLIENT_MESSAGE, SELECTION_NOTIFY, SELECTION_REQUEST = 33, 31, 30
LIMIT_S = 10.0


class Event(ctypes.Structure):
    """An XEvent: 24 longs, of which the first holds the type."""
    _fields_ = [("part", ctypes.c_long * 24)]

    @property
    def type(self):
        return self.part[0] & 0xFFFFFFFF


def load_x11():
    x11 = ctypes.CDLL("libX11.so.6")
    for name in ("XOpenDisplay", "XDefaultRootWindow", "XCreateSimpleWindow", "XInternAtom"):
        getattr(x11, name).restype = ctypes.c_ulong
    return x11


class Source:
    """The window that a file is dragged from."""

    def __init__(self, display):
        self.x11 = load_x11()
        self.display = ctypes.c_void_p(self.x11.XOpenDisplay(display.encode()))
        root = ctypes.c_ulong(self.x11.XDefaultRootWindow(self.display))
        self.window = self.x11.XCreateSimpleWindow(self.display, root, 0, 0, 1, 1, 0, 0, 0)

    def atom(self, name):
        return self.x11.XInternAtom(self.display, name.encode(), 0)

    def send(self, window, parts):
        event = Event()
        event.part[:len(parts)] = parts
        self.x11.XSendEvent(self.display, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(event))
        self.x11.XFlush(self.display)

    def message(self, target, name, data):
        # type, serial, sent, display, window, kind of message, bits per item, items
        self.send(target, [CLIENT_MESSAGE, 0, 1, 0, target, self.atom(name), 32, *data])

    def wait_for(self, name, answer=None):
        """For a message of the target; requests for the selection get the answer."""
        end, event = time.monotonic() + LIMIT_S, Event()
        while time.monotonic() < end:
            if self.x11.XPending(self.display) == 0:
                time.sleep(0.01)
                continue
            self.x11.XNextEvent(self.display, ctypes.byref(event))
            if event.type == SELECTION_REQUEST and answer is not None:
                self.give(event, answer)
            if event.type == CLIENT_MESSAGE and event.part[5] == self.atom(name):
                return
        raise AssertionError(f"the window does not answer with {name}")

    def give(self, request, data):
        asking, selection, kind, where, when = request.part[5:10]
        self.x11.XChangeProperty(self.display, ctypes.c_ulong(asking), ctypes.c_ulong(where), ctypes.c_ulong(kind),
                                 8, 0, data, len(data))
        self.send(asking, [SELECTION_NOTIFY, 0, 1, 0, asking, selection, kind, where, when])

    def drop(self, target, files, at):
        uris = "".join(f"file://{urllib.parse.quote(str(file))}\r\n" for file in files).encode()
        self.x11.XSetSelectionOwner(self.display, ctypes.c_ulong(self.atom("XdndSelection")),
                                    ctypes.c_ulong(self.window), ctypes.c_ulong(0))
        self.message(target, "XdndEnter", [self.window, 5 << 24, self.atom("text/uri-list"), 0, 0])
        self.message(target, "XdndPosition", [self.window, 0, at[0] << 16 | at[1], 0, self.atom("XdndActionCopy")])
        self.wait_for("XdndStatus")
        self.message(target, "XdndDrop", [self.window, 0, 0, 0, 0])
        self.wait_for("XdndFinished", answer=uris)
