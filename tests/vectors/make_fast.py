#!/usr/bin/env python3
"""Makes the FAST vectors that tests/compute.rs replays: pictures and OpenCV's corners on them.

    pip install 'opencv-python-headless==5.0.0.*' && python make_fast.py DIR

Pictures are drawn here from integers only (no file from elsewhere): discs, bars and gradients under noise, with fewer
levels in some. corners.csv has one row a corner: picture, threshold, x, y, score, in OpenCV's order.
"""
import csv
import os
import sys

import cv2
import numpy as np


def noise(rng, height, width, levels):
    return (rng.integers(0, levels, (height, width)) * (255 // (levels - 1))).astype(np.uint8)


def scene(rng, height, width, sigma):
    y, x = np.mgrid[0:height, 0:width]
    picture = 40 + 120 * x // width + 30 * y // height
    for _ in range(30):
        cx, cy, r, value = rng.integers(0, width), rng.integers(0, height), rng.integers(3, 20), rng.integers(0, 256)
        if rng.integers(0, 2):
            picture[(x - cx) ** 2 + (y - cy) ** 2 < r * r] = value
        else:
            picture[cy:cy + r, cx:cx + 2 * r] = value
    return np.clip(picture + np.rint(rng.normal(0, sigma, picture.shape)), 0, 255).astype(np.uint8)


def main(folder):
    rng = np.random.default_rng(20240611)
    y, x = np.mgrid[0:64, 0:81]
    pictures = {
        "scene_clean": scene(rng, 96, 131, 0.0),
        "scene_noisy": scene(rng, 97, 160, 6.0),
        "scene_2bit": scene(rng, 96, 131, 4.0) // 64 * 64,
        "noise_256": noise(rng, 40, 67, 256),
        "noise_4": noise(rng, 40, 67, 4),
        "noise_2": noise(rng, 41, 33, 2),
        "checkerboard": ((x // 8 + y // 8) % 2 * 255).astype(np.uint8),
        "plateau": np.where((x % 20 < 2) & (y % 16 < 2), 200, 90).astype(np.uint8),
        "smallest": noise(rng, 7, 7, 2),
        "narrow": noise(rng, 50, 8, 2),
    }
    with open(os.path.join(folder, "corners.csv"), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["picture", "threshold", "x", "y", "score"])
        for name, picture in pictures.items():
            cv2.imwrite(os.path.join(folder, f"{name}.png"), picture)
            for threshold in (1, 5, 20, 40, 100):
                for key in cv2.FastFeatureDetector_create(threshold, True).detect(picture):
                    out.writerow([name, threshold, int(key.pt[0]), int(key.pt[1]), int(key.response)])


if __name__ == "__main__":
    main(sys.argv[1])
