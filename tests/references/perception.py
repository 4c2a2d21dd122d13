"""Makes the numbers of FLIP and SSIM in tests/compare/, from the authors' own FLIP and scikit-image.

    pip install flip-evaluator==1.7 scikit-image==0.26.0
    python perception.py
"""

import flip_evaluator
import numpy as np
from skimage.metrics import structural_similarity

W, H = 40, 32
y, x = np.mgrid[0:H, 0:W]


def levels(shift, noise):
    """Display values as levels of 256: a ramp, a slope, a chequerboard that `shift` moves."""
    red = 6 * x + noise * ((x * y) % 23)
    green = 5 * y + 2 * np.maximum(x - shift, 0)
    blue = np.where(((x + shift) // 6 + y // 5) % 2 == 1, 200, 40)
    return np.stack([red, green, blue], -1).clip(0, 255)


def luma(image):
    return image @ np.array([0.2126, 0.7152, 0.0722])


reference, image = levels(0, 0) / 255, levels(2, 1) / 255
for ppd in (67, 20):
    errors, mean, _ = flip_evaluator.evaluate(
        reference.astype(np.float32),
        image.astype(np.float32),
        "LDR",
        applyMagma=False,
        parameters={"ppd": ppd},
    )
    places = [errors[j, i, 0] for i, j in ((0, 0), (39, 31), (13, 7), (20, 16))]
    print(f"FLIP at {ppd} ppd: mean {mean:.6f}, pixels", *(f"{e:.5f}" for e in places))
ssim = structural_similarity(
    luma(image),
    luma(reference),
    gaussian_weights=True,
    sigma=1.5,
    use_sample_covariance=False,
    data_range=1.0,
)
print(f"SSIM: {ssim:.9f}")
