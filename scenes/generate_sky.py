"""Writes sky.exr: a clear sky with a sun, 64 x 32 texels, as sky.toml has it.

Luminance is that of the clear sky of CIE S 011 (type 12): gradation (1 + a exp(b/cos)), a = -1, b = -0.32, and
indicatrix 1 + c (exp(d g) - exp(d pi/2)) + e cos^2 g, c = 10, d = -3, e = 0.45, for the angle g to the sun. At the
zenith it is 1/4. The sun sends 22.5 of the zenith's luminance, times a steradian, as at 90 klx and 4 kcd/m^2; all of
that comes from one texel, so that shadows are softer than the real sun's. Colours are a guess: blue, whiter near the
horizon and near the sun. Below the horizon there is a gray ground.

    python3 generate_sky.py
"""

import math
import struct
import zlib
from pathlib import Path

WIDTH, HEIGHT = 64, 32
# The sun's texel; scenes turn it to where they want it.
SUN = (16, 9)
ZENITH = 0.25
LUMINANCE = (0.2126, 0.7152, 0.0722)


def direction(column, row):
    u, v = (column + 0.5) / WIDTH, (row + 0.5) / HEIGHT
    sine = math.sin(math.pi * v)
    return (
        sine * math.sin(2 * math.pi * u),
        math.cos(math.pi * v),
        -sine * math.cos(2 * math.pi * u),
    )


TO_SUN = direction(*SUN)


def relative_luminance(cosine, angle):
    gradation = 1 - math.exp(-0.32 / cosine)
    return gradation * (
        1 + 10 * (math.exp(-3 * angle) - math.exp(-1.5 * math.pi)) + 0.45 * math.cos(angle) ** 2
    )


def colour(luminance, tint):
    own = sum(a * b for a, b in zip(LUMINANCE, tint))
    return [luminance * channel / own for channel in tint]


def texel(column, row):
    w = direction(column, row)
    if w[1] <= 0:
        return colour(0.46, (1.0, 0.94, 0.86))
    angle = math.acos(min(1.0, sum(a * b for a, b in zip(w, TO_SUN))))
    zenith = relative_luminance(1.0, math.acos(TO_SUN[1]))
    luminance = ZENITH * relative_luminance(w[1], angle) / zenith
    white = min(1.0, 0.75 * (1 - w[1]) ** 4 + 0.5 * math.exp(-3.5 * angle))
    value = colour(luminance, [a + white * (1.0 - a) for a in (0.22, 0.42, 1.0)])
    if (column, row) == SUN:
        edges = [math.cos(math.pi * (row + i) / HEIGHT) for i in (0, 1)]
        solid_angle = 2 * math.pi / WIDTH * (edges[0] - edges[1])
        sun = colour(22.5 * ZENITH / solid_angle, (1.0, 0.93, 0.82))
        value = [a + b for a, b in zip(value, sun)]
    return value


def attribute(name, kind, data):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data


def packed(block):
    """ZIP of OpenEXR: bytes in two halves, differences, deflate."""
    halves = block[0::2] + block[1::2]
    steps = bytes([halves[0]]) + bytes(
        (b - a + 128) & 255 for a, b in zip(halves, halves[1:])
    )
    return zlib.compress(steps, 9)


def exr(texels):
    channels = b"".join(
        name + b"\0" + struct.pack("<iB3xii", 1, 0, 1, 1) for name in (b"B", b"G", b"R")
    )
    window = struct.pack("<4i", 0, 0, WIDTH - 1, HEIGHT - 1)
    header = struct.pack("<2I", 20000630, 2) + b"".join(
        [
            attribute("channels", "chlist", channels + b"\0"),
            attribute("compression", "compression", b"\3"),
            attribute("dataWindow", "box2i", window),
            attribute("displayWindow", "box2i", window),
            attribute("lineOrder", "lineOrder", b"\0"),
            attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
            attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
            attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
            b"\0",
        ]
    )
    chunks = []
    for first in range(0, HEIGHT, 16):
        lines = texels[first : first + 16]
        block = b"".join(
            struct.pack(f"<{WIDTH}e", *(texel[channel] for texel in line))
            for line in lines
            for channel in (2, 1, 0)
        )
        data = packed(block)
        chunks.append(struct.pack("<2i", first, len(data)) + data)
    offsets, place = [], len(header) + 8 * len(chunks)
    for chunk in chunks:
        offsets.append(place)
        place += len(chunk)
    return header + struct.pack(f"<{len(offsets)}Q", *offsets) + b"".join(chunks)


texels = [[texel(column, row) for column in range(WIDTH)] for row in range(HEIGHT)]
Path(__file__).with_name("sky.exr").write_bytes(exr(texels))
