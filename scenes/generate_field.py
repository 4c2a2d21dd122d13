#!/usr/bin/env python3
"""Write field.toml: about 480 spheres of all materials on a floor of radius 1000.

Run it in this folder: python3 generate_field.py > field.toml
The numbers come from a small generator of its own, so every Python writes the same file.
"""

import math

COUNT = 480  # with the floor
FLOOR = 1000.0
HEADER = """\
# {count} spheres of all materials on a floor of radius 1000, under a sky, seen through a thin lens that
# is focused on the large glass sphere. Written by generate_field.py: change that, not this.

[camera]
position = [0.0, 2.1, 9.0]
look_at = [0.0, 0.55, 0.0]
fov = 34.0
aperture_radius = 0.06
focus_distance = 8.6

[image]
width = 960
height = 540

[render]
max_bounces = 32

[environment]
radiance = [0.55, 0.7, 1.0]
"""


class Random:
    """SplitMix64 (Steele, Lea, Flood 2014): numbers in [0, 1)."""

    def __init__(self, seed):
        self.state = seed

    def __call__(self, low=0.0, high=1.0):
        mask = (1 << 64) - 1
        self.state = (self.state + 0x9E3779B97F4A7C15) & mask
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        z ^= z >> 31
        return low + (high - low) * (z >> 11) / (1 << 53)


def hsv(hue, saturation, value):
    """A colour by hue in [0, 1)."""
    channel = lambda n: value - value * saturation * max(
        0.0, min((n + hue * 6) % 6, 4 - (n + hue * 6) % 6, 1)
    )
    return [channel(5), channel(3), channel(1)]


def vector(values):
    return "[" + ", ".join(f"{round(value, 4)!r}" for value in values) + "]"


def materials():
    """Name -> (type, values), in the order of the file."""
    table = {"floor": ("diffuse", {"albedo": [0.32, 0.33, 0.30]})}
    for index in range(12):
        table[f"paint-{index}"] = ("diffuse", {"albedo": hsv(index / 12, 0.75, 0.8)})
    table["chalk"] = ("diffuse", {"albedo": [0.8, 0.8, 0.8]})
    table["silver"] = ("mirror", {"reflectance": [0.95, 0.95, 0.95]})
    table["gold"] = ("mirror", {"reflectance": [0.95, 0.72, 0.3]})
    table["copper"] = ("mirror", {"reflectance": [0.93, 0.58, 0.45]})
    table["glass"] = ("dielectric", {"ior": 1.5})
    table["diamond"] = ("dielectric", {"ior": 2.4})
    for name, albedo in (("jade", [0.08, 0.3, 0.16]), ("lacquer", [0.34, 0.04, 0.05])):
        lobe = {"specular": [0.9, 0.9, 0.9], "epsilon": 0.01, "mu": 10.0}
        table[name] = ("reflective", {"albedo": albedo, **lobe})
    lamp = {"albedo": [0.0, 0.0, 0.0]}
    table["lamp-warm"] = ("diffuse", {**lamp, "emission": [9.0, 5.5, 2.5]})
    table["lamp-cold"] = ("diffuse", {**lamp, "emission": [3.0, 5.0, 9.0]})
    return table


def on_floor(x, z, radius):
    """The centre of a sphere that touches the floor at its foot, a hair above it."""
    distance = FLOOR + radius
    return [x, math.sqrt(distance**2 - x * x - z * z) - FLOOR + 1e-4, z]


def spheres():
    """(centre, radius, material): three large ones, then small ones wherever there is room."""
    random = Random(2025)
    placed = [
        (on_floor(-2.3, -0.3, 1.0), 1.0, "gold"),
        (on_floor(0.0, 0.6, 1.0), 1.0, "glass"),
        (on_floor(2.3, -0.3, 1.0), 1.0, "lacquer"),
    ]
    while len(placed) < COUNT - 1:
        # Larger ones first; denser in the middle.
        progress = len(placed) / COUNT
        radius = random(0.1, 0.34 - 0.2 * progress)
        angle = random(0.0, 2.0 * math.pi)
        reach = 11.0 * math.sqrt(random())
        x, z = reach * math.cos(angle), reach * math.sin(angle) - 3.0
        pick, which = random(), random()
        centre = on_floor(x, z, radius)
        if z > 5.5 or any(math.dist(centre, c) < radius + r + 0.01 for c, r, _ in placed):
            continue
        if pick < 0.5:
            name = f"paint-{int(which * 12)}"
        elif pick < 0.58:
            name = "chalk"
        elif pick < 0.72:
            name = ("silver", "gold", "copper")[int(which * 3)]
        elif pick < 0.86:
            name = ("glass", "diamond")[int(which * 2)]
        elif pick < 0.96:
            name = ("jade", "lacquer")[int(which * 2)]
        else:
            name = ("lamp-warm", "lamp-cold")[int(which * 2)]
        placed.append((centre, radius, name))
    return [([0.0, -FLOOR, 0.0], FLOOR, "floor")] + placed


def main():
    print(HEADER.format(count=COUNT))
    for name, (kind, values) in materials().items():
        print(f'[material.{name}]\ntype = "{kind}"')
        for key, value in values.items():
            print(f"{key} = {vector(value) if isinstance(value, list) else value}")
        print()
    blocks = (
        f'[[sphere]]\ncenter = {vector(centre)}\nradius = {round(radius, 4)!r}\nmaterial = "{name}"'
        for centre, radius, name in spheres()
    )
    print("\n\n".join(blocks))


main()
