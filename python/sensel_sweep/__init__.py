"""Runs the cells of a sensel sweep on Dask: names of cells go out, exit codes come back."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

QUEUES = {"slurm": "SLURMCluster", "lsf": "LSFCluster", "sge": "SGECluster", "pbs": "PBSCluster"}


def run_cells(command: list[str], cells: list[str], threads: int) -> int:
    """Runs some cells on this worker and returns the exit code of `sensel sweep run`."""
    with tempfile.NamedTemporaryFile("w", suffix=".cells", delete=True) as names:
        names.write("\n".join(cells) + "\n")
        names.flush()
        words = [*command, "--cells", names.name, "--threads", str(threads), "--quiet"]
        return subprocess.run(words, stdin=subprocess.DEVNULL, check=False).returncode


def chunks(cells: list[dict], size: int) -> list[list[str]]:
    """Names of cells in chunks; cells that share photons stay together."""
    ordered = sorted(cells, key=lambda cell: cell["group"])
    names = [cell["cell"] for cell in ordered]
    return [names[start : start + size] for start in range(0, len(names), size)]


def client_of(arguments: argparse.Namespace):
    """A client of the running scheduler, of a queue's workers, or of local processes."""
    from distributed import Client, LocalCluster

    if arguments.scheduler:
        return Client(arguments.scheduler)
    if arguments.jobqueue:
        import dask_jobqueue

        cluster_type = getattr(dask_jobqueue, QUEUES[arguments.jobqueue])
        cluster = cluster_type(cores=arguments.cores, processes=1, memory=arguments.memory)
        cluster.scale(jobs=arguments.jobs)
        return Client(cluster)
    return Client(LocalCluster(n_workers=arguments.workers, threads_per_worker=1, dashboard_address=None))


def submit(arguments: argparse.Namespace) -> int:
    """Maps chunks of cells onto the workers and returns the worst exit code."""
    from distributed import as_completed

    shared = [arguments.file, "--out", arguments.out, *arguments.rest]
    planned = subprocess.run(
        [arguments.program, "sweep", "plan", *shared, "--json"], stdout=subprocess.PIPE, check=False, text=True
    )
    if planned.returncode:
        return planned.returncode
    cells = json.loads(planned.stdout)["cells"]
    work = chunks(cells, arguments.chunk)
    command = [arguments.program, "sweep", "run", *shared]
    codes: list[int] = []
    with client_of(arguments) as client:
        futures = client.map(
            lambda names: run_cells(command, names, arguments.cores), work, pure=False, retries=arguments.retries
        )
        for done, future in enumerate(as_completed(futures), start=1):
            error = future.exception()
            codes.append(1 if error else future.result())
            if error:
                print(f"sensel-sweep: a chunk failed: {error}", file=sys.stderr)
            print(f"sensel-sweep: {done} of {len(work)} chunks", file=sys.stderr)
    return max(codes, default=0)


def main() -> None:
    """`sensel-sweep submit`."""
    parser = argparse.ArgumentParser(prog="sensel-sweep", description=__doc__, allow_abbrev=False)
    parts = parser.add_subparsers(dest="part", required=True)
    part = parts.add_parser("submit", help="runs all cells of a sweep file", allow_abbrev=False)
    part.add_argument("file")
    part.add_argument("--out", required=True, help="folder of the sweep, seen by all workers")
    part.add_argument("--engine", choices=["dask"], default="dask")
    part.add_argument("--program", default="sensel", help="the program sensel on the workers")
    part.add_argument("--scheduler", help="address of a running scheduler")
    part.add_argument("--jobqueue", choices=sorted(QUEUES))
    part.add_argument("--jobs", type=int, default=4)
    part.add_argument("--cores", type=int, default=1)
    part.add_argument("--memory", default="4GB")
    part.add_argument("--workers", type=int, default=2, help="of a local cluster")
    part.add_argument("--chunk", type=int, default=16, help="cells of a task")
    part.add_argument("--retries", type=int, default=3)
    arguments, arguments_rest = parser.parse_known_args()
    arguments.rest = arguments_rest
    for name in ("file", "out"):
        setattr(arguments, name, str(Path(getattr(arguments, name)).resolve()))
    sys.exit(submit(arguments))
