"""Compares the held-out runs of two searches of one question: whether their fronts differ by more than the runs leave open."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from .chart import digits
from .checks import finite
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


def is_plausible(one: Held, objectives: int, constraints: int) -> bool:
    """Whether a design's figures are those of runs: one for each objective and constraint, and numbers that belong together."""
    return (
        (len(one.means), len(one.kept)) == (objectives, constraints)
        and all(mean.value is None or finite(mean.value) is not None for mean in one.means)
        and all(is_interval(mean.interval) and mean.count > 1 for mean in one.means if mean.interval is not None)
        and all(is_interval(kept.interval) and 0 <= kept.met <= kept.runs for kept in one.kept)
    )


def is_interval(ends: tuple) -> bool:
    """Whether it has two ends in their order."""
    return len(ends) == 2 and all(finite(end) is not None for end in ends) and ends[0] <= ends[1]


def read(folder: Path, goals: Goals) -> Other:
    """From a search's report.json."""
    path = folder / "report.json"
    advice = "name the folder of a finished search, or write its report anew with 'sensel-sweep report FILE'"
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
        is_whole = all(is_plausible(one, len(set(objectives)), len(set(constraints))) for one in held)
    except OSError as error:
        raise Failure(f"--beside {folder}: report.json: {error.strerror}; {advice}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        is_whole = False
    if not is_whole:
        raise Failure(f"--beside {folder}: report.json is damaged, or not that of a search; {advice}")
    if objectives != [(one.figure, one.is_maximised) for one in goals.objectives]:
        raise Failure(f"--beside {folder}: that search has other objectives")
    if constraints != [one.text for one in goals.constraints]:
        raise Failure(f"--beside {folder}: that search has other constraints")
    return other


def comparisons(goals: Goals, sides: list[list[Held]]) -> list[tuple[str, list[list[Held]]]]:
    """The designs that two searches are compared by, with words for them: all; and as a choice is made, those that are shown to keep every share,
    where both sides have one."""
    has_share = any(one.share is not None for one in goals.constraints)

    def is_shown(one: Held) -> bool:
        return one.is_admissible and all(kept.verdict == "shown" for of, kept in zip(goals.constraints, one.kept) if of.share is not None)

    shown = [[one for one in side if is_shown(one)] for side in sides]
    return [("", sides)] + ([(" of the designs that are shown to keep every share", shown)] if has_share and all(shown) else [])


def sentences(goals: Goals, all_judged: list[Judged], other: Other) -> list[str]:
    """What the other search says of this one."""
    return [compared(goals, other, whose, sides) for whose, sides in comparisons(goals, [all_judged, other.held])]


def compared(goals: Goals, other: Other, whose: str, held: list[list[Held]]) -> str:
    """One comparison in words."""
    name = f"{other.name} (search seed {other.seed}, {other.sampler}, {other.cells} cells)"
    sides = volumes(goals, held)
    if sides is None:
        return f"Neither this search nor {name} has a design that held-out runs could measure, so the fronts cannot be compared."
    here, there = sides
    low, high = interval_of(here.draws - there.draws)
    what = ("hypervolume of the front" if len(goals.objectives) > 1 else f"best {goals.objectives[0].figure}") + whose
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
    return f"Beside {name}: {differs}. The runs leave open {digits(low)} to {digits(high)} (95 %, above 0 better here), so {verdict}."
