#!/usr/bin/env python3
"""Speed of peers on the sensor's job: shot noise, PRNU, DSNU, read noise, full well, 10-bit conversion.

    python sensor_speed.py {numpy32|numpy|galsim} WIDTH HEIGHT BITS REPETITIONS PHOTONS_MAX

Prints one JSON object: the peer and its best time in nanoseconds a pixel, after one run that is not counted. The scene is a
horizontal ramp from 0 to PHOTONS_MAX, quantum efficiency 0.6. Each job is written as its users would write it for speed: patterns
drawn once, arrays changed in place. `cargo bench --bench ratios` runs it beside the sensor.

Written for this repository and under its licence. numpy (BSD 3-clause) and GalSim (BSD 2-clause) are called where they are installed;
neither is a dependency.
"""
import json
import sys
import time

import numpy as np

QE, READ_E, FULL_WELL_E, BLACK_DN = 0.6, 4.0, 11000.0, 64


def job_numpy(width, height, bits, photons_max, dtype):
    rng = np.random.default_rng(1)
    photons = np.broadcast_to(np.linspace(0, photons_max, width), (height, width)).copy()
    prnu = (1 + 0.01 * rng.standard_normal((height, width))).astype(dtype)
    dsnu = (3.0 * rng.standard_normal((height, width))).astype(dtype)
    top = 2**bits - 1
    gain = dtype((top - BLACK_DN) / FULL_WELL_E)

    def run():
        e = rng.poisson(photons * (QE * prnu)).astype(dtype)
        np.minimum(e, dtype(FULL_WELL_E), out=e)
        e += dsnu
        e += rng.standard_normal((height, width), dtype=dtype) * dtype(READ_E)
        e *= gain
        e += dtype(BLACK_DN)
        np.rint(e, out=e)
        np.clip(e, 0, top, out=e)
        return e.astype(np.uint16)

    return run


def job_galsim(width, height, bits, photons_max):
    import galsim

    patterns = np.random.default_rng(1)
    photons = np.broadcast_to(np.linspace(0, photons_max, width), (height, width))
    prnu = (1 + 0.01 * patterns.standard_normal((height, width))).astype(np.float32)
    dsnu = (3.0 * patterns.standard_normal((height, width))).astype(np.float32)
    mean = (photons * QE).astype(np.float32)
    rng = galsim.BaseDeviate(1)
    poisson = galsim.PoissonNoise(rng)
    read = galsim.GaussianNoise(rng, sigma=READ_E)
    top = 2**bits - 1

    def run():
        image = galsim.ImageF(mean * prnu)
        image.addNoise(poisson)
        np.minimum(image.array, np.float32(FULL_WELL_E), out=image.array)
        image.array[...] += dsnu
        image.addNoise(read)
        image *= (top - BLACK_DN) / FULL_WELL_E
        image += float(BLACK_DN)
        image.quantize()
        np.clip(image.array, 0, top, out=image.array)
        return image.array.astype(np.uint16)

    return run


def main():
    peer, (width, height, bits, repetitions), photons_max = sys.argv[1], map(int, sys.argv[2:6]), float(sys.argv[6])
    jobs = {
        "numpy32": lambda *job: job_numpy(*job, np.float32),
        "numpy": lambda *job: job_numpy(*job, np.float64),
        "galsim": job_galsim,
    }
    run = jobs[peer](width, height, bits, photons_max)
    run()
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    print(json.dumps({"peer": peer, "ns_per_px": min(times) / (width * height) * 1e9}))


if __name__ == "__main__":
    main()
