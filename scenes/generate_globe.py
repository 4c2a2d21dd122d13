"""Writes globe.png: land and sea with ice at both poles, 256 x 128 texels, as textures.toml has it.

The coasts are a sum of waves on the sphere, so that there is no seam; every 30 degrees there is a line, and the line of
longitude 0, at U = 0, is red.

    python3 generate_globe.py
"""

import math
import struct
import zlib
from pathlib import Path

WIDTH, HEIGHT = 256, 128
SEA, SHALLOW, LAND, HILLS, ICE = (24, 60, 120), (50, 120, 160), (70, 120, 50), (150, 120, 70), (235, 240, 245)


def direction(column, row):
    u, v = (column + 0.5) / WIDTH, (row + 0.5) / HEIGHT
    sine = math.sin(math.pi * v)
    return (sine * math.sin(2 * math.pi * u), math.cos(math.pi * v), -sine * math.cos(2 * math.pi * u))


def waves():
    """Directions, frequencies and phases by a fixed sequence: the same file each time."""
    state = 12345
    found = []
    for octave in range(4):
        for _ in range(6):
            numbers = []
            for _ in range(4):
                state = (1103515245 * state + 12345) % 2**31
                numbers.append(state / 2**31)
            x, y, z, phase = numbers
            found.append(((2 * x - 1, 2 * y - 1, 2 * z - 1), 2.6 * 2**octave, 2 * math.pi * phase, 0.6**octave))
    return found


WAVES = waves()


def height(w):
    return sum(
        size * math.sin(frequency * sum(a * b for a, b in zip(axis, w)) + phase)
        for axis, frequency, phase, size in WAVES
    )


def near_line(x, step):
    """Whether a texel, of which `x` is the middle and 1 the width, is next to a multiple of `step`."""
    rest = x % step
    return min(rest, step - rest) < 0.6


def texel(column, row):
    if near_line(column + 0.5, WIDTH) and column in (0, WIDTH - 1):
        return (200, 40, 40)
    if near_line(column + 0.5, WIDTH / 12) or near_line(row + 0.5, HEIGHT / 6):
        return (20, 30, 50)
    w = direction(column, row)
    h = height(w)
    if abs(w[1]) > 0.93 - 0.02 * h:
        return ICE
    if h < -0.2:
        return SEA
    if h < 0.3:
        return SHALLOW
    return HILLS if h > 1.6 else LAND


def chunk(kind, data):
    body = kind + data
    return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))


def main():
    rows = b"".join(
        b"\0" + bytes(value for column in range(WIDTH) for value in texel(column, row)) for row in range(HEIGHT)
    )
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    Path(__file__).with_name("globe.png").write_bytes(png)


if __name__ == "__main__":
    main()
