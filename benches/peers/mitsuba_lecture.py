#!/usr/bin/env python3
"""How fast Mitsuba 3 renders the lecture scene on this CPU, and to what error.

Usage:

    pip install mitsuba numpy
    python3 mitsuba_lecture.py                      # the figures; needs an idle machine
    python3 mitsuba_lecture.py --size 160 --reference-spp 32   # a quick look
    python3 mitsuba_lecture.py --truth truth.npy    # error against a given image as well

Needs an LLVM for Dr.Jit, named in DRJIT_LIBLLVM_PATH (Debian: `libllvm19`; LLVM 15 and 16 abort on
recent CPUs). Without the variable, an LLVM 19 in Debian's place is used.

Two integrators are measured, both with at most 64 scattering events and with Mitsuba's roulette
(from the fifth bounce on, survival = min(.95, largest throughput component times eta squared)):

- `path`: Mitsuba's own, BSDF sampling and light sampling combined by MIS;
- `bsdf`: the same loop without light sampling, written below against Mitsuba's Python interface.
  Dr.Jit compiles it to machine code exactly as it compiles `path`.

Method. After one warm-up render, which compiles the kernel, K = reference_spp/spp renders (at
least 8) with different seeds are timed one by one, each of `spp` samples a pixel, from the call of
`mi.render` until the image is in host memory. Printed, as JSON on stdout:

- paths_per_second: width * height * spp over the median time of a render. A path is one camera
  sample;
- relative_mse: mean over pixels and channels of v/(r^2 + .01), with v the unbiased sample variance
  of the K renders in that pixel and r^2 the square of their mean *minus* v/K, so that the noise of
  the mean is corrected for. That is E[(x - r)^2/(r^2 + .01)] of one render x of `spp` samples
  against the renderer's own converged image r: its noise, without its bias;
- seconds_times_relative_mse: the median time of a render times that. It does not depend on spp;
  lower is better;
- mean and bias_percent: of the image, against the truth given in TRUTH_MEAN below;
- with --truth, truth_relative_mse and seconds_times_truth_relative_mse: error of one render
  against that image, bias included (`.npy`, (size, size, 3), linear RGB, rows from the top; its
  own noise is taken to be zero).

The scene has walls of radius 1000, and Mitsuba works in single precision: with light sampling the
image comes out too dark (-3.7 % in red), without it the mean is right to .03 %. That is part of
what is compared: see bias_percent.
"""

import argparse
import json
import os
import pathlib
import platform
import sys
import time

# Debian's place for LLVM 19; Dr.Jit looks at the variable when it is loaded.
if not os.environ.get("DRJIT_LIBLLVM_PATH"):
    for _path in sorted(pathlib.Path("/usr/lib").glob("*/libLLVM.so.19*")):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(_path)
        break

import drjit as dr
import mitsuba as mi
import numpy as np

MAX_BOUNCES = 64
ROULETTE_DEPTH = 5  # Mitsuba's default

# Mean over the image, from two independent double-precision tracers; standard error 5e-5.
TRUTH_MEAN = np.array([0.95042, 0.60029, 0.90973])

# (name, centre, radius, albedo, emission)
SPHERES = [
    ("red_wall", [-1001.0, 0.0, 0.0], 1000.0, [1.0, 0.0, 0.0], None),
    ("blue_wall", [1001.0, 0.0, 0.0], 1000.0, [0.0, 0.0, 1.0], None),
    ("back_wall", [0.0, 0.0, 1001.0], 1000.0, [0.5, 0.5, 0.5], None),
    ("floor", [0.0, -1001.0, 0.0], 1000.0, [0.5, 0.5, 0.5], None),
    ("ceiling", [0.0, 1001.0, 0.0], 1000.0, [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]),
    ("yellow", [-0.6, -0.7, -0.6], 0.3, [1.0, 1.0, 0.0], None),
    ("cyan", [0.3, -0.4, 0.3], 0.6, [0.878, 1.0, 1.0], None),
]


def lecture_scene(size):
    """Mitsuba's scene dictionary for the lecture scene, without an integrator.

    Mitsuba's camera is right-handed and the scene's is left-handed: the image comes out mirrored,
    and `render` mirrors it back. Neither time nor error depends on that.
    """
    scene = {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at(
                origin=[0.0, 0.0, -4.0], target=[0.0, 0.0, 6.0], up=[0.0, 1.0, 0.0]
            ),
            "fov": 36.0,
            "fov_axis": "y",
            "film": {
                "type": "hdrfilm",
                "width": size,
                "height": size,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
                "sample_border": False,
            },
            "sampler": {"type": "independent"},
        },
    }
    for name, center, radius, albedo, emission in SPHERES:
        scene[name] = {
            "type": "sphere",
            "center": center,
            "radius": radius,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}},
        }
        if emission is not None:
            scene[name]["emitter"] = {
                "type": "area",
                "radiance": {"type": "rgb", "value": emission},
            }
    return scene


def register_bsdf_integrator():
    """Register the integrator `bsdf_path`: Mitsuba's `path` without light sampling.

    To be called after the variant is set: the class depends on it.
    """

    class BsdfPath(mi.SamplingIntegrator):
        """BSDF sampling, emission wherever a path meets it, Mitsuba's roulette."""

        def __init__(self, properties):
            super().__init__(properties)
            self.max_depth = properties.get("max_depth", MAX_BOUNCES + 1)
            self.rr_depth = properties.get("rr_depth", ROULETTE_DEPTH)

        @dr.syntax
        def sample(self, scene, sampler, ray, medium=None, active=True):
            """Radiance along the camera rays; (radiance, valid, no further channels)."""
            ray = mi.Ray3f(ray)
            active = mi.Bool(active)
            radiance = mi.Spectrum(0.0)
            throughput = mi.Spectrum(1.0)
            eta = mi.Float(1.0)
            depth = mi.UInt32(0)
            valid = mi.Bool(False)
            context = mi.BSDFContext()
            while active:
                hit = scene.ray_intersect(
                    ray, ray_flags=mi.RayFlags.All, coherent=depth == 0, active=active
                )
                valid |= hit.is_valid()
                radiance += throughput * hit.emitter(scene, active).eval(hit, active)

                active &= hit.is_valid() & (depth + 1 < self.max_depth)
                sample, weight = hit.bsdf(ray).sample(
                    context, hit, sampler.next_1d(active), sampler.next_2d(active), active
                )
                ray = hit.spawn_ray(hit.to_world(sample.wo))
                throughput *= weight
                eta *= sample.eta
                depth += 1

                largest = dr.max(throughput)
                survival = dr.minimum(largest * dr.square(eta), 0.95)
                roulette = depth >= self.rr_depth
                survives = sampler.next_1d(active) < survival
                throughput[roulette] *= dr.rcp(survival)
                active &= (largest != 0.0) & (~roulette | survives)
            return radiance, valid, []

    mi.register_integrator("bsdf_path", lambda properties: BsdfPath(properties))


def measure(name, options, truth):
    """Time and error of one integrator, as a dictionary of plain numbers."""
    plugin = {"path": "path", "bsdf": "bsdf_path"}[name]
    scene = mi.load_dict(lecture_scene(options.size))
    integrator = mi.load_dict(
        {"type": plugin, "max_depth": MAX_BOUNCES + 1, "rr_depth": ROULETTE_DEPTH}
    )

    def render(seed):
        image = np.array(mi.render(scene, integrator=integrator, seed=seed, spp=options.spp))
        return image[:, ::-1].astype(np.float64)

    start = time.perf_counter()
    render(options.seed)
    warm_up = time.perf_counter() - start

    count = max(options.reference_spp // options.spp, 8)
    seconds = []
    mean = np.zeros((options.size, options.size, 3))
    squares = np.zeros_like(mean)  # sum of squared deviations from the running mean
    against_truth = []
    for index in range(count):
        start = time.perf_counter()
        image = render(options.seed + 1 + index)
        seconds.append(time.perf_counter() - start)
        deviation = image - mean
        mean += deviation / (index + 1)
        squares += deviation * (image - mean)
        if truth is not None:
            against_truth.append(float(((image - truth) ** 2 / (truth**2 + 0.01)).mean()))

    variance = squares / (count - 1)
    mean_squared = np.maximum(mean**2 - variance / count, 0.0)
    relative_mse = float((variance / (mean_squared + 0.01)).mean())
    median = float(np.median(seconds))
    image_mean = mean.mean(axis=(0, 1))
    result = {
        "renders": count,
        "seconds_warm_up": warm_up,
        "seconds": {"median": median, "minimum": min(seconds), "maximum": max(seconds)},
        "paths_per_second": options.size**2 * options.spp / median,
        "relative_mse": relative_mse,
        "seconds_times_relative_mse": median * relative_mse,
        "mean": image_mean.tolist(),
        "mean_standard_error": (
            np.sqrt((variance / count).sum(axis=(0, 1))) / options.size**2
        ).tolist(),
        "bias_percent": (100.0 * (image_mean / TRUTH_MEAN - 1.0)).tolist(),
        "non_finite": int((~np.isfinite(mean)).sum()),
    }
    if truth is not None:
        result["truth_relative_mse"] = float(np.mean(against_truth))
        result["seconds_times_truth_relative_mse"] = median * result["truth_relative_mse"]
    return result


def cpu_name():
    """The processor's name, as far as the system tells."""
    try:
        for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor()


def main():
    """Measure what the command line asks for and print JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=640, help="width and height in pixels")
    parser.add_argument("--spp", type=int, default=16, help="samples a pixel in one render")
    parser.add_argument(
        "--reference-spp", type=int, default=512, help="samples a pixel of the converged mean"
    )
    parser.add_argument("--integrator", choices=["path", "bsdf"], action="append")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--truth", type=pathlib.Path, help="true image, .npy, for the bias")
    options = parser.parse_args()

    mi.set_variant(options.variant)
    if options.threads:
        dr.set_thread_count(options.threads)
    register_bsdf_integrator()

    truth = None
    if options.truth is not None:
        truth = np.load(options.truth).astype(np.float64)
        if truth.shape != (options.size, options.size, 3):
            sys.exit(f"{options.truth}: shape {truth.shape}, not {(options.size,) * 2 + (3,)}")

    report = {
        "renderer": "Mitsuba",
        "version": mi.__version__,
        "drjit": dr.__version__,
        "variant": options.variant,
        "threads": dr.thread_count(),
        "cpu": cpu_name(),
        "load_average_before": os.getloadavg()[0],
        "scene": "lecture",
        "size": options.size,
        "spp": options.spp,
        "max_bounces": MAX_BOUNCES,
        "roulette_depth": ROULETTE_DEPTH,
        "seed": options.seed,
        "integrators": {},
    }
    for name in options.integrator or ["path", "bsdf"]:
        report["integrators"][name] = measure(name, options, truth)
    print(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()
