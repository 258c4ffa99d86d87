"""Searches for designs: batches of a sweep's cells, proposed from the finished ones."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..cluster import Engine
from . import file, final, loop, report
from .failure import Failure, one_line


def main(arguments: argparse.Namespace) -> int:
    """`sensel-sweep search` and `sensel-sweep report`; an exit code."""
    if arguments.part == "report":
        arguments.engine = "none"
    try:
        own = {key: value for key in ("seed", "sampler") if (value := getattr(arguments, key)) is not None}
        search = file.read(Path(arguments.file), own)
        out = Path(arguments.out or Path("out") / "searches" / search.path.stem).resolve()
        state = loop.State(search, out, reads_only=arguments.part == "report")
        with Engine(arguments) as engine:
            final.search_all(state, engine)
        report.write(state, [Path(folder) for folder in getattr(arguments, "beside", [])])
        return 0
    except loop.Paused:
        if arguments.part == "report":
            print(f"sensel-sweep: {one_line(str(out))}: no round has ended yet; run 'sensel-sweep search' first", file=sys.stderr)
            return 2
        return 0
    except Failure as failure:
        print(f"sensel-sweep: {failure}", file=sys.stderr)
        return failure.code
    except OSError as error:
        print(f"sensel-sweep: {one_line(str(error))}", file=sys.stderr)
        return 4
