"""Searches three times from one seed: with the program's own threads, on a local Dask cluster of which a worker is killed in mid-search,
and with array scripts on Slurm's daemons, or where these do not start, with a stand-in for sbatch that runs the tasks one after the other."""

import filecmp
import glob
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from dask_sweep import kill_one
from distributed import Client, LocalCluster
from slurm_loopback import NoDaemon, cluster

# Takes the place of `sbatch --wait`: runs the array's tasks in bash.
SBATCH = """#!/bin/bash
script="${@: -1}"
tasks=$(sed -n 's/^#SBATCH --array=1-//p' "$script")
for task in $(seq "$tasks"); do SLURM_CPUS_PER_TASK=1 SLURM_ARRAY_TASK_ID=$task bash "$script" || exit $?; done
"""
SEARCH = [sys.executable, "-c", "from sensel_sweep import main; main()", "search"]


def run(words, **more):
    """A search to its end."""
    return subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, check=False, **more).returncode


def on_dask(words, out):
    """Exit code, processes killed, and cells finished at that time."""
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        workers = list(client.run(os.getpid).values())
        more = ["--engine", "dask", "--scheduler", cluster.scheduler_address, "--chunk", "3", "--out", out]
        submitted = subprocess.Popen([*words, *more], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        killed, finished = kill_one(submitted, workers, f"{out}/sweep")
        return submitted.wait(timeout=600), killed, finished


def on_slurm(words, out):
    """Exit code, and why Slurm's daemons did not run it, if they did not."""
    more = ["--engine", "slurm", "--jobs", "2", "--out", out]
    try:
        with cluster() as (_, environment):
            return run([*words, *more], env=environment), None
    except NoDaemon as reason:
        with tempfile.TemporaryDirectory() as folder:
            sbatch = Path(folder) / "sbatch"
            sbatch.write_text(SBATCH, encoding="utf-8")
            sbatch.chmod(0o755)
            return run([*words, *more], env={**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}), str(reason)


def main():
    program, file, threads, dask, slurm, *rest = sys.argv[1:]
    words = [*SEARCH, file, "--program", program, *rest]
    alone = run([*words, "--out", threads])
    code, killed, finished = on_dask(words, dask)
    on_queue, no_daemon = on_slurm(words, slurm)
    codes = [alone, code, on_queue]
    names = sorted(Path(path).name for path in glob.glob(f"{threads}/rounds/*"))
    unequal = []
    for other in (dask, slurm):
        _, differ, missing = filecmp.cmpfiles(f"{threads}/rounds", f"{other}/rounds", names, shallow=False)
        unequal += [f"{other}: {name}" for name in differ + missing]
    found = {"exit": codes, "killed": killed, "finished_at_kill": finished, "files": len(names), "unequal": unequal}
    print(json.dumps({**found, "not_started": no_daemon}))


if __name__ == "__main__":
    main()
