#!/usr/bin/env python3
"""gpu-trace and Mitsuba 3 on the same scenes, taking turns on the same machine.

Usage (what `cargo xtask bench peers` does, in an environment of its own):

    pip install mitsuba numpy
    python3 side_by_side.py PATH/TO/gpu-trace               the figures; needs an idle machine
    python3 side_by_side.py PATH/TO/gpu-trace --quick       small images: whether it works
    python3 side_by_side.py PATH/TO/gpu-trace three-lamps   one scene

Compared are gpu-trace as it comes and with independent samples, and Mitsuba's `path` with several of
its samplers (`independent` is its default) and without emitter sampling: a loop of our own, compiled by
Dr.Jit as `path` is.
Mitsuba's scenes are made of ours by tests/references/make.py. All render the same pixels, with the
same number of samples, a box filter and the scene's bounce limit, each with its own roulette.

A turn is some renders by each, one after the other, each with another seed. Times are without
start-up and compilation on either side; the printed ratios are medians over ratios within a turn.

- Seconds x relative variance: the noise that a second leaves. The variance is that between the
  renders, over the square of their own mean (less the mean's own noise) plus a tenth of the image's
  mean squared, averaged over pixels and channels; gpu-trace's own error estimate has no part in it.
  It does not depend on the number of samples if they are independent; sequences do better the longer
  they are.
- Bias: the relative difference to renders by gpu-trace's f64 reference with other seeds (kept in
  target/peers), weighed as the error is, over blocks of 4x4 pixels, and averaged; after ± one standard
  error, of both. Not that of the mean radiance: a lamp that is smaller than a pixel would be most of
  its noise. It counts as bias beyond 3 standard errors.
- Error: relRMSE against the same reference, as `gpu-trace compare` has it, less the reference's own
  noise: bias is in it.
- Time to the error asked for, if its bias is none or below a tenth of that error: more renders, in
  turns, with as many samples as should reach it; from their true error e, their seconds times
  (e/asked)^2.
"""

import argparse
import hashlib
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import tomllib

import numpy as np
from peer import ROOT, Peer, cpu_name, dr, mi, start

PARTS = 8  # of the reference, each with its own seed
REFERENCE_SEED = 1_000_000
BIAS_ERRORS = 3.0
BLOCK = 4
ERROR_TURNS = 3
MOST_SPP = 20_000  # that are rendered to reach an error


class Scene:
    """A scene of ours and the size at which it is compared."""

    def __init__(self, file, width, height):
        self.file = ROOT / file
        self.name = self.file.stem
        self.width, self.height = width, height

    def description(self):
        """What both render, as Mitsuba's translation wants it."""
        parsed = tomllib.loads(self.file.read_text())
        parsed["image"] = {"width": self.width, "height": self.height}
        return parsed


SCENES = [
    Scene("scenes/lecture.toml", 160, 160),
    Scene("scenes/tests/three-lamps.toml", 160, 120),
    Scene("scenes/glass.toml", 160, 128),
]


class Own:
    """gpu-trace."""

    def __init__(self, binary, scene, folder, *options):
        size = f"{scene.width}x{scene.height}"
        self.command = [binary, "render", scene.file, "--size", size, "--quiet", *options]
        self.folder = pathlib.Path(folder)
        self.stats = None

    def samples(self, spp):
        """Any number will do."""
        return spp

    def render(self, spp, seed, *options):
        """An image in f64 and the seconds that it took."""
        image, stats = self.folder / "image.npy", self.folder / "stats.json"
        command = [*self.command, "--spp", str(spp), "--seed", str(seed), *options]
        subprocess.run([*command, "-o", image, "--stats", stats], check=True)
        self.stats = json.loads(stats.read_text())
        return np.load(image).astype(np.float64), self.stats["seconds"]["render"]


def weights(mean, variance):
    """1/(r^2 + (0.1 M)^2) in each value, with the square of the true image corrected for noise."""
    square = np.maximum(mean**2 - variance, 0.0)
    return 1.0 / (square + (0.1 * mean.mean()) ** 2)


class Reference:
    """The f64 image, from parts of independent seeds."""

    def __init__(self, own, scene, spp, cache):
        key = [scene.file.read_text(), scene.width, scene.height, spp, PARTS, REFERENCE_SEED]
        digest = hashlib.sha256(json.dumps(key).encode()).hexdigest()[:12]
        path = cache / f"{scene.name}-{digest}.npy"
        if not path.exists():
            parts = []
            for part in range(PARTS):
                note(f"{scene.name}: reference, part {part + 1} of {PARTS}")
                seed = REFERENCE_SEED + part
                parts.append(own.render(spp // PARTS, seed, "--backend", "cpu")[0])
            cache.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(dir=cache, delete=False) as file:
                np.save(file, parts)
            pathlib.Path(file.name).rename(path)
        parts = np.load(path)
        self.image = parts.mean(axis=0)
        self.variance = parts.var(axis=0, ddof=1) / PARTS
        self.weights = weights(self.image, self.variance)
        # Of blocks, so that the noise of a weight has nothing to do with that of what it weighs.
        blocks = self.image.reshape(scene.height // BLOCK, BLOCK, scene.width // BLOCK, BLOCK, 3)
        blocks = np.sqrt(weights(blocks.mean(axis=(1, 3)), 0.0))
        self.level_weights = blocks.repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)
        self.levels = [self.level(part) for part in parts]

    def level(self, image):
        """The mean over an image of its values, each relative to the true level around it."""
        return (image * self.level_weights).mean()

    def noise(self):
        """relRMSE of the reference itself."""
        return math.sqrt((self.variance * self.weights).mean())

    def error(self, image):
        """relRMSE of an image, without that of the reference."""
        squared = ((image - self.image) ** 2 - self.variance) * self.weights
        return math.sqrt(max(squared.mean(), 0.0))

    def bias(self, levels):
        """Relative bias and its standard error, given `level` of each image."""
        level = np.mean(self.levels)
        errors = [np.var(x, ddof=1) / len(x) for x in (levels, self.levels)]
        return np.mean(levels) / level - 1.0, math.sqrt(sum(errors)) / level


class Sample:
    """The renders of one renderer: their times by turn, running mean and squares."""

    def __init__(self):
        self.seconds, self.levels, self.errors = [], [], []
        self.count, self.mean, self.squares = 0, 0.0, 0.0

    def add(self, image, reference):
        """One more image (Welford's update)."""
        if not np.isfinite(image).all():
            sys.exit("an image has values that are not finite")
        self.count += 1
        deviation = image - self.mean
        self.mean = self.mean + deviation / self.count
        self.squares = self.squares + deviation * (image - self.mean)
        self.levels.append(reference.level(image))
        self.errors.append(reference.error(image))

    def relative_variance(self):
        """Of one render, against the converged mean of all."""
        variance = self.squares / (self.count - 1)
        return float((variance * weights(self.mean, variance / self.count)).mean())

    def median_seconds(self):
        """Of one render, over all turns."""
        return statistics.median(s for turn in self.seconds for s in turn)


def note(text):
    """Progress."""
    print(text, file=sys.stderr, flush=True)


def compare(own, scene, renderers, options):
    """Take turns on one scene and print its table."""
    reference = Reference(own, scene, options.reference_spp, options.cache)
    samples = {name: Sample() for name in renderers}
    for renderer in renderers.values():
        renderer.render(options.spp, 0)  # compiles
    for turn in range(options.turns):
        for name, renderer in renderers.items():
            seconds = []
            for i in range(options.renders):
                image, took = renderer.render(options.spp, 1 + turn * options.renders + i)
                seconds.append(took)
                samples[name].add(image, reference)
            samples[name].seconds.append(seconds)
        note(f"{scene.name}: turn {turn + 1} of {options.turns} done")

    to_error = times_to_error(scene, reference, renderers, samples, options)
    table(scene, reference, samples, to_error, options)


def times_to_error(scene, reference, renderers, samples, options):
    """Samples a pixel, error reached and seconds by turn of every renderer that is not biased.

    Without seconds if it would be too many samples.
    """
    result = {}
    for name, renderer in renderers.items():
        bias, error = reference.bias(samples[name].levels)
        if abs(bias) > max(BIAS_ERRORS * error, 0.1 * options.error):
            continue
        wanted = options.spp * samples[name].relative_variance() / options.error**2
        spp = renderer.samples(max(16, 16 * math.ceil(wanted / 16)))
        result[name] = (spp, [], [])
    for turn in range(1 + ERROR_TURNS):
        for name, (spp, errors, times) in result.items():
            if spp > MOST_SPP:
                continue
            note(f"{scene.name}: {name} to {100 * options.error:g} % with {spp} spp")
            image, seconds = renderers[name].render(spp, 999_000 + turn)
            if turn > 0:  # the first one may have had to compile
                errors.append(reference.error(image))
                times.append(seconds)
    for name, (spp, errors, times) in result.items():
        found = math.sqrt(np.mean(np.square(errors))) if errors else math.nan
        result[name] = (spp, found, [t * (found / options.error) ** 2 for t in times])
    return result


def table(scene, reference, samples, to_error, options):
    """Print the results of one scene."""
    best = samples["gpu-trace"]
    print(
        f"\n`{scene.name}`, {scene.width}x{scene.height}, {options.spp} spp, {best.count} renders each "
        f"in {options.turns} turns; reference: {options.reference_spp} spp, "
        f"error {100 * reference.noise():.2f} %\n"
    )
    asked = f"{100 * options.error:g} %"
    print(
        "| | Mpaths/s | of gpu-trace's | error | s x rel. variance | times gpu-trace's "
        f"| bias, % | to {asked}, s | times gpu-trace's |\n|---|---|---|---|---|---|---|---|---|"
    )
    for name, sample in samples.items():
        pace = statistics.median(
            statistics.median(a) / statistics.median(b) for a, b in zip(sample.seconds, best.seconds)
        )
        variance = sample.relative_variance()
        rate = scene.width * scene.height * options.spp / sample.median_seconds()
        bias, error = reference.bias(sample.levels)
        cells = [
            f"{rate / 1e6:.2f}",
            f"{1 / pace:.2f}",
            f"{100 * math.sqrt(np.mean(np.square(sample.errors))):.2f} %",
            f"{sample.median_seconds() * variance:.5f}",
            f"{pace * variance / best.relative_variance():.2f}",
            f"{100 * bias:+.3f} ± {100 * error:.3f}",
        ]
        cells += cells_to_error(to_error, name)
        print(f"| {name} | {' | '.join(cells)} |")
    sys.stdout.flush()


def cells_to_error(to_error, name):
    """Time to the error asked for and its ratio to gpu-trace's, as text."""
    if name not in to_error:
        return ["biased", ""]
    spp, found, times = to_error[name]
    if not times:
        return [f"not taken ({spp} spp)", ""]
    ratio = ""
    if to_error.get("gpu-trace", (0, 0, []))[2]:
        own = to_error["gpu-trace"][2]
        ratio = f"{statistics.median(a / b for a, b in zip(times, own)):.2f}"
    return [f"{statistics.median(times):.2f} ({spp} spp: {100 * found:.2f} %)", ratio]


def main():
    """Render what the command line names and print tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binary", help="gpu-trace")
    parser.add_argument("scenes", nargs="*", help=f"of {', '.join(s.name for s in SCENES)}")
    parser.add_argument("--turns", type=int, default=4)
    parser.add_argument("--renders", type=int, default=4, help="renders of each in a turn")
    parser.add_argument("--spp", type=int, default=256, help="samples a pixel of a render")
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--error", type=float, default=0.02, help="that time is compared to")
    parser.add_argument("--samplers", default="independent,multijitter,ldsampler", help="Mitsuba's")
    parser.add_argument("--scale", type=int, default=1, help="times as many pixels a side")
    parser.add_argument("--quick", action="store_true", help="small images, few samples")
    parser.add_argument("--cache", type=pathlib.Path, default=ROOT / "target/peers/references")
    options = parser.parse_args()
    unknown = set(options.scenes) - {s.name for s in SCENES}
    if unknown:
        parser.error(f"unknown scene {', '.join(sorted(unknown))}")
    if not pathlib.Path(options.binary).is_file():
        parser.error(f"{options.binary}: no such file (`cargo build --release` makes it)")
    if options.turns * options.renders < 2:
        parser.error("a variance needs at least 2 renders")
    if options.quick:
        options.turns, options.renders, options.spp = 2, 2, 64
        options.reference_spp, options.error = 256, 0.1
        for scene in SCENES:
            scene.width, scene.height = scene.width // 2, scene.height // 2

    for scene in SCENES:
        scene.width, scene.height = options.scale * scene.width, options.scale * scene.height

    compiled = start()
    binary = str(pathlib.Path(options.binary).resolve())
    loads = [os.getloadavg()[0]]
    with tempfile.TemporaryDirectory() as folder:
        for scene in [s for s in SCENES if not options.scenes or s.name in options.scenes]:
            description = scene.description()
            peers = {
                f"Mitsuba `path`, {sampler}": Peer(description, "path", sampler)
                for sampler in options.samplers.split(",")
            }
            if compiled:
                without = Peer(description, "bsdf_path", "independent")
                peers["Mitsuba, no emitter sampling"] = without
            own = Own(binary, scene, folder)
            plain = Own(binary, scene, folder, "--sampler", "independent")
            without = Own(binary, scene, folder, "--integrator", "bsdf")
            cache = Own(binary, scene, folder, "--radiance-cache", "on")
            renderers = {
                **peers,
                "gpu-trace, independent": plain,
                "gpu-trace, no lamp sampling": without,
                "gpu-trace, radiance cache": cache,
                "gpu-trace": own,
            }
            compare(own, scene, renderers, options)
            loads.append(os.getloadavg()[0])
    print(
        f"\nMitsuba {mi.__version__} {mi.variant()} (Dr.Jit {dr.__version__}), gpu-trace "
        f"{own.stats['version']} on {own.stats['device']['name']}; {cpu_name()}; load average at the "
        f"start and after each scene: {', '.join(f'{x:.1f}' for x in loads)}"
    )


if __name__ == "__main__":
    main()
