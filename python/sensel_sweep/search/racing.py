"""Which designs get more seeds: those that may lie on the front, as far as the noise of their means tells."""

from __future__ import annotations

import math

from .choice import STANDARD_ERRORS, finalists
from .designs import Design, Goals, Summary, layers
from .file import SearchFile


def residual_sd(goals: Goals, summaries: list[Summary], number: int) -> tuple[float, bool]:
    """Standard deviation of an objective between runs of a design, and whether it is that of the logarithm.

    A seed or trajectory that shifts all designs alike is no noise between them: its mean is taken off as well."""
    figure = goals.objectives[number].figure
    table = []
    for one in summaries:
        row = {(run.trajectory, run.seed): goals.value(figure, result) for run, result in one.design.results.items()}
        table.append({key: value for key, value in row.items() if value is not None})
    is_log = all(value > 0.0 for row in table for value in row.values())
    table = [{key: math.log(value) if is_log else value for key, value in row.items()} for row in table if len(row) > 1]
    centred = []
    for row in table:
        mean = math.fsum(row.values()) / len(row)
        centred.append({key: value - mean for key, value in row.items()})
    shifts: dict = {}
    for row in centred:
        for key, value in row.items():
            shifts.setdefault(key, []).append(value)
    common = {key: math.fsum(values) / len(values) for key, values in shifts.items()}
    squares = math.fsum((value - common[key]) ** 2 for row in centred for key, value in row.items())
    freedom = sum(len(row) - 1 for row in centred) - max(len(common) - 1, 0)
    return (math.sqrt(squares / freedom) if freedom > 0 else 0.0), is_log


def near_front(goals: Goals, summaries: list[Summary]) -> list[Summary]:
    """Feasible designs that nothing beats clearly, the best first."""
    feasible = [one for one in summaries if one.is_feasible]
    noise = [residual_sd(goals, feasible, number) for number in range(len(goals.objectives))]

    def scaled(one: Summary) -> list[float]:
        scaled_means = []
        for objective, mean, (_, is_log) in zip(goals.objectives, one.means, noise):
            value = math.log(mean) if is_log else mean
            scaled_means.append(objective.sign * value)
        return scaled_means

    vectors = [scaled(one) for one in feasible]

    def lead(one: Summary, own: list[float]) -> float:
        """The smallest lead of another design over all objectives, in standard errors; the largest of these, 0 at least."""
        leads = [0.0]
        for other, theirs in zip(feasible, vectors):
            if other is one:
                continue
            spread = [max(sd, 1e-12) * math.sqrt(1.0 / one.runs + 1.0 / other.runs) for sd, _ in noise]
            leads.append(min((mine - better) / sd for mine, better, sd in zip(own, theirs, spread)))
        return max(leads)

    ranked = sorted((lead(one, own), one.design.number, one) for one, own in zip(feasible, vectors))
    return [one for ahead, _, one in ranked if ahead <= STANDARD_ERRORS]


def to_confirm(search: SearchFile, goals: Goals, designs: list[Design], hopeful: list[Summary]) -> list[Summary]:
    """The order in which the last cells are spent: first the finalists, fewest runs first, then the designs that may keep all constraints, by
    Pareto rank."""
    numbers = finalists(search, goals, designs, search.final.designs)
    last = sorted((one for one in hopeful if one.design.number in numbers and not one.design.guess), key=lambda one: one.runs)
    return last + [one for one in layers(goals, hopeful) if one not in last]


def seeds_wanted(search: SearchFile, ranked: list[Summary], cells_most: int) -> dict[int, list[int]]:
    """Further seeds by design: each doubles its own, as far as the cells reach."""
    wanted: dict[int, list[int]] = {}
    for one in ranked:
        have = max((run.seed for run in one.design.results), default=0)
        more = list(range(have + 1, min(2 * have, search.seeds_most) + 1))
        cost = len(more) * len(search.trajectories)
        if more and cost <= cells_most:
            wanted[one.design.number] = more
            cells_most -= cost
    return wanted
