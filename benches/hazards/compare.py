#!/usr/bin/env python3
"""Adds Mitsuba 3 to what the benchmark `hazards` rendered, and prints and draws the comparison.

Usage (what `cargo xtask bench hazards` does, in an environment of its own):

    pip install mitsuba numpy pillow
    cargo bench --bench hazards -- FOLDER
    python3 compare.py FOLDER --panel panel.png

FOLDER holds, for every scene, a description SCENE.json and files SCENE.RENDERER of f64 numbers of
shape (batches, height, width, 3); Mitsuba's are added. Statistics, on the mean of the channels:

- An error is the difference to the truth, batch by batch; its standard error comes from the spread
  over the batches. The kernel and the truth trace the same paths with the same random numbers, so
  that their difference is rounding alone. All others have the noise of both in it.
- A block is 8x8 pixels. It is bad if it is off by more than 1 % and by more than 5 standard errors
  (with 4, one in eleven sound images of 256 blocks would have a bad one; with 5, one in 180).
- `right`: no bad block, and the image's mean within 0.1 % or 4 standard errors. `wrong`: the mean is
  off by more than 1 %, or more than 5 % of the blocks are bad. `off`: all between.

Mitsuba runs its integrator `path` and, where there is an LLVM for Dr.Jit (see
benches/peers/peer.py), that without emitter sampling; 64 scattering events at most, its
own roulette, everything else at its defaults.
"""

import argparse
import json
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "peers"))

import numpy as np
from peer import ROULETTE_DEPTH, cpu_name, mi, start
from PIL import Image, ImageDraw, ImageFont

BLOCK = 8
BAD_ERRORS = 5.0
SCENES = {
    "lecture": ("lecture", "walls R = 1000"),
    "room-5e3": ("room", "walls R = 5000"),
    "room-1e5": ("the same room", "walls R = 1e5"),
    "ground-1e6": ("balls", "ground R = 1e6"),
    "balls": ("balls", "ground R = 20"),
    "balls-moved": ("balls on R = 20", "moved by 1e5"),
    "shell": ("glass shell", "1e-5 thick, R = 1"),
}
RENDERERS = {
    "gpu-trace": "gpu-trace, f32",
    "naive": "naive, f32, nudge 1e-4",
    "mitsuba-path": "Mitsuba `path`",
    "mitsuba-bsdf": "Mitsuba, no emitter sampling",
}
SECOND_OPINIONS = {"naive-f64": "naive, f64, nudge 1e-4", "check": "naive, f64, nudge 1e-7"}
PANEL_SCENES = [name for name in SCENES if name != "balls"]
PANEL_RENDERERS = {"gpu-trace": "gpu-trace, f32", "naive": "naive, f32", "mitsuba-path": "Mitsuba 3.9"}


def mitsuba_scene(scene):
    """Mitsuba's dictionary for a description, without an integrator."""

    def rgb(value):
        return {"type": "rgb", "value": value}

    result = {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at(
                origin=scene["position"], target=scene["look_at"], up=scene["up"]
            ),
            "fov": scene["fov"],
            "fov_axis": "y",
            "film": {
                "type": "hdrfilm",
                "width": scene["width"],
                "height": scene["height"],
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
                "sample_border": False,
            },
            "sampler": {"type": "independent"},
        },
    }
    if any(scene["environment"]):
        result["environment"] = {"type": "constant", "radiance": rgb(scene["environment"])}
    for i, sphere in enumerate(scene["spheres"]):
        inside, around = sphere["ior"]
        bsdf = {
            "diffuse": {"type": "diffuse", "reflectance": rgb(sphere["color"])},
            "mirror": {
                "type": "conductor",
                "material": "none",
                "specular_reflectance": rgb(sphere["color"]),
            },
            "dielectric": {"type": "dielectric", "int_ior": inside, "ext_ior": around},
        }[sphere["kind"]]
        shape = {"center": sphere["center"], "radius": sphere["radius"]}
        result[f"sphere{i}"] = {"type": "sphere", "bsdf": bsdf, **shape}
        if any(sphere["emission"]):
            emitter = {"type": "area", "radiance": rgb(sphere["emission"])}
            result[f"sphere{i}"]["emitter"] = emitter
    return result


def render_mitsuba(folder, name, scene, integrators):
    """Writes FOLDER/NAME.mitsuba-* for all integrators."""
    loaded = mi.load_dict(mitsuba_scene(scene))
    for integrator, plugin in integrators.items():
        begin = time.perf_counter()
        integrator_object = mi.load_dict(
            {"type": plugin, "max_depth": scene["max_bounces"] + 1, "rr_depth": ROULETTE_DEPTH}
        )
        spp = scene["spp"] // scene["batches"]
        batches = []
        for seed in range(scene["batches"]):
            image = mi.render(loaded, integrator=integrator_object, seed=seed + 1, spp=spp)
            image = np.array(image).astype(np.float64)
            # Mitsuba's camera is right-handed.
            batches.append(image[:, ::-1] if scene["mirrored"] else image)
        np.stack(batches).tofile(folder / f"{name}.mitsuba-{integrator}")
        seconds = time.perf_counter() - begin
        print(f"{name} by Mitsuba, {integrator}: {seconds:.1f} s", file=sys.stderr)


def read(folder, name, scene, renderer):
    """All batches of a renderer, or None; numbers that are not finite count as zero."""
    path = folder / f"{name}.{renderer}"
    if not path.exists():
        return None
    shape = (scene["batches"], scene["height"], scene["width"], 3)
    images = np.fromfile(path, dtype="<f8").reshape(shape)
    broken = int((~np.isfinite(images)).sum())
    if broken:
        print(f"{name} by {renderer}: {broken} numbers are not finite", file=sys.stderr)
    return np.nan_to_num(images, nan=0.0, posinf=0.0, neginf=0.0)


def blocks_of(images, side):
    """Means over side x side pixels and channels, by batch."""
    count, height, width = images.shape[:3]
    cut = images.mean(axis=3).reshape(count, height // side, side, width // side, side)
    return cut.mean(axis=(2, 4))


def compare(images, truth):
    """Figures of a renderer as text: mean, worst block, bad blocks, verdict."""
    root = len(images) ** 0.5
    difference = blocks_of(images, BLOCK) - blocks_of(truth, BLOCK)
    level = blocks_of(truth, BLOCK).mean(axis=0)
    error = difference.mean(axis=0)
    # A standard error of zero means that not one bit differs.
    deviation = np.maximum(difference.std(axis=0, ddof=1) / root, 1e-300)
    relative, z = error / level, error / deviation
    image = difference.mean(axis=(1, 2))
    bias = image.mean() / level.mean()
    bias_error = image.std(ddof=1) / root / level.mean()
    bad = (abs(relative) > 0.01) & (abs(z) > BAD_ERRORS)
    # Of the bad blocks, if there are any.
    candidates = abs(relative) * bad if bad.any() else abs(relative)
    worst = np.unravel_index(np.argmax(candidates), z.shape)
    share = bad.mean()
    if share == 0.0 and abs(bias) <= max(0.001, 4.0 * bias_error):
        verdict = "right"
    elif abs(bias) > 0.01 or share > 0.05:
        verdict = "**wrong**"
    else:
        verdict = "off"
    return [
        f"{percent(bias)} ± {100.0 * bias_error:.2g}",
        f"{percent(relative[worst])} ({errors(abs(z[worst]))} SE)",
        f"{100.0 * share:.1f}",
        verdict,
    ]


def errors(z):
    """A number of standard errors; beyond some, they are not known."""
    return f"{z:.0f}" if z <= 999.0 else "> 999"


def percent(x):
    """A signed relative error in percent, to some three digits."""
    size = abs(100.0 * x)
    if 0.0 < size < 0.0005:
        return f"{100.0 * x:+.0e}"
    return f"{100.0 * x:+.{0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3}f}"


def srgb(image):
    """Eight-bit sRGB of linear radiance, as gpu-trace writes it."""
    x = np.clip(image, 0.0, 1.0)
    x = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)
    return Image.fromarray((255.0 * x + 0.5).astype(np.uint8))


def signed_colors(x):
    """Blue for -1 over white for 0 to red for 1."""
    x = np.clip(x, -1.0, 1.0)[..., None]
    red, blue, white = (np.array(c) for c in ([178, 24, 43], [33, 102, 172], [250, 250, 250]))
    # The square root shows small errors too.
    amount = np.sqrt(abs(x))
    colors = white + amount * (np.where(x > 0.0, red, blue) - white)
    return Image.fromarray(colors.astype(np.uint8))


def error_map(images, truth, full_scale):
    """Relative error over 4x4 pixels, in colours."""
    truth = blocks_of(truth, 4).mean(axis=0)
    return signed_colors((blocks_of(images, 4).mean(axis=0) / truth - 1.0) / full_scale)


def panel(data, path):
    """Draws images and error maps of all scenes."""
    cell, gap, left, top, bottom = 192, 6, 160, 62, 64
    full_scale = 0.5
    columns = 1 + 2 * len(PANEL_RENDERERS)
    middle = 1 + len(PANEL_RENDERERS)

    def x_of(column):
        return left + column * (cell + gap) + (3 * gap if column >= middle else 0)

    rows = [name for name in PANEL_SCENES if name in data]
    size = (x_of(columns - 1) + cell + gap, top + len(rows) * (cell + gap) + bottom)
    sheet = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(sheet)
    title, label = ImageFont.load_default(20), ImageFont.load_default(17)

    def text(x, y, words, font, anchor="ma", fill="black"):
        draw.text((x, y), words, font=font, anchor=anchor, fill=fill)

    headings = ["truth, f64", *PANEL_RENDERERS.values(), *PANEL_RENDERERS.values()]
    for column, heading in enumerate(headings):
        text(x_of(column) + cell // 2, 34, heading, label)
    text((x_of(0) + x_of(middle - 1) + cell) // 2, 6, "image", title)
    text((x_of(middle) + x_of(columns - 1) + cell) // 2, 6, "relative error against the truth", title)
    for row, name in enumerate(rows):
        y = top + row * (cell + gap)
        for line, words in enumerate(SCENES[name]):
            text(left - 10, y + cell // 2 - 22 + 24 * line, words, label, "ra")
        images = data[name]
        truth = images["truth"]
        pictures = [srgb(truth.mean(axis=0))]
        pictures += [srgb(images[r].mean(axis=0)) for r in PANEL_RENDERERS]
        pictures += [error_map(images[r], truth, full_scale) for r in PANEL_RENDERERS]
        for column, picture in enumerate(pictures):
            filtering = Image.Resampling.NEAREST if column >= middle else Image.Resampling.BICUBIC
            sheet.paste(picture.resize((cell, cell), filtering), (x_of(column), y))
            corner = (x_of(column) - 1, y - 1, x_of(column) + cell, y + cell)
            draw.rectangle(corner, outline=(150, 150, 150))

    # The scale under the error maps.
    begin, end = x_of(middle), x_of(columns - 1) + cell
    y = top + len(rows) * (cell + gap) + 10
    ramp = np.broadcast_to(np.linspace(-1.0, 1.0, end - begin), (18, end - begin))
    sheet.paste(signed_colors(ramp), (begin, y))
    draw.rectangle((begin - 1, y - 1, end, y + 18), outline=(150, 150, 150))
    for value in (-0.5, -0.3, -0.1, 0.0, 0.1, 0.3, 0.5):
        x = round(begin + (value / full_scale + 1.0) / 2.0 * (end - begin - 1))
        draw.line((x, y + 18, x, y + 24), fill="black")
        anchor = "la" if value == -0.5 else "ra" if value == 0.5 else "ma"
        sign = "" if value == 0.0 else "+" if value > 0 else "-"
        text(x, y + 27, f"{sign}{abs(100 * value):.0f} %", label, anchor)
    text(begin - 3 * gap, y, "errors in blocks of 4x4 pixels, all maps on this scale", label, "ra")
    sheet.save(path, optimize=True)


def main():
    """Render with Mitsuba, print the table, draw the panel."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--panel", type=pathlib.Path, help="PNG to draw")
    parser.add_argument("--no-render", action="store_true", help="use Mitsuba's earlier images")
    parser.add_argument("--scene", action="append", choices=SCENES)
    options = parser.parse_args()

    integrators = {"path": "path"}
    if start():
        integrators["bsdf"] = "bsdf_path"

    data, lines, opinions = {}, [], []
    for name in options.scene or SCENES:
        description = options.folder / f"{name}.json"
        if not description.exists():
            continue
        scene = json.loads(description.read_text())
        if not options.no_render:
            render_mitsuba(options.folder, name, scene, integrators)
        truth = read(options.folder, name, scene, "truth")
        data[name] = {"truth": truth}
        for renderer, words in RENDERERS.items():
            images = read(options.folder, name, scene, renderer)
            if images is not None:
                data[name][renderer] = images
                lines.append(f"| `{name}` | {words} | {' | '.join(compare(images, truth))} |")
        others = [compare(read(options.folder, name, scene, r), truth) for r in SECOND_OPINIONS]
        cells = " | ".join(f"{mean} | {bad} | {verdict}" for mean, _, bad, verdict in others)
        opinions.append(f"| `{name}` | {cells} |")
        title = f"{scene['width']}x{scene['height']}, {scene['spp']} spp in {scene['batches']} batches"
        device = scene["device"]
    if not data:
        sys.exit(f"{options.folder}: no scene; run `cargo bench --bench hazards -- FOLDER` first")
    peer = f"Mitsuba {mi.__version__} {mi.variant()}"
    print(f"{title}; gpu-trace and naive on {device}; {peer}; {cpu_name()}\n")
    print("| scene | renderer | mean, % | worst block, % | bad blocks, % | |")
    print("|---|---|---|---|---|---|")
    print("\n".join(lines))
    print("\nIs it the rounding or the nudge, and is the truth true? The naive algorithm in f64:\n")
    heads = "".join(f" {words}: mean, % | bad blocks, % | |" for words in SECOND_OPINIONS.values())
    print(f"| scene |{heads}\n|---{'|---' * 3 * len(SECOND_OPINIONS)}|")
    print("\n".join(opinions))
    if "balls" in data and "balls-moved" in data:
        moved = data["balls-moved"]["truth"].mean(axis=0) / data["balls"]["truth"].mean(axis=0) - 1.0
        print(f"\nMoved and unmoved truth differ in no pixel by more than {100.0 * abs(moved).max():.1g} %.")
    if options.panel:
        panel(data, options.panel)


if __name__ == "__main__":
    main()
