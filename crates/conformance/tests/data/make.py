"""Makes the pictures beside this file from reference.png (`pellucid render @gallery -o reference.png --size 96x54`), and
prints the numbers that tests/metrics.rs holds: PSNR and SSIM by scikit-image 0.26, FLIP by flip-evaluator 1.7."""

import numpy as np
from flip_evaluator import evaluate
from skimage.io import imread, imsave
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

reference = imread("reference.png")[..., :3]

one_pixel = reference.copy()
one_pixel[27, 48] = 255 - one_pixel[27, 48]

noise = np.random.default_rng(1).normal(0, 12, reference.shape)
noise = np.clip(np.rint(reference + noise), 0, 255).astype(np.uint8)

shifted = np.roll(reference, 1, axis=1)

contrast = (reference // 64 * 85).astype(np.uint8)

pictures = {"one-pixel": one_pixel, "noise": noise, "shifted": shifted, "contrast": contrast}
for name, picture in {"reference": reference, **pictures}.items():
    if name != "reference":
        imsave(f"{name}.png", picture, check_contrast=False)
    psnr = peak_signal_noise_ratio(reference, picture)
    ssim = structural_similarity(
        reference, picture, channel_axis=2, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )
    error, mean, _ = evaluate(
        reference.astype(np.float32) / 255, picture.astype(np.float32) / 255, "LDR", applyMagma=False
    )
    print(f'("{name}", {psnr:.6f}, {ssim:.8f}, {mean:.8f}, {error.max():.6f}),')
