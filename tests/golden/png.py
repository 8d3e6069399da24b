"""Reads PNG pictures as the program writes them: 8 bits, RGB or RGBA, not interlaced."""
import struct
import zlib


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
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path}: not a PNG")
    chunks = list(_chunks(data))
    width, height, bits, colors, _, _, interlaced = struct.unpack(">IIBBBBB", chunks[0][1])
    if bits != 8 or colors not in (2, 6) or interlaced:
        raise ValueError(f"{path}: only 8-bit RGB or RGBA without interlacing is supported")
    channels = 3 if colors == 2 else 4
    packed = b"".join(body for name, body in chunks if name == b"IDAT")
    raw = _unfiltered(zlib.decompress(packed), height, width * channels, channels)
    if channels == 4:
        del raw[3::4]
    return Picture(width, height, bytes(raw))


def _chunks(data):
    at = 8
    while at < len(data):
        size, name = struct.unpack(">I4s", data[at:at + 8])
        yield name, data[at + 8:at + 8 + size]
        at += 12 + size


def _unfiltered(data, height, stride, channels):
    """Undoes the filters of PNG (second edition), section 9."""
    picture = bytearray()
    above = bytearray(stride)
    for row in range(height):
        start = row * (stride + 1)
        line = bytearray(data[start + 1:start + 1 + stride])
        _unfilter_line(data[start], line, above, channels)
        picture += line
        above = line
    return picture


def _unfilter_line(kind, line, above, channels):
    for i in range(len(line) if kind else 0):
        left = line[i - channels] if i >= channels else 0
        corner = above[i - channels] if i >= channels else 0
        predicted = (0, left, above[i], (left + above[i]) // 2, _paeth(left, above[i], corner))[kind]
        line[i] = (line[i] + predicted) & 255


def _paeth(left, up, corner):
    to_left, to_up, to_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
    if to_left <= to_up and to_left <= to_corner:
        return left
    return up if to_up <= to_corner else corner
