#!/usr/bin/env python3
"""Independent reference images, with their variance, rendered by Mitsuba 3.

Usage, in this folder:

    pip install mitsuba numpy
    python3 make.py                      # every scene here
    python3 make.py glass --batches 512  # one scene, more samples
    python3 make.py --summary            # accuracy of the images that are there

For each scene `NAME.toml` (the scene format of gpu-trace, as far as Mitsuba can render it) this
writes

    NAME.mean.npy      float32, (height, width, 3), rows from the top: linear RGB radiance
    NAME.variance.npy  the same shape: variance *of that mean*, from independent batches

and an entry in `references.json` (versions, samples, seed, SHA-256 of the scene file, accuracy).
The standard error of a pixel is sqrt(variance). It is estimated from B batches, so it is itself
uncertain by 1/sqrt(2 (B - 1)) of its value. The images in the repository were made with Mitsuba
3.9.1 (Dr.Jit 1.5.0, LLVM 19); `references.json` says what applies to each.

What had to be matched, all of it cross-checked against a double-precision tracer that shares no
code with Mitsuba:

- Camera. Mitsuba's `look_at` gives image right = forward x up, our "right"; for "left" the image
  is mirrored after rendering. Our angle of view is the full vertical one: `fov_axis = "y"`.
  The plane in focus is perpendicular to the view axis in both.
- Pixel filter: box, one pixel wide, so pixels are independent of each other.
- `max_bounces` scattering events are `max_depth = max_bounces + 1` path edges. Roulette is off.
- Emission. Ours radiates on both sides of a surface, Mitsuba's `area` only outwards. Therefore no
  scene here has a camera or a visible surface inside an emitter.
- Dielectrics: `ext_ior` is 1 (Mitsuba's default is air, 1.000277). Radiance is scaled by the
  square of the relative index on refraction in both.
- Microfacets: Mitsuba multiplies two of Smith's G1, the product correlates their heights; the tests of
  `rough_conductor` and `rough_glass` have the product of two G1 in the kernel instead. Tangents about
  an axis are the same, the axis being the polar one of Mitsuba's sphere.
- Images on spheres: Mitsuba's angle about the polar axis runs the other way, so that columns are
  reversed. It has one rule for both edges, ours wraps columns and keeps rows; an image here has equal
  first and last rows, for which both are the same.
- No lamp here has an image: Mitsuba 3.9.1 samples a sphere that emits one by another density than it
  states. One bounce by emitter sampling alone and by BSDF sampling alone (`direct`) differ by 4 % on a
  floor below such a lamp; ours agree with each other and with the latter.
- An image around all: Mitsuba has its first and last rows at the poles, ours are half a row from
  there. Twice as many rows and one more, with the values that ours has there, are the same function.
- Mitsuba is single precision: it is trusted here only because every sphere is small (radius 20
  at most, and near the camera). Do not add scenes with huge walls.

What remains wrong in these images is known and small. Mitsuba starts a scattered ray about
9e-5 (1 + |coordinate|) off the surface. Behind a refracting surface that magnifies what is inside
a glass ball by the same order: the black emitter in `emitters` has an apparent radius of .3751 in
place of n a = .375, which brightens the pixels on its rim by about .1 % and the whole image by
.005 % (13 standard errors in a close-up made for the purpose). Over the other images, Mitsuba and
double precision differ by .006 % or less in any channel, 2 standard errors.

Two things to know when testing against them. Pixels that see only the environment have a variance
of about zero and a mean that is rounded to single precision: give the denominator of a z-score a
floor of 1e-5 of the value. And on a rim a short render may not have met the brighter side yet, so
that its own variance is too small: take at least variance * spp, the variance of one sample here,
over its number of samples.

The integrator is `path`: it samples lights and combines with multiple importance sampling, which
changes the noise and not the expected value.
"""

import argparse
import hashlib
import json
import math
import os
import pathlib
import sys
import tomllib

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
NO_ROULETTE = 1_000_000  # rr_depth: roulette would begin after this many bounces


def choose_variant(mi, wanted):
    """Select `wanted`, or else the first variant that works: LLVM is faster than scalar."""
    if wanted is None and not os.environ.get("DRJIT_LIBLLVM_PATH"):
        # Debian's libllvm19. LLVM 15 and 16 abort on recent CPUs, so a version is named.
        for path in sorted(pathlib.Path("/usr/lib").glob("*/libLLVM.so.19*")):
            os.environ["DRJIT_LIBLLVM_PATH"] = str(path)
            break
    if wanted is None:
        wanted = "llvm_ad_rgb" if os.environ.get("DRJIT_LIBLLVM_PATH") else "scalar_rgb"
    mi.set_variant(wanted)
    return wanted


def read_image(mi, image):
    """Linear values of an image file beside the scenes; float64 (height, width, 3)."""
    bitmap = mi.Bitmap(str(HERE / image))
    linear = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    return np.array(linear, dtype=np.float64)


def color_to_texture(mi, value):
    """Mitsuba's texture for a colour, or for an image on a sphere that `on_axis` turns."""
    if isinstance(value, list):
        return {"type": "rgb", "value": value}
    if set(value) != {"image"}:
        sys.exit(f"Mitsuba has no equivalent of the texture {value}")
    pixels = read_image(mi, value["image"])
    if not (pixels[0] == pixels[-1]).all():
        sys.exit(f"{value['image']}: its first and last rows differ")
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(pixels[:, ::-1], dtype=np.float32)),
        "raw": True,
        "filter_type": "bilinear",
        "wrap_mode": "repeat",
    }


def on_axis(mi, material, sphere):
    """The transform of Mitsuba's unit sphere that has the material's axis for its polar one."""
    axis = np.array(material.get("axis", [0.0, 1.0, 0.0]), dtype=np.float64)
    axis /= np.linalg.norm(axis)
    # Rodrigues' formula for the shortest way from +y to the axis, which is not -y here.
    x, y, z = np.cross([0.0, 1.0, 0.0], axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + cross + cross @ cross / (1.0 + axis[1])
    # Mitsuba's angle is atan2(y, x) about z, ours atan2(x, -z) about y: here x is -z and y is -x.
    turn = turn @ np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
    matrix = np.eye(4)
    matrix[:3, :3] = float(sphere["radius"]) * turn
    matrix[:3, 3] = sphere["center"]
    return mi.ScalarTransform4f(matrix)


def environment_to_emitter(mi, environment):
    """Mitsuba's emitter for the `[environment]` table."""
    if "radiance" in environment:
        return {"type": "constant", "radiance": {"type": "rgb", "value": environment["radiance"]}}
    pixels = read_image(mi, environment["image"])
    edged = np.concatenate([pixels[:1], pixels, pixels[-1:]])
    between = 0.5 * (edged[1:] + edged[:-1])
    rows = np.empty((2 * len(pixels) + 1, *pixels.shape[1:]))
    rows[0::2], rows[1::2] = between, pixels
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(rows.astype(np.float32)),
        "scale": float(environment.get("scale", 1.0)),
        # From +x towards +z.
        "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], -environment.get("rotation", 0.0)),
    }


def alphas(material):
    """Roughness along both tangents."""
    alpha = material["roughness"] ** 2
    aspect = math.sqrt(1.0 - 0.9 * material.get("anisotropy", 0.0))
    return alpha / aspect, alpha * aspect


def material_to_bsdf(mi, material, name):
    """Mitsuba's BSDF for one `[material.NAME]` table."""
    kind = material["type"]
    if kind == "diffuse":
        return {"type": "diffuse", "reflectance": color_to_texture(mi, material["albedo"])}
    if kind == "conductor" and material.get("roughness", 0.0) > 0.0:
        alpha_u, alpha_v = alphas(material)
        return {
            "type": "roughconductor",
            "distribution": "ggx",
            "alpha_u": alpha_u,
            "alpha_v": alpha_v,
            "eta": {"type": "rgb", "value": material["eta"]},
            "k": {"type": "rgb", "value": material["k"]},
        }
    if kind == "dielectric" and material.get("roughness", 0.0) > 0.0:
        return {
            "type": "roughdielectric",
            "distribution": "ggx",
            "alpha": alphas(material)[0],
            "int_ior": float(material["ior"]),
            "ext_ior": 1.0,
        }
    if kind == "mirror":
        return {
            "type": "conductor",
            "material": "none",  # reflects everything
            "specular_reflectance": {"type": "rgb", "value": material["reflectance"]},
        }
    if kind == "dielectric":
        return {"type": "dielectric", "int_ior": float(material["ior"]), "ext_ior": 1.0}
    sys.exit(f"material {name}: Mitsuba has no equivalent of type {kind!r}")


def scene_to_mitsuba(mi, description, spp):
    """Mitsuba's scene dictionary for a parsed scene file."""
    camera = description["camera"]
    image = description["image"]
    lens = camera.get("aperture_radius", 0.0)
    sensor = {
        "type": "thinlens" if lens > 0.0 else "perspective",
        "to_world": mi.ScalarTransform4f().look_at(
            origin=camera["position"],
            target=camera["look_at"],
            up=camera.get("up", [0.0, 1.0, 0.0]),
        ),
        "fov": float(camera["fov"]),
        "fov_axis": "y",
        "near_clip": 1e-2,
        "far_clip": 1e4,
        "film": {
            "type": "hdrfilm",
            "width": image["width"],
            "height": image["height"],
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
            "sample_border": False,
        },
        "sampler": {"type": "independent", "sample_count": spp},
    }
    if lens > 0.0:
        sensor["aperture_radius"] = float(lens)
        sensor["focus_distance"] = float(camera["focus_distance"])

    max_bounces = description.get("render", {}).get("max_bounces", 64)
    scene = {
        "type": "scene",
        "integrator": {
            "type": "path",
            "max_depth": max_bounces + 1,
            "rr_depth": NO_ROULETTE,
            "hide_emitters": False,
        },
        "sensor": sensor,
    }
    if "environment" in description:
        scene["environment"] = environment_to_emitter(mi, description["environment"])
    for index, sphere in enumerate(description["sphere"]):
        name = sphere["material"]
        material = description["material"][name]
        shape = {
            "type": "sphere",
            "bsdf": material_to_bsdf(mi, material, name),
        }
        textured = any(isinstance(value, dict) for value in material.values())
        if textured or "anisotropy" in material:
            shape["to_world"] = on_axis(mi, material, sphere)
        else:
            shape["center"], shape["radius"] = sphere["center"], float(sphere["radius"])
        emission = material.get("emission", [0.0, 0.0, 0.0])
        if any(emission):
            if material["type"] == "dielectric":
                sys.exit(f"material {name}: Mitsuba cannot emit into a dielectric sphere")
            shape["emitter"] = {"type": "area", "radiance": color_to_texture(mi, emission)}
        scene[f"sphere_{index}"] = shape
    return scene


def render(mi, description, spp, batches, seed):
    """Mean image and variance of that mean from `batches` independent renders of `spp` samples.

    Returns two float64 arrays (height, width, 3). Batch i is rendered with Mitsuba's seed
    `seed + i`; the batches are combined by Welford's update in double precision. Batches are kept
    small because Mitsuba sums samples in single precision: at 1024 samples that alone is off by
    1e-5 of the value, the same way every time; at 128 by 1e-6.
    """
    scene = mi.load_dict(scene_to_mitsuba(mi, description, spp))
    mirrored = description["camera"].get("handedness", "right") == "left"
    mean = None
    squares = None  # sum of squared deviations from the running mean
    for batch in range(batches):
        image = np.array(mi.render(scene, seed=seed + batch, spp=spp), dtype=np.float64)
        if not np.isfinite(image).all():
            sys.exit(f"batch {batch}: non-finite pixels")
        if mirrored:
            image = image[:, ::-1]
        if mean is None:
            mean, squares = np.zeros_like(image), np.zeros_like(image)
        deviation = image - mean
        mean += deviation / (batch + 1)
        squares += deviation * (image - mean)
        if sys.stderr.isatty():
            print(f"\r  batch {batch + 1}/{batches}", end="", file=sys.stderr)
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr)
    return mean, squares / (batches - 1) / batches


def accuracy(mean, variance):
    """Numbers that say how good a reference is; the relative ones per pixel and channel."""
    mean, variance = mean.astype(np.float64), variance.astype(np.float64)
    relative = np.sqrt(variance) / mean
    floor = (0.1 * mean.mean()) ** 2
    return {
        "mean": [float(f"{x:.6g}") for x in mean.mean(axis=(0, 1))],
        "mean_standard_error": [
            float(f"{x:.3g}") for x in np.sqrt(variance.sum(axis=(0, 1))) / (mean[..., 0].size)
        ],
        "relative_standard_error_median": float(f"{np.median(relative):.3g}"),
        "relative_standard_error_95_percent": float(f"{np.quantile(relative, 0.95):.3g}"),
        "relative_standard_error_maximum": float(f"{relative.max():.3g}"),
        "share_within_0.3_percent": float(f"{(relative <= 0.003).mean():.4g}"),
        # The error measure of gpu-trace, as a fraction.
        "relative_error": float(f"{math.sqrt((variance / (mean**2 + floor)).mean()):.3g}"),
    }


def main():
    """Render what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="scenes; default: every NAME.toml here")
    parser.add_argument("--spp", type=int, default=128, help="samples a pixel in one batch")
    parser.add_argument("--batches", type=int, default=1024, help="independent batches, >= 64")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first batch")
    parser.add_argument("--variant", help="Mitsuba variant (default: llvm_ad_rgb where it works)")
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--output", type=pathlib.Path, default=HERE, help="folder to write to")
    parser.add_argument("--summary", action="store_true", help="only print what is there")
    options = parser.parse_args()
    if options.batches < 64:
        parser.error("the variance needs at least 64 batches")
    names = options.names or sorted(path.stem for path in HERE.glob("*.toml"))

    if options.summary:
        for name in names:
            mean = np.load(options.output / f"{name}.mean.npy")
            variance = np.load(options.output / f"{name}.variance.npy")
            print(name, json.dumps(accuracy(mean, variance)))
        return

    import mitsuba as mi

    variant = choose_variant(mi, options.variant)
    import drjit as dr  # needs the path of LLVM, so only now

    if options.threads and variant.startswith("llvm"):
        dr.set_thread_count(options.threads)

    record_path = options.output / "references.json"
    record = json.loads(record_path.read_text()) if record_path.exists() else {}
    for name in names:
        source = (HERE / f"{name}.toml").read_bytes()
        description = tomllib.loads(source.decode())
        mean, variance = render(mi, description, options.spp, options.batches, options.seed)
        mean, variance = mean.astype(np.float32), variance.astype(np.float32)
        np.save(options.output / f"{name}.mean.npy", mean)
        np.save(options.output / f"{name}.variance.npy", variance)
        record[name] = {
            "scene_sha256": hashlib.sha256(source).hexdigest(),
            "mitsuba": mi.__version__,
            "drjit": dr.__version__,
            "variant": variant,
            "integrator": "path",
            "max_depth": description.get("render", {}).get("max_bounces", 64) + 1,
            "roulette": False,
            "spp_per_batch": options.spp,
            "batches": options.batches,
            "spp": options.spp * options.batches,
            "seed": options.seed,
            **accuracy(mean, variance),
        }
        record_path.write_text(json.dumps(dict(sorted(record.items())), indent=2) + "\n")
        print(name, json.dumps(record[name]), flush=True)


if __name__ == "__main__":
    main()
