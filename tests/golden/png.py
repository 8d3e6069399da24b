"""Reads PNG pictures with ffmpeg."""
import struct
import subprocess


class Picture:
    """rgb: three bytes per pixel, rows from the top."""

    def __init__(self, width, height, rgb):
        self.width, self.height, self.rgb = width, height, rgb

    def at(self, x, y):
        start = 3 * (y * self.width + x)
        return tuple(self.rgb[start:start + 3])

    def has(self, x, y):
        return 0 <= x < self.width and 0 <= y < self.height


def read_png(path):
    width, height = _size(path)
    return Picture(width, height, _decoded(path, "rgb24", 3 * width * height))


def read_alpha(path):
    """Width, height and (r, g, b, a) of each pixel."""
    width, height = _size(path)
    raw = _decoded(path, "rgba", 4 * width * height)
    return width, height, [tuple(raw[at:at + 4]) for at in range(0, len(raw), 4)]


def _size(path):
    with open(path, "rb") as file:
        head = file.read(33)
    if head[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path}: not a PNG")
    width, height, bits, colors = struct.unpack(">IIBB", head[16:26])
    if bits != 8 or colors not in (2, 6):
        raise ValueError(f"{path}: not 8 bits of RGB or RGBA")
    return width, height


def _decoded(path, pixel_format, num_bytes):
    done = subprocess.run(["ffmpeg", "-v", "error", "-xerror", "-i", f"file:{path}", "-frames:v", "1", "-f", "rawvideo",
                           "-pix_fmt", pixel_format, "-"], capture_output=True, stdin=subprocess.DEVNULL)
    if done.returncode != 0 or done.stderr or len(done.stdout) != num_bytes:
        raise ValueError(f"{path}: {len(done.stdout)} of {num_bytes} bytes: {done.stderr.decode().strip()}")
    return done.stdout
