"""Searches twice from one seed: with the program's own threads, and on a local Dask cluster of which a worker is killed in mid-search."""

import filecmp
import glob
import json
import os
import subprocess
import sys
from pathlib import Path

from dask_sweep import kill_one
from distributed import Client, LocalCluster

SEARCH = [sys.executable, "-c", "from sensel_sweep import main; main()", "search"]


def main():
    program, file, first, second, *rest = sys.argv[1:]
    words = [*SEARCH, file, "--program", program, *rest]
    alone = subprocess.run([*words, "--out", first], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=False)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        workers = list(client.run(os.getpid).values())
        on_dask = ["--engine", "dask", "--scheduler", cluster.scheduler_address, "--chunk", "2", "--out", second]
        submitted = subprocess.Popen([*words, *on_dask], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
        killed, finished = kill_one(submitted, workers, f"{second}/sweep")
        submitted.communicate(timeout=600)
    names = sorted(Path(place).name for place in glob.glob(f"{first}/rounds/*"))
    equal, differ, missing = filecmp.cmpfiles(f"{first}/rounds", f"{second}/rounds", names, shallow=False)
    said = {"exit": [alone.returncode, submitted.returncode], "killed": killed, "finished_at_kill": finished}
    said |= {"files": len(names), "equal": len(equal), "differ": differ + missing, "said": alone.stdout}
    print(json.dumps(said))


if __name__ == "__main__":
    main()
