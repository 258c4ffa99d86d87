"""Rungs of fidelity: cheaper cells that choose which proposals run in full. A rung is used only if its figures rank the first round's
designs as full cells do."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass, replace
from statistics import NormalDist, median
from typing import TYPE_CHECKING

from .batch import Result, Run, write_whole
from .designs import TRACKED, Design, Goals, Summary, best_first, summary
from .failure import damaged, one_line
from .file import Rung, SearchFile

if TYPE_CHECKING:
    from ..cluster import Engine
    from .loop import State

# Fewest designs with a figure on the rung and in full: fewer tell no correlation.
DESIGNS_LEAST = 6
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Agreement:
    """Of a figure on a rung with the same figure in full: Spearman's rank correlation over designs, and the median ratio."""

    figure: str
    correlation: float | None
    interval: tuple[float, float] | None
    designs: int
    ratio: float | None


def trajectories_of(search: SearchFile, rung: Rung) -> tuple:
    """The search's first ones."""
    return search.trajectories[: rung.trajectories or len(search.trajectories)]


def cells_of(search: SearchFile, rung: Rung) -> int:
    """Of one design."""
    return rung.seeds * len(trajectories_of(search, rung))


def full_cells(search: SearchFile, rung: Rung, designs: int) -> int:
    """What a rung's cells count as, in full cells."""
    return math.ceil(rung.cost * cells_of(search, rung) * designs - 1e-9)


def cells_of_design(search: SearchFile, rungs: list[Rung]) -> float:
    """Full cells that a new design costs together with those that the rungs leave out for it."""
    cost, wide = float(search.replicates), 1.0
    for rung in reversed(rungs):
        wide /= rung.keep
        cost += rung.cost * cells_of(search, rung) * wide
    return cost


def widened(count: int, rungs: list[Rung]) -> int:
    """Proposals of which `count` pass all rungs."""
    for rung in rungs:
        count = math.ceil(count / rung.keep - 1e-9)
    return count


def keys_at(search: SearchFile, rung: Rung, keys: dict) -> dict:
    """A full cell's keys on a rung."""
    keys = {**keys, **rung.set}
    if rung.frames < 1.0:
        full = keys.get("run.frames", search.set.get("run.frames"))
        keys["run.frames"] = max(1, math.ceil(rung.frames * full))
    return keys


def run(state: State, engine: Engine, number: int, turn: int, designs: list[Design]) -> list[Design]:
    """Runs designs on a rung. The results are those of the rung; designs that the scenario refuses have none."""
    from .loop import assigned, find_refused, finished, runs_of

    search, rung = state.search, state.search.rungs[number]
    path = state.out / "rounds" / f"{turn:03d}-rung{number}.json"
    own = [Design(at, design.is_, turn) for at, design in enumerate(designs)]
    seeds, trajectories = list(range(1, rung.seeds + 1)), trajectories_of(search, rung)
    runs = [one for design in own for one in runs_of(trajectories, design.number, seeds)]

    def cells(some: list[Run]) -> list[tuple[str, dict]]:
        return [(one.label, keys_at(search, rung, assigned(search, trajectories, own[one.design], one))) for one in some]

    if path.exists():
        try:
            refused = {int(at): why for at, why in json.loads(path.read_text(encoding="utf-8")).items()}
        except (ValueError, TypeError, AttributeError, RecursionError):
            raise damaged(path, "delete it, and the search writes it again from its finished cells") from None
    else:
        refused = find_refused(state, engine, cells, runs)
    accepted = [one for one in runs if one.design not in refused]
    for at, why in refused.items():
        own[at].refusal = why
    if not accepted:
        return own
    comment = f"Round {turn} of {search.path.name}, rung '{rung.name}'"
    results = finished(state, engine, path, cells(accepted), comment)
    if not path.exists():
        write_whole(path, json.dumps(refused) + "\n")
    for one in accepted:
        own[one.design].results[one] = results[one.label]
    return own


def figures_of(goals: Goals) -> list[str]:
    """Those of objectives and constraints, each once."""
    return list(dict.fromkeys(one.figure for one in (*goals.objectives, *goals.constraints)))


def mean(goals: Goals, figure: str, design: Design) -> float | None:
    """Over the runs that have the figure."""
    values = [value for value in (goals.value(figure, one) for one in design.results.values()) if value is not None]
    return math.fsum(values) / len(values) if values else None


def agreements(goals: Goals, full: list[Design], on_rung: list[Design]) -> list[Agreement]:
    """By figure. A figure that is the same for all designs tells nothing and has no correlation."""
    # Only searches with rungs need it, and it takes a second to load.
    from scipy.stats import spearmanr

    found = []
    for figure in figures_of(goals):
        pairs = [(mean(goals, figure, low), mean(goals, figure, high)) for low, high in zip(on_rung, full)]
        pairs = [(low, high) for low, high in pairs if low is not None and high is not None]
        ratios = [high / low for low, high in pairs if low > 0.0 and high > 0.0]
        ratio = median(ratios) if ratios and len(ratios) == len(pairs) else None
        lows, highs = [low for low, _ in pairs], [high for _, high in pairs]
        if len(pairs) < DESIGNS_LEAST or len(set(lows)) < 2 or len(set(highs)) < 2:
            found.append(Agreement(figure, None, None, len(pairs), ratio))
            continue
        rho = float(spearmanr(lows, highs).statistic)
        found.append(Agreement(figure, rho, interval_of(rho, len(pairs)), len(pairs), ratio))
    return found


def interval_of(rho: float, count: int) -> tuple[float, float]:
    """Of Spearman's correlation, by Fisher's z with the variance of Bonett and Wright (2000)."""
    z = math.atanh(max(min(rho, 1.0 - 1e-12), -1.0 + 1e-12))
    half = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2) * math.sqrt((1.0 + 0.5 * rho * rho) / (count - 3))
    return math.tanh(z - half), math.tanh(z + half)


def least(found: list[Agreement]) -> float | None:
    """The lowest correlation of any figure of the objectives and constraints; none where none could be measured."""
    return min((one.correlation for one in found if one.correlation is not None), default=None)


def is_used(rung: Rung, found: list[Agreement], goals: Goals) -> bool:
    """Whether the figures of every objective were measured, and all agree as well as the file asks."""
    wanted = {one.figure for one in goals.objectives}
    known = {one.figure for one in found if one.correlation is not None}
    lowest = least(found)
    return wanted <= known and lowest is not None and lowest >= rung.correlation


def measure(state: State, engine: Engine, designs: list[Design]) -> int:
    """Runs the first round's designs on every rung, states how far they agree with full cells, and returns what that cost in full cells."""
    cost = 0
    for number, rung in enumerate(state.search.rungs):
        found = agreements(state.goals, designs, run(state, engine, number, 0, designs))
        state.agreements[number] = found
        cost += full_cells(state.search, rung, len(designs))
        if not is_used(rung, found, state.goals):
            print(f"sensel-sweep: rung '{one_line(rung.name)}' is left out: {reason(rung, found, state.goals)}", file=sys.stderr)
    return cost


def reason(rung: Rung, found: list[Agreement], goals: Goals) -> str:
    """Why a rung is used or left out."""
    lowest = least(found)
    known = {one.figure for one in found if one.correlation is not None}
    unknown = [one.figure for one in goals.objectives if one.figure not in known]
    if unknown or lowest is None:
        which = " and ".join(unknown) or "any figure"
        return f"no rank correlation for {which}: fewer than {DESIGNS_LEAST} designs have it on the rung and in full, or all the same value"
    which = next(one for one in found if one.correlation == lowest)
    compared = "at least" if lowest >= rung.correlation else "below"
    return (
        f"rank correlation with full cells is {lowest:.2f} for {which.figure} over {which.designs} designs, "
        f"{compared} {rung.correlation:g}"
    )


def used(state: State) -> list[int]:
    """Numbers of the rungs that agree with full cells."""
    return [
        number
        for number, rung in enumerate(state.search.rungs)
        if number in state.agreements and is_used(rung, state.agreements[number], state.goals)
    ]


def scaled(goals: Goals, found: list[Agreement], design: Design) -> Summary:
    """What a rung says of a design, with every figure multiplied by the median ratio of full cells to the rung's."""
    shares = set(TRACKED.values())
    ratios = {one.figure: one.ratio for one in found if one.ratio is not None and one.figure not in shares}

    def of(result: Result) -> Result:
        figures = {name: value if value is None else value * ratios.get(name, 1.0) for name, value in result.figures.items()}
        return replace(result, figures=figures)

    results = {one: of(result) for one, result in design.results.items()}
    return summary(goals, Design(design.number, design.is_, design.round, results=results))


def estimate(left_out: dict, turn: int) -> Summary:
    """What a rung said of a proposal that it left out, for the sampler."""
    return Summary(Design(-1, left_out["is"], turn), tuple(left_out["means"]), tuple(left_out["excess"]), 0)


def sieved(state: State, engine: Engine, designs: list[Design], turn: int, count: int) -> tuple[list[Design], list[dict], int]:
    """The designs that pass all rungs, `count` at most; what is known of the others; and what the rungs' cells count as in full cells."""
    left, out, cost = designs, [], 0
    numbers = used(state)
    for index, number in enumerate(numbers):
        rung = state.search.rungs[number]
        on_rung = run(state, engine, number, turn, left)
        cost += full_cells(state.search, rung, len(left))
        ordered = best_first(state.goals, [scaled(state.goals, state.agreements[number], one) for one in on_rung])
        keep = count if index + 1 == len(numbers) else max(count, math.ceil(rung.keep * len(left) - 1e-9))
        kept = sorted(one.design.number for one in ordered[:keep])
        others = [one for one in ordered if one.design.number not in kept]
        out += [{"is": one.design.is_, "means": one.means, "excess": one.excess} for one in others]
        left = [left[at] for at in kept]
    return left, out, cost
