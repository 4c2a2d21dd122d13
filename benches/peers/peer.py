"""Mitsuba 3 as a peer: its variant, our scenes in it, and its `path` without emitter sampling."""

import os
import pathlib
import platform
import sys
import time

# Debian's place for LLVM 19 (15 and 16 abort on recent CPUs); Dr.Jit looks at the variable when it
# is loaded.
if not os.environ.get("DRJIT_LIBLLVM_PATH"):
    for _path in sorted(pathlib.Path("/usr/lib").glob("*/libLLVM.so.19*")):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(_path)
        break

import drjit as dr
import mitsuba as mi
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/references"))
from make import scene_to_mitsuba

MAX_BOUNCES = 64
ROULETTE_DEPTH = 5  # Mitsuba's default


def start():
    """Choose `llvm_ad_rgb` where an LLVM is found, else `scalar_rgb`; whether it is the former."""
    mi.set_log_level(mi.LogLevel.Error)
    try:
        mi.set_variant("llvm_ad_rgb")
        mi.Float(1.0)  # looks for LLVM
    except (ImportError, RuntimeError) as error:
        print(f"no LLVM for Mitsuba: its slow variant ({error})", file=sys.stderr)
        mi.set_variant("scalar_rgb")
        return False
    register_bsdf_integrator()
    return True


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


class Peer:
    """One scene with one integrator (`path` or `bsdf_path`) and one sampler of Mitsuba."""

    def __init__(self, description, integrator, sampler):
        max_bounces = description.get("render", {}).get("max_bounces", MAX_BOUNCES)
        scene = scene_to_mitsuba(mi, description, 1)
        scene["sensor"]["sampler"] = {"type": sampler}
        scene["integrator"] = {
            "type": integrator,
            "max_depth": max_bounces + 1,
            "rr_depth": ROULETTE_DEPTH,
        }
        self.scene = mi.load_dict(scene)
        # Mitsuba's camera is right-handed.
        self.mirrored = description["camera"].get("handedness", "right") == "left"

    def samples(self, spp):
        """What the sampler makes of a number of samples: some want squares, or powers of four."""
        sampler = self.scene.sensors()[0].sampler().clone()
        sampler.set_sample_count(spp)
        return sampler.sample_count()

    def render(self, spp, seed):
        """An image in f64, rows from the top, and the seconds until it was in host memory."""
        begin = time.perf_counter()
        image = np.array(mi.render(self.scene, seed=seed, spp=spp))
        seconds = time.perf_counter() - begin
        if self.mirrored:
            image = image[:, ::-1]
        return image.astype(np.float64), seconds


def cpu_name():
    """The processor's name, as far as the system tells."""
    try:
        for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor()
