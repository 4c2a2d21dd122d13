#!/usr/bin/env python3
"""gpu-trace and Mitsuba 3 on the lecture scene, taking turns on the same machine.

Usage (what `cargo xtask bench peers` does, in an environment of its own):

    pip install mitsuba numpy
    python3 side_by_side.py PATH/TO/gpu-trace [--rounds 3]

A round runs Mitsuba's two integrators (see mitsuba_lecture.py) and gpu-trace, one after the other.
Both render 640x640 with at most 64 scattering events and each with its own roulette. Compared, as
medians over the rounds:

- paths a second, without start-up and compilation on either side;
- seconds times relative variance, each against its own converged mean: the noise that a second of
  rendering leaves. Lower is better; it does not depend on the number of samples.

For gpu-trace the variance is that between renders with different seeds, as it is for Mitsuba; its
own error estimate is not used.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).parent


def ours(binary, spp, renders, seed):
    """Paths a second and seconds times relative variance of gpu-trace."""
    images, seconds, rates, device = [], [], [], ""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for i in range(renders):
            command = [binary, "lecture", "--spp", str(spp), "--seed", str(seed + i), "--quiet"]
            command += ["-o", folder / "image.npy", "--stats", folder / "stats.json"]
            subprocess.run(command, check=True)
            stats = json.loads((folder / "stats.json").read_text())
            seconds.append(stats["seconds"]["render"])
            rates.append(stats["paths_per_second"])
            device = stats["device"]["name"]
            images.append(np.load(folder / "image.npy").astype(np.float64))
    mean = np.mean(images, axis=0)
    variance = np.var(images, axis=0, ddof=1)
    # r^2 is the square of the mean, corrected for the mean's own noise.
    square = np.maximum(mean**2 - variance / renders, 0.0)
    relative = float(np.mean(variance / (square + 0.01)))
    return {
        "device": device,
        "paths_per_second": statistics.median(rates),
        "seconds_times_relative_mse": statistics.median(seconds) * relative,
        "mean": mean.mean(axis=(0, 1)).tolist(),
    }


def peer(spp, reference_spp, seed):
    """What mitsuba_lecture.py measures."""
    command = [sys.executable, HERE / "mitsuba_lecture.py", "--spp", str(spp)]
    command += ["--reference-spp", str(reference_spp), "--seed", str(seed)]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads(output)


def main():
    """Take turns and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binary")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--spp", type=int, default=16, help="Mitsuba's samples a render")
    parser.add_argument("--own-spp", type=int, default=256, help="gpu-trace's samples a render")
    options = parser.parse_args()
    rows, version, device = {}, "", ""
    for turn in range(options.rounds):
        measured = peer(options.spp, 8 * options.spp, 1 + 1000 * turn)
        version = f"Mitsuba {measured['version']} {measured['variant']}"
        for integrator, result in measured["integrators"].items():
            rows.setdefault(f"{version} `{integrator}`", []).append(result)
        result = ours(options.binary, options.own_spp, 8, 1 + 1000 * turn)
        device = result["device"]
        rows.setdefault(f"gpu-trace on {device}", []).append(result)
        print(f"round {turn + 1} of {options.rounds} done", file=sys.stderr)
    own = f"gpu-trace on {device}"

    def median_of(name, key):
        return statistics.median(r[key] for r in rows[name])

    print("| | Mpaths/s | gpu-trace is faster by | s x rel. variance | gpu-trace is better by | mean R, G, B |")
    print("|---|---|---|---|---|---|")
    for name, results in rows.items():
        rate, noise = (median_of(name, k) for k in ("paths_per_second", "seconds_times_relative_mse"))
        # Ratios within a round, since the machine's speed varies between rounds.
        faster = statistics.median(
            o["paths_per_second"] / r["paths_per_second"] for o, r in zip(rows[own], results)
        )
        better = statistics.median(
            r["seconds_times_relative_mse"] / o["seconds_times_relative_mse"]
            for o, r in zip(rows[own], results)
        )
        mean = ", ".join(f"{x:.4f}" for x in np.mean([r["mean"] for r in results], axis=0))
        print(f"| {name} | {rate / 1e6:.2f} | {faster:.2f} | {noise:.4f} | {better:.2f} | {mean} |")


if __name__ == "__main__":
    main()
