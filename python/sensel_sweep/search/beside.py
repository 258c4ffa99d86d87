"""Compares the held-back runs of two searches of one question: whether the front of one lies beyond that of the other by more than the
intervals of both."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

from .choice import best, weights_of
from .designs import Wanted, hypervolume, place
from .failure import Failure
from .outcome import Judged, Mean


@dataclass(frozen=True)
class Other:
    """Another search's evaluation of its front."""

    name: str
    seed: int
    sampler: str
    cells: int
    chosen: int | None
    # Means by design, of those that keep all constraints on the held-back runs.
    means: dict[int, tuple[Mean, ...]]


def read(folder: Path, wish: Wanted) -> Other:
    """From a search's report.json."""
    place_of = folder / "report.json"
    try:
        found = json.loads(place_of.read_text(encoding="utf-8"))
        objectives = [(one["figure"], one["goal"] == "maximise") for one in found["objectives"]]
        means = {
            one["number"]: tuple(
                Mean(mean["mean"], tuple(mean["interval"]) if mean["interval"] else None, mean["runs"], mean["lost"])
                for mean in one["means"].values()
            )
            for one in found["final"]
            if one["is_admissible"]
        }
    except OSError as error:
        raise Failure(f"--beside {folder}: {error.strerror}; name the folder of a finished search") from None
    except (ValueError, KeyError, TypeError):
        raise Failure(f"--beside {folder}: report.json is none of a search; name the folder of a finished search") from None
    if objectives != [(one.figure, one.is_maximised) for one in wish.objectives]:
        raise Failure(f"--beside {folder}: that search has other objectives")
    return Other(str(folder), found["seed"], found["sampler"], found["cells"], found["chosen"], means)


def half(mean: Mean) -> float:
    """Of the interval; 0 where there is none."""
    return 0.5 * (mean.interval[1] - mean.interval[0]) if mean.interval else 0.0


def clearly_better(wish: Wanted, first: tuple[Mean, ...], second: tuple[Mean, ...]) -> bool:
    """Whether the first is better in every objective by more than both intervals leave open."""
    return all(
        one.sign * (b.value - a.value) > math.hypot(half(a), half(b)) for one, a, b in zip(wish.objectives, first, second)
    )


def on_front(wish: Wanted, means: dict[int, tuple[Mean, ...]]) -> list[int]:
    """Designs that no other beats in every objective; with one objective the best one."""
    values = {number: tuple(mean.value for mean in own) for number, own in means.items()}
    if len(wish.objectives) == 1:
        number = best(wish, values, weights_of(wish))
        return [] if number is None else [number]
    places = {number: place(wish, own) for number, own in values.items()}
    return [number for number, own in places.items() if not any(all(a < b for a, b in zip(other, own)) for other in places.values())]


def moved(wish: Wanted, here: dict[int, tuple[Mean, ...]], there: dict[int, tuple[Mean, ...]]) -> list[int]:
    """Designs of the front here that some design there clearly beats."""
    return [number for number in on_front(wish, here) if any(clearly_better(wish, other, here[number]) for other in there.values())]


def volumes(wish: Wanted, sides: list[dict[int, tuple[Mean, ...]]]) -> list[float]:
    """Hypervolume of each side's held-back means below a common reference: the worst of all, a tenth of the span further out."""
    places = [[place(wish, tuple(mean.value for mean in own)) for own in side.values()] for side in sides]
    columns = list(zip(*[one for side in places for one in side]))
    reference = [max(column) + 0.1 * ((max(column) - min(column)) or abs(max(column)) or 1.0) for column in columns]
    return [hypervolume(side, reference) for side in places]


def sentences(wish: Wanted, all_judged: list[Judged], other: Other) -> list[str]:
    """What the other search says of this one."""
    here = {one.number: one.means for one in all_judged if one.is_admissible}
    name = f"{other.name} (search seed {other.seed}, {other.sampler}, {other.cells} cells)"
    if not here or not other.means:
        which = "Neither search has" if not here and not other.means else "This search has" if not here else f"{name} has"
        return [f"{which} a design that keeps all constraints on the held-back runs, so the fronts cannot be compared."]
    here_beaten, there_beaten = moved(wish, here, other.means), moved(wish, other.means, here)
    beaten = "beaten in every objective by more than the intervals"
    if not here_beaten and not there_beaten:
        verdict = f"no design of either front is {beaten}"
    else:
        sides = ((here_beaten, here, "this"), (there_beaten, other.means, "that"))
        parts = [f"{len(some)} of {len(on_front(wish, side))} designs of {whose} front are {beaten}" for some, side, whose in sides if some]
        verdict = "; ".join(parts)
    lines = [f"Beside {name}: {verdict}."]
    if len(wish.objectives) > 1:
        own, theirs = volumes(wish, [here, other.means])
        lines.append(f"Hypervolume of the held-back means below a common reference: {own:.4g} here, {theirs:.4g} there.")
    else:
        [number], [there] = on_front(wish, here), on_front(wish, other.means)
        a, b = here[number][0], other.means[there][0]
        figure = wish.objectives[0].figure
        lines.append(f"{figure}: {a.value:.5g} \u00b1 {half(a):.2g} here, {b.value:.5g} \u00b1 {half(b):.2g} there.")
    return lines
