"""Runs the cells of a sweep file: in this program's own process, on Dask, or on Slurm. Names of cells go out, exit codes come back."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

from .processes import NoProgram, called, started

QUEUES = {"slurm": "SLURMCluster", "lsf": "LSFCluster", "sge": "SGECluster", "pbs": "PBSCluster"}


# On a worker, the programs that run and the sweep files that they run cells of.
RUNNING: dict[subprocess.Popen, str] = {}


def run_cells(command: list[str], cells: list[str], threads: int) -> int:
    """Runs some cells on this worker and returns the exit code of `sensel sweep run`."""
    with tempfile.NamedTemporaryFile("w", suffix=".cells", delete=True) as names:
        names.write("\n".join(cells) + "\n")
        names.flush()
        words = [*command, "--cells", names.name, "--threads", str(threads), "--quiet"]
        child = started(words)
        RUNNING[child] = command[3]
        try:
            return child.wait()
        finally:
            del RUNNING[child]


def stop_cells(file: str) -> None:
    """On a worker, asks the programs that run cells of a sweep file to stop."""
    for child in [child for child, own in RUNNING.items() if own == file]:
        child.terminate()


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


def planned(arguments: argparse.Namespace, file: str, out: str) -> tuple[int, list[list[str]]]:
    """The exit code of `sensel sweep plan`, and the cells of a file in chunks."""
    words = [arguments.program, "sweep", "plan", file, "--out", out, *arguments.rest, "--json"]
    said = called(words, stdout=subprocess.PIPE, text=True)
    return said.returncode, [] if said.returncode else chunks(json.loads(said.stdout)["cells"], arguments.chunk)


def run_on(client, arguments: argparse.Namespace, file: str, out: str, work: list[list[str]]) -> int:
    """Maps chunks of a file's cells onto the workers and returns the worst exit code."""
    from distributed import as_completed

    command = [arguments.program, "sweep", "run", file, "--out", out, *arguments.rest]
    codes: list[int] = []
    futures = client.map(
        lambda names: run_cells(command, names, arguments.cores), work, pure=False, retries=arguments.retries
    )
    try:
        for done, future in enumerate(as_completed(futures), start=1):
            error = future.exception()
            codes.append(1 if error else future.result())
            if error:
                print(f"sensel-sweep: a chunk failed: {error}", file=sys.stderr)
            print(f"sensel-sweep: {done} of {len(work)} chunks", file=sys.stderr)
    except KeyboardInterrupt:
        # Those that wait are not started any more; a worker that ends would leave its program behind.
        client.cancel(futures)
        client.run(stop_cells, file, on_error="ignore")
        raise
    return max(codes, default=0)


class Engine:
    """Runs sweep files one after the other; a cluster is started once."""

    def __init__(self, arguments: argparse.Namespace):
        self.arguments = arguments
        self.client = None
        self.opened = ExitStack()

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_) -> None:
        self.opened.close()

    def run(self, file: Path, out: Path) -> int:
        """The exit code of all cells of a file."""
        asked = self.arguments
        if asked.engine == "local":
            return called(self.words("run", file, out) + ["--quiet"]).returncode
        if asked.engine == "slurm":
            return self.run_on_slurm(file, out)
        code, work = planned(asked, str(file), str(out))
        if code:
            return code
        if self.client is None:
            self.client = self.opened.enter_context(client_of(asked))
        return run_on(self.client, asked, str(file), str(out), work)

    def run_on_slurm(self, file: Path, out: Path) -> int:
        """Submits the program's own array script and waits for its tasks."""
        submit = self.words("submit", file, out) + ["--engine", "slurm", "--shards", str(self.arguments.jobs)]
        written = called([*submit, "--cpus", str(self.arguments.cores)], stdout=subprocess.PIPE)
        if written.returncode:
            return written.returncode
        script = file.with_suffix(".sh")
        script.write_bytes(written.stdout)
        # What the tasks print lies beside the script, not in the folder of the search's user.
        printed = str(file.with_suffix("")).replace("%", "%%") + "-%a.out"
        submission = ["sbatch", "--wait", "--quiet", f"--output={printed}", str(script)]
        try:
            return called(submission).returncode
        except NoProgram:
            print("sensel-sweep: --engine slurm: there is no sbatch here; run this on a login node of the cluster", file=sys.stderr)
            return 2

    def words(self, part: str, file: Path, out: Path) -> list[str]:
        """A command of `sensel sweep` on a file."""
        return [self.arguments.program, "sweep", part, str(file), "--out", str(out), *self.arguments.rest]


def submit(arguments: argparse.Namespace) -> int:
    """Runs all cells of a sweep file on Dask and returns the worst exit code."""
    code, work = planned(arguments, arguments.file, arguments.out)
    if code:
        return code
    with client_of(arguments) as client:
        return run_on(client, arguments, arguments.file, arguments.out, work)
