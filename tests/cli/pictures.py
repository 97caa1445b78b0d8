"""Reads the pictures that commands write, without the libraries that wrote them."""

import struct
import zlib
from pathlib import Path


def read_png(path):
    """Width, height and rows of RGBA bytes of an 8-bit RGBA PNG, or one with a colour map. Knows the five filters, not interlacing."""
    data = Path(path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path} is no PNG"
    at, packed, colours, opacity = 8, b"", b"", b""
    while at < len(data):
        (size,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert color == 3 or (depth, color) == (8, 6), f"{path}: depth {depth}, colour type {color}"
        elif kind == b"PLTE":
            colours = body
        elif kind == b"tRNS":
            opacity = body
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    step = 4 if color == 6 else 1  # bytes from a pixel to the next, for the filters
    raw, stride = zlib.decompress(packed), width * 4 if color == 6 else (width * depth + 7) // 8
    rows, above = [], bytes(stride)
    for y in range(height):
        method, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for x in range(stride):
            left = line[x - step] if x >= step else 0
            corner = above[x - step] if x >= step else 0
            if method == 1:
                line[x] = (line[x] + left) & 255
            elif method == 2:
                line[x] = (line[x] + above[x]) & 255
            elif method == 3:
                line[x] = (line[x] + (left + above[x]) // 2) & 255
            elif method == 4:
                p = left + above[x] - corner
                near = min((abs(p - left), 0, left), (abs(p - above[x]), 1, above[x]), (abs(p - corner), 2, corner))
                line[x] = (line[x] + near[2]) & 255
        rows.append(bytes(line))
        above = rows[-1]
    if color == 3:
        opacity += b"\xff" * (len(colours) // 3 - len(opacity))
        mapped = [colours[3 * i : 3 * i + 3] + opacity[i : i + 1] for i in range(len(opacity))]
        shifts = [(x * depth // 8, 8 - depth - x * depth % 8) for x in range(width)]
        rows = [b"".join(mapped[row[at] >> shift & (1 << depth) - 1] for at, shift in shifts) for row in rows]
    return width, height, rows


def alphas(rows):
    return [row[x] for row in rows for x in range(3, len(row), 4)]
