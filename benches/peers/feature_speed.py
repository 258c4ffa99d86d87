#!/usr/bin/env python3
"""Time of OpenCV's FAST with suppression, or of its ORB at one level with 500 features, on a VGA picture: best of the passes, one thread.

    python feature_speed.py picture FILE             (writes 640 x 480 raw pixels of scikit-image's astronaut)
    python feature_speed.py fast|orb FILE PASSES     (prints {"ns_per_px", "features"})
"""
import json
import sys
import time

import cv2
import numpy as np

SIZE = (640, 480)


def picture(file):
    from skimage import data
    grey = cv2.cvtColor(data.astronaut(), cv2.COLOR_RGB2GRAY)
    cv2.resize(grey, SIZE).tofile(file)


def main(peer, file, passes):
    cv2.setNumThreads(1)
    grey = np.fromfile(file, np.uint8).reshape(SIZE[1], SIZE[0])
    if peer == "fast":
        detector = cv2.FastFeatureDetector_create(20, True)
        work = lambda: detector.detect(grey)
    else:
        orb = cv2.ORB_create(500, 1.2, 1)
        work = lambda: orb.detectAndCompute(grey, None)[0]
    best_s = float("inf")
    for _ in range(int(passes) + 1):
        begin = time.perf_counter()
        found = work()
        best_s = min(best_s, time.perf_counter() - begin)
    print(json.dumps({"ns_per_px": best_s * 1e9 / grey.size, "features": len(found)}))


if __name__ == "__main__":
    picture(sys.argv[2]) if sys.argv[1] == "picture" else main(*sys.argv[1:])
