#!/usr/bin/env python3
"""OpenCV's ORB at one level for the quality study, and scikit-image's pictures for it.

    python orb_features.py pictures FOLDER chosen_on|judged_on           (needs scikit-image)
    python orb_features.py features LIST ANSWERS

LIST is JSON: [{"file", "width", "height", "features"}], files of raw 8-bit pixels. ANSWERS is JSON: for each file a list of
[x, y, [32 bytes]]. ORB is as it comes (Harris rank, FAST threshold 20, patch of 31) but for its number of levels and of features.
"""
import json
import sys

import cv2
import numpy as np

PICTURES = {
    # Those on which defaults were chosen.
    "chosen_on": ("astronaut", "brick", "camera", "chelsea", "coffee", "coins", "gravel", "rocket"),
    # Those that were looked at only after the choice: all others of at least 384 x 288 pixels that come with the package.
    "judged_on": ("cell", "clock", "grass", "hubble_deep_field", "immunohistochemistry", "moon", "retina", "stereo_motorcycle"),
}


def pictures(folder, chosen):
    from skimage import data
    for name in PICTURES[chosen]:
        picture = getattr(data, name)()
        picture = picture[0] if isinstance(picture, tuple) else picture
        grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        cv2.imwrite(f"{folder}/{name}.png", grey)


def features(jobs, answers):
    cv2.setNumThreads(1)
    found = []
    for job in json.load(open(jobs)):
        picture = np.fromfile(job["file"], np.uint8).reshape(job["height"], job["width"])
        points, descriptors = cv2.ORB_create(max(1, job["features"]), 1.2, 1).detectAndCompute(picture, None)
        found.append([[p.pt[0], p.pt[1], d.tolist()] for p, d in zip(points, descriptors)] if points else [])
    json.dump(found, open(answers, "w"))


if __name__ == "__main__":
    {"pictures": pictures, "features": features}[sys.argv[1]](*sys.argv[2:])
