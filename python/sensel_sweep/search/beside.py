"""Compares the held-out runs of two searches of one question: whether their fronts differ by more than the runs leave open."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from .chart import digits
from .designs import Goals
from .failure import Failure
from .outcome import Held, Judged, Kept, Mean
from .sureness import interval_of, volumes


@dataclass(frozen=True)
class Other:
    """Another search's evaluation of its front."""

    name: str
    seed: int
    sampler: str
    cells: int
    held: list[Held]


def read(folder: Path, goals: Goals) -> Other:
    """From a search's report.json."""
    path = folder / "report.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        objectives = [(one["figure"], one["goal"] == "maximise") for one in found["objectives"]]
        held = [
            Held(
                tuple(
                    Mean(mean["mean"], tuple(mean["interval"]) if mean["interval"] else None, mean["runs"], mean["lost"])
                    for mean in one["means"].values()
                ),
                tuple(Kept(kept["met"], kept["runs"], tuple(kept["interval"]), kept["verdict"]) for kept in one["constraints"].values()),
            )
            for one in found["final"]
        ]
        other = Other(str(folder), found["seed"], found["sampler"], found["cells"], held)
        constraints = found["constraints"]
    except OSError as error:
        raise Failure(f"--beside {folder}: {error.strerror}; name the folder of a finished search") from None
    except (ValueError, KeyError, TypeError):
        raise Failure(f"--beside {folder}: report.json is none of a search; name the folder of a finished search") from None
    if objectives != [(one.figure, one.is_maximised) for one in goals.objectives]:
        raise Failure(f"--beside {folder}: that search has other objectives")
    if constraints != [one.text for one in goals.constraints]:
        raise Failure(f"--beside {folder}: that search has other constraints")
    return other


def sentences(goals: Goals, all_judged: list[Judged], other: Other) -> list[str]:
    """What the other search says of this one."""
    name = f"{other.name} (search seed {other.seed}, {other.sampler}, {other.cells} cells)"
    sides = volumes(goals, [all_judged, other.held])
    if sides is None:
        return [f"Neither this search nor {name} has a design that held-out runs could measure, so the fronts cannot be compared."]
    here, there = sides
    low, high = interval_of(here.draws - there.draws)
    what = "hypervolume of the front" if len(goals.objectives) > 1 else f"best {goals.objectives[0].figure}"
    better = "here" if here.measured > there.measured else "there"
    differs = f"the {what} differs by {digits(abs(here.measured - there.measured))}, better {better}"
    resolution = goals.objectives[0].resolution
    if low <= 0.0 <= high:
        verdict = "the front has not moved by more than its intervals"
    elif max(-low, high) <= resolution:
        verdict = f"the front has not moved by more than the resolution of {digits(resolution)}"
    elif max(low, -high) <= resolution:
        verdict = f"the runs do not show that the front has moved by more than the resolution of {digits(resolution)}"
    else:
        verdict = "the front has moved"
    return [f"Beside {name}: {differs}. The runs leave open {digits(low)} to {digits(high)} (95 %, above 0 better here), so {verdict}."]
