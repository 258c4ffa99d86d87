"""Searches the stand-in with and without a rung, for the same cost in full cells, and checks that a rung that tells nothing is left out."""

import json
import math
import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from scipy import stats
from search_front import program, searched, volume

SET = """
[set]
"run.frames" = 60
"""
SHORT = SET + """
[[rung]]
name = "a quarter of the frames"
frames = 0.25
correlation = 0.6
"""
USELESS = SET + """
[[rung]]
name = "expected codes"
set = { "run.rung" = "expected" }
cost = 0.25
"""


def stated(state):
    """Agreement of the first rung, by figure."""
    return {one.figure: one.correlation for one in state.agreements[0]}


def main():
    count = int(sys.argv[1])
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        program(folder)
        jobs = [(seed, name) for seed in range(1, count + 1) for name in ("", "short")]
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            found = pool.map(lambda job: volume(folder, "tpe", job[0], SHORT if job[1] else "", job[1]), jobs)
            volumes = dict(zip(jobs, found))
        logs = [math.log(volumes[seed, "short"] / volumes[seed, ""]) for seed in range(1, count + 1)]
        short = searched(folder, "tpe", 1, SHORT, "short")
        useless = searched(folder, "tpe", 1, USELESS, "useless")
        plain = searched(folder, "tpe", 1, "", "")
        rounds = {path.name for path in (folder / "tpeuseless-1" / "rounds").glob("*rung*.toml")}
        said = {
            "short": stated(short),
            "left_out_by_short": len(short.left_out),
            "useless": stated(useless),
            "left_out_by_useless": len(useless.left_out),
            "files_of_useless": sorted(rounds),
            "designs": [len(one.designs) for one in (plain, short, useless)],
        }
    mean = math.fsum(logs) / count
    sd = math.sqrt(math.fsum((one - mean) ** 2 for one in logs) / (count - 1))
    half = float(stats.t.ppf(0.975, count - 1)) * sd / math.sqrt(count)
    said |= {"ratio": math.exp(mean), "interval": [math.exp(mean - half), math.exp(mean + half)]}
    print(json.dumps(said))


if __name__ == "__main__":
    main()
