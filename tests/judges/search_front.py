"""Searches the stand-in with Optuna and at random, with the same number of cells, and compares the hypervolumes of what they found.

The volume counts the true figures of the designs that each search names as its front: noise makes no volume."""

import argparse
import json
import math
import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import search_stand_in as stand_in
from scipy import stats
from sensel_sweep.cluster import Engine
from sensel_sweep.search import file, loop
from sensel_sweep.search.designs import front, hypervolume

CELLS = 60
SEARCH = """
scenario = "stand_in"
constraints = ["ate_m < 0.04 for 90 %"]
{factors}
[[factor]]
name = "smoothing"
key = "smoothing"
values = ["off", "binomial"]
[[objective]]
figure = "power_mw"
[[objective]]
figure = "ate_m"
[search]
sampler = "{sampler}"
seed = {seed}
cells = {cells}
batch = 6
seeds = 1
seeds_most = 4
"""


def program(folder):
    """The stand-in as a program of one name."""
    path = folder / "stand-in"
    path.write_text(f'#!/bin/sh\nexec "{sys.executable}" -S -E "{stand_in.__file__}" "$@"\n', encoding="utf-8")
    path.chmod(0o755)
    return str(path)


def searched(folder, sampler, seed, more="", name="", cells=CELLS):
    """One search, with more lines in its file."""
    out = folder / f"{sampler}{name}-{seed}"
    factors = "".join(
        f'[[factor]]\nkey = "{name}"\nlow = {low}\nhigh = {high}\nspacing = "log"\n' for name, (low, high) in stand_in.RANGES.items()
    )
    path = folder / f"{sampler}{name}-{seed}.toml"
    path.write_text(SEARCH.format(factors=factors, sampler=sampler, seed=seed, cells=cells) + more, encoding="utf-8")
    state = loop.State(file.read(path), out)
    with Engine(argparse.Namespace(engine="local", program=str(folder / "stand-in"), rest=[])) as engine:
        loop.check_identity(state)
        while loop.play(state, engine):
            pass
    return state


def volume(folder, sampler, seed, more="", name="", cells=CELLS):
    """Of what one search found."""
    state = searched(folder, sampler, seed, more, name, cells)
    # A round with rungs may end before the last cells, which are fewer than a design costs.
    assert cells - 4 < state.cells <= cells if more else state.cells == cells, state.cells
    found = [stand_in.truth(one.design.is_) for one in front(state.goals, state.summaries())]
    return hypervolume([list(one) for one in found], list(stand_in.REFERENCE))


def main():
    sampler, count, cells = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else CELLS
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        program(folder)
        jobs = [(kind, seed) for seed in range(1, count + 1) for kind in (sampler, "random")]
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            volumes = dict(zip(jobs, pool.map(lambda job: volume(folder, *job, cells=cells), jobs)))
    whole = stand_in.front_volume()
    logs = [math.log(volumes[sampler, seed] / volumes["random", seed]) for seed in range(1, count + 1)]
    mean = math.fsum(logs) / count
    sd = math.sqrt(math.fsum((one - mean) ** 2 for one in logs) / (count - 1))
    half = float(stats.t.ppf(0.975, count - 1)) * sd / math.sqrt(count)
    shares = {kind: [volumes[kind, seed] / whole for seed in range(1, count + 1)] for kind in (sampler, "random")}
    means = {kind: math.fsum(values) / count for kind, values in shares.items()}
    said = {"cells": cells, "ratio": math.exp(mean), "interval": [math.exp(mean - half), math.exp(mean + half)], "share_of_front": means}
    print(json.dumps({**said, "ratios": [math.exp(one) for one in logs]}))


if __name__ == "__main__":
    main()
