"""Batches of cells as ordinary sweep files, and their figures from the tables that `sensel sweep gather` writes."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from ..cluster import Engine
from ..processes import called
from .failure import Failure, one_line
from .file import SearchFile

# Exit codes of `sensel`.
DONE, USAGE, SOME_FAILED = 0, 2, 3


@dataclass(frozen=True)
class Run:
    """One cell of a search: a design on a trajectory with a seed."""

    design: int
    trajectory: str | None
    seed: int

    @property
    def label(self) -> str:
        """Name of the cell in a sweep file."""
        return "/".join([f"design {self.design}", *([self.trajectory] if self.trajectory else []), f"seed {self.seed}"])


@dataclass(frozen=True)
class Result:
    """A finished cell: figures by name, none where one could not be measured; no figure at all where the cell failed."""

    has_failed: bool
    figures: dict[str, float | None]


def value_text(value: object) -> str:
    """A value as TOML writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, list):
        return f"[{', '.join(value_text(one) for one in value)}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(key)} = {value_text(one)}" for key, one in value.items()) + " }"
    # JSON does not escape DEL; TOML does.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f") if isinstance(value, str) else str(value)


def sweep_text(search: SearchFile, folder: Path, cells: list[tuple[str, dict]], comment: str) -> str:
    """A sweep file with these cells."""
    beside = search.path.parent / search.scenario
    # A folder of results may have the name of a scenario that the program knows.
    is_scenario = beside.is_file() or (beside / "scene.toml").is_file()
    scenario = os.path.relpath(beside, folder) if is_scenario else search.scenario
    try:
        scenario.encode()
    except UnicodeEncodeError:
        reason = "a folder on its path has a name that is no UTF-8, so a sweep file cannot name it; rename the folder"
        raise Failure(f"{search.path}: scenario = {search.scenario}: {reason}") from None
    lines = [f"# {one_line(comment)}", f"scenario = {value_text(scenario)}", 'method = "list"']
    if search.cameras_alone:
        lines.append("cameras_alone = true")
    if search.set:
        lines += ["", "[set]", *(f"{json.dumps(key)} = {value_text(value)}" for key, value in search.set.items())]
    for label, assigned in cells:
        lines += ["", "[[cell]]", f"name = {value_text(label)}", f"set = {value_text(assigned)}"]
    return "\n".join(lines) + "\n"


def write_whole(path: Path, text: str) -> None:
    """Writes a file beside the path and renames it, so that a kill leaves no half file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(f".{os.getpid()}.part")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)


def refusal(engine: Engine, search: SearchFile, cells: list[tuple[str, dict]], figures: list[str]) -> str | None:
    """What the program has against these cells or figures; runs none of them."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        file, none = folder / "check.toml", folder / "no.cells"
        file.write_text(sweep_text(search, folder, cells, "Checks cells"), encoding="utf-8")
        none.write_text("", encoding="utf-8")
        words = engine.words("run", file, folder / "sweep") + ["--cells", str(none), "--quiet"]
        for figure in figures:
            words += ["--spec", f"{figure} >= 0 for 50 %"]
        said = called(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="backslashreplace")
    if said.returncode == DONE:
        return None
    lines = [line for line in said.stderr.splitlines() if line.strip()]
    last = lines[-1] if lines else f"'sensel sweep run' ended with exit code {said.returncode}"
    # The file's name and line are those of a file that the user never sees.
    return re.sub(r"^(sensel: )?(\S*check\.toml(:\d+)?: )?", "", last)


def gathered(engine: Engine, file: Path, out: Path, table: Path) -> dict[str, Result]:
    """The finished cells of a sweep file by label; keeps the table beside the file."""
    said = called(engine.words("gather", file, out) + ["--quiet"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    if said.returncode != DONE:
        return {}
    write_whole(table, (out / "cells.csv").read_text(encoding="utf-8"))
    return read_table(table)


def read_table(table: Path) -> dict[str, Result]:
    """Results by label; none of a damaged table, which is then gathered again. The columns begin with the cell's name, its status and its
    label."""
    try:
        text = table.read_bytes().decode("utf-8")
        head, *rows = csv.reader(io.StringIO(text, newline=""))
        # A last line without its end was cut, perhaps within a number.
        if not text.endswith("\n") or any(len(row) != len(head) for row in rows):
            return {}
        figures = [(column, name) for column, name in enumerate(head) if column > 2 and not name.startswith("config.")]
        found = {}
        for row in rows:
            values = {name: float(row[column]) if row[column] else None for column, name in figures}
            found[row[2]] = Result(row[1] != "done", values)
    except (ValueError, IndexError, csv.Error):
        return {}
    return found


def reason_of_failure(out: Path) -> str:
    """Why some cell failed, from its record."""
    for path in sorted((out / "cells").glob("*/*.json")):
        try:
            error = json.loads(path.read_text(encoding="utf-8").split("\n", 1)[1]).get("error")
        except (ValueError, IndexError, OSError):
            continue
        if error:
            return str(error)
    return "no reason was kept"


def run_batch(engine: Engine, file: Path, out: Path, labels: list[str], said: str) -> dict[str, Result]:
    """Runs what is missing of a sweep file; its results."""
    table = file.with_suffix(".csv")
    found = read_table(table) if table.exists() else {}
    if set(labels) <= set(found):
        return found
    found = gathered(engine, file, out, table)
    if set(labels) <= set(found):
        return found
    print(f"sensel-sweep: {one_line(said)}", file=sys.stderr)
    code = engine.run(file, out)
    if code not in (DONE, SOME_FAILED):
        raise Failure(f"{file}: 'sensel sweep run' ended with exit code {code}; finished cells are kept, search again to go on", code)
    found = gathered(engine, file, out, table)
    missing = [label for label in labels if label not in found]
    if missing:
        raise Failure(f"{file}: {len(missing)} of {len(labels)} cells have no result; search again to go on", SOME_FAILED)
    return found
