"""`sensel-sweep submit`, `search` and `report`."""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

from . import cluster
from .processes import NoProgram, stoppable


def add_engine(part: argparse.ArgumentParser, engines: list[str], chunk: int) -> None:
    """Options of everything that runs cells."""
    part.add_argument("--engine", choices=engines, default=engines[0])
    part.add_argument("--program", default="sensel", help="the program sensel on the workers")
    part.add_argument("--scheduler", help="address of a running scheduler")
    part.add_argument("--jobqueue", choices=sorted(cluster.QUEUES))
    part.add_argument("--jobs", type=int, default=4, help="of a queue; parts of a batch with --engine slurm")
    part.add_argument("--cores", type=int, default=1)
    part.add_argument("--memory", default="4GB")
    part.add_argument("--workers", type=int, default=2, help="of a local cluster")
    part.add_argument("--chunk", type=int, default=chunk, help="cells of a task")
    part.add_argument("--retries", type=int, default=3)


def add_other_search(part: argparse.ArgumentParser) -> None:
    """Options that make another search of one file."""
    part.add_argument("--seed", type=int, help="search seed, in place of the file's")
    part.add_argument("--sampler", help="sampler, in place of the file's: random for a search to compare with")


def parser() -> argparse.ArgumentParser:
    """All words of the command line."""
    top = argparse.ArgumentParser(prog="sensel-sweep", description="Runs and searches sweeps of sensel.", allow_abbrev=False)
    parts = top.add_subparsers(dest="part", required=True)
    submit = parts.add_parser("submit", help="runs all cells of a sweep file on Dask", allow_abbrev=False)
    submit.add_argument("file")
    submit.add_argument("--out", required=True, help="folder of the sweep, seen by all workers")
    add_engine(submit, ["dask"], 16)
    search = parts.add_parser(
        "search",
        help="finds designs: writes batches of cells, runs them, proposes the next ones",
        description="Options that are not listed here, such as --cache and --photons-gib, go to 'sensel sweep'.",
        allow_abbrev=False,
    )
    search.add_argument("file")
    search.add_argument("--out", help="folder of the search; out/searches/NAME unless given")
    add_other_search(search)
    add_engine(search, ["local", "dask", "slurm", "none"], 4)
    report = parts.add_parser("report", help="writes the report of a search again, from its finished cells", allow_abbrev=False)
    report.add_argument("file")
    report.add_argument("--out", help="folder of the search; out/searches/NAME unless given")
    report.add_argument("--program", default="sensel")
    beside = "folder of another search of the same question; may be repeated"
    report.add_argument("--beside", action="append", default=[], metavar="FOLDER", help=beside)
    add_other_search(report)
    return top


def main() -> None:
    """The command line; ends with an exit code as `sensel` has them."""
    with stoppable():
        try:
            code = run()
        except NoProgram as missing:
            print(f"sensel-sweep: --program {missing}; name the program sensel with --program", file=sys.stderr)
            code = 2
        except KeyboardInterrupt:
            print("sensel-sweep: stopped; finished cells are kept, call it again to go on", file=sys.stderr)
            code = 130
    sys.exit(code)


def run() -> int:
    """Reads the words of the command line and does what they say; an exit code."""
    arguments, rest = parser().parse_known_args()
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Names of files that are no UTF-8 are printed as they are.
        sys.stdout.reconfigure(errors="surrogateescape")
    arguments.rest = rest
    arguments.file = str(Path(arguments.file).resolve())
    if arguments.out:
        arguments.out = str(Path(arguments.out).resolve())
    if arguments.part == "submit":
        return cluster.submit(arguments)
    try:
        from . import search
    except ModuleNotFoundError as missing:
        print(f"sensel-sweep: a search needs {missing.name}: pip install 'sensel-sweep[search]'", file=sys.stderr)
        return 2
    return search.main(arguments)
