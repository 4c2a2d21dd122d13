"""Light that the lecture's reflective material scatters, by numpy alone: the table of reflective.csv.

f = albedo/pi, plus mu S for w with w.d_r > 1 - epsilon, d_r being the mirror direction. By rejection: points of
the unit cube within the ball, on their spheres, in the half space of the normal; for the lobe, normal deviates
in the tangent plane of d_r cut at its rim. Nothing of it is gpu-trace's arithmetic or its way to sample.

    python3 tests/references/reflective.py > tests/references/reflective.csv

Columns: case, angle of incidence in degrees, a quantity, its mean and its standard error. Quantities, by f cos:
albedo (its integral), lobe (that over the lobe), height (that of the cosine with the normal), along (that of the
component along the surface in the plane of incidence).
"""

import numpy as np

SAMPLES = 4_000_000
CASES = {
    "lecture": dict(albedo=0.37, specular=1.0, epsilon=0.01, mu=10.0),
    "wide": dict(albedo=0.3, specular=0.4, epsilon=0.2, mu=0.5),
}
ANGLES = [0.0, 30.0, 60.0, 80.0, 87.0]


def hemisphere(rng, count):
    """Uniform directions above z = 0 and their pdf."""
    parts, found = [], 0
    while found < count:
        p = rng.uniform(-1.0, 1.0, (count, 3))
        square = np.sum(p * p, axis=1)
        p = p[(square <= 1.0) & (square > 1e-12)]
        p /= np.linalg.norm(p, axis=1)[:, None]
        p[:, 2] = np.abs(p[:, 2])
        parts.append(p)
        found += len(p)
    return np.concatenate(parts)[:count], 1.0 / (2.0 * np.pi)


def lobe(rng, count, axis, epsilon):
    """Directions w with w.axis > 1 - epsilon, and their pdfs."""
    rim = np.sqrt(1.0 - (1.0 - epsilon) ** 2)
    s = 0.6 * rim
    t = np.cross(axis, [0.0, 1.0, 0.0])
    t /= np.linalg.norm(t)
    b = np.cross(axis, t)
    xy, found = [], 0
    while found < count:
        p = rng.normal(0.0, s, (count, 2))
        p = p[np.sum(p * p, axis=1) < rim * rim]
        xy.append(p)
        found += len(p)
    xy = np.concatenate(xy)[:count]
    square = np.sum(xy * xy, axis=1)
    height = np.sqrt(1.0 - square)
    w = xy[:, :1] * t + xy[:, 1:] * b + height[:, None] * axis
    inside = 1.0 - np.exp(-0.5 * (rim / s) ** 2)
    pdf = np.exp(-0.5 * square / s**2) / (2.0 * np.pi * s**2 * inside)
    # An area of the plane is the cosine with the axis times the solid angle.
    return w, pdf * height


def main():
    rng = np.random.default_rng(20261124)
    print("case,degrees,quantity,mean,error")
    for name, m in CASES.items():
        for degrees in ANGLES:
            sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
            mirrored = np.array([sine, 0.0, cosine])
            w, pdf = hemisphere(rng, SAMPLES)
            wide = m["albedo"] / np.pi * w[:, 2] / pdf
            v, pdf = lobe(rng, SAMPLES, mirrored, m["epsilon"])
            above = v[:, 2] > 0.0
            narrow = np.where(above, m["mu"] * m["specular"] * v[:, 2] / pdf, 0.0)
            # What the diffuse part sends into the lobe.
            within = np.where(above, m["albedo"] / np.pi * v[:, 2] / pdf, 0.0)
            quantities = {
                "albedo": [wide, narrow],
                "lobe": [narrow + within],
                "height": [wide * w[:, 2], narrow * v[:, 2]],
                "along": [wide * w[:, 0], narrow * v[:, 0]],
            }
            for quantity, parts in quantities.items():
                mean = sum(np.mean(x) for x in parts)
                error = np.sqrt(sum(np.var(x) / len(x) for x in parts))
                print(f"{name},{degrees},{quantity},{mean:.9e},{error:.3e}")


if __name__ == "__main__":
    main()
