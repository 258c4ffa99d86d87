"""Runs a sweep on a local Dask cluster of two workers and kills one of them, with what it runs, in mid-sweep."""

import glob
import json
import os
import signal
import subprocess
import sys
import time

import psutil
from distributed import Client, LocalCluster


def main():
    program, file, out, *rest = sys.argv[1:]
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        workers = list(client.run(os.getpid).values())
        command = [sys.executable, "-c", "from sensel_sweep import main; main()", "submit", file, "--out", out]
        command += ["--engine", "dask", "--program", program, "--scheduler", cluster.scheduler_address, "--chunk", "20", *rest]
        submitted = subprocess.Popen(command, stdin=subprocess.DEVNULL)
        killed, finished = kill_one(submitted, workers, out)
        code = submitted.wait(timeout=600)
        after = list(client.run(os.getpid).values())
    print(json.dumps({"exit": code, "workers": len(workers), "killed": killed, "finished_at_kill": finished, "after": len(after)}))


def kill_one(submitted, workers, out):
    """Kills the first worker that runs cells once some are finished; how many processes died, and how many cells were finished."""
    while submitted.poll() is None:
        finished = len(glob.glob(f"{out}/cells/*/*.json"))
        for worker in workers:
            busy = psutil.Process(worker).children(recursive=True)
            if finished > 0 and busy:
                for process in [psutil.Process(worker), *busy]:
                    os.kill(process.pid, signal.SIGKILL)
                return 1 + len(busy), finished
        time.sleep(0.002)
    return 0, 0


if __name__ == "__main__":
    main()
