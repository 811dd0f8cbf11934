"""Reads 8-bit RGB PNG files: enough to check ours without a picture library."""

import struct
import zlib

import numpy as np


def _paeth(left, up, corner):
    estimate = left + up - corner
    distances = (abs(estimate - left), abs(estimate - up), abs(estimate - corner))
    return (left, up, corner)[distances.index(min(distances))]


def read(path):
    """Array (height, width, 3), uint8. Raises ValueError for anything but a whole 8-bit RGB picture."""
    data = path.read_bytes()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path}: not a PNG")
    place, packed, size = 8, b"", None
    while place < len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        body = data[place + 8 : place + 8 + length]
        if zlib.crc32(kind + body) != struct.unpack(">I", data[place + 8 + length : place + 12 + length])[0]:
            raise ValueError(f"{path}: checksum of {kind}")
        if kind == b"IHDR":
            size = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        place += 12 + length
    width, height, depth, colors, _, _, interlaced = size
    if (depth, colors, interlaced) != (8, 2, 0):
        raise ValueError(f"{path}: not 8-bit RGB")
    return _unfilter(zlib.decompress(packed), width, height)


def _unfilter(raw, width, height):
    step = 1 + 3 * width
    above = bytes(3 * width)
    rows = []
    for y in range(height):
        kind, line = raw[y * step], bytearray(raw[y * step + 1 : (y + 1) * step])
        for i in range(len(line) if kind else 0):
            left = line[i - 3] if i >= 3 else 0
            corner = above[i - 3] if i >= 3 else 0
            add = (0, left, above[i], (left + above[i]) // 2, 0)[kind] if kind < 4 else _paeth(left, above[i], corner)
            line[i] = (line[i] + add) & 255
        above = bytes(line)
        rows.append(above)
    return np.frombuffer(b"".join(rows), np.uint8).reshape(height, width, 3)
