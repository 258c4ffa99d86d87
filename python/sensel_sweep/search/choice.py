"""Weighs objectives against each other: which design to choose, and what it would be at other prices."""

from __future__ import annotations

import math

from .designs import Design, Goals, Summary, best_first, dominates, front, layers, objective_vector, summaries_of
from .file import SearchFile

# A design may still keep a share of runs, or still be the best, if it falls short by no more than so many standard errors.
STANDARD_ERRORS = 1.0
# Free places of the final evaluation are for designs that fall short by no more than so many.
STANDARD_ERRORS_MOST = 3.0


def price(goals: Goals, means: tuple[float | None, ...], weights: list[float], all_means: list[tuple]) -> float:
    """The price of a design, small being good: the sum of weighted logarithms, so that one percent of each objective weighs its weight.

    Where a figure is not above zero in all designs, its share of the span of all designs takes the logarithm's place."""
    total = 0.0
    for number, (objective, weight) in enumerate(zip(goals.objectives, weights)):
        values = [one[number] for one in all_means]
        if all(value > 0.0 for value in values):
            part = math.log(means[number])
        else:
            part = (means[number] - min(values)) / ((max(values) - min(values)) or 1.0)
        total += weight * objective.sign * part
    return total


def best(goals: Goals, means: dict[int, tuple], weights: list[float]) -> int | None:
    """The design of the least price."""
    if not means:
        return None
    everything = list(means.values())
    return min(means, key=lambda number: (price(goals, means[number], weights, everything), number))


def weights_of(goals: Goals) -> list[float]:
    """As the file states them."""
    return [one.weight for one in goals.objectives]


def margin(goals: Goals, one: Summary) -> float:
    """By how much a design keeps the limits that a share of the runs must keep, small being good: the worst of them, above 0 where it misses one.
    A limit that is kept exactly, as counts and shares are, says nothing of that."""
    kept = [excess for constraint, excess in zip(goals.constraints, one.excess) if constraint.share is not None and excess != 0.0]
    return max(kept, default=0.0)


def by_price(goals: Goals, summaries: list[Summary]) -> list[Summary]:
    """Designs that keep their limits by more than every cheaper one, the cheapest first."""
    all_means, weights = [one.means for one in summaries], weights_of(goals)
    found: list[Summary] = []
    for one in sorted(summaries, key=lambda one: (price(goals, one.means, weights, all_means), one.design.number)):
        if not found or margin(goals, one) < margin(goals, found[-1]):
            found.append(one)
    return found


def outcome(goals: Goals, design: Design) -> tuple:
    """The figures of all limits on a share in the runs of the first seed. Two designs that share them differ in keys that reach none of these
    figures, so they miss in the same held-out runs. A figure that is the same in all runs tells nothing."""
    figures = [one.figure for one in goals.constraints if one.share is not None]
    results = {run.trajectory or "": result for run, result in design.results.items() if run.seed == 1}
    found = tuple(goals.value(figure, results[trajectory]) for figure in figures for trajectory in sorted(results))
    return found if len(set(found)) > 1 else (design.number,)


def distinct(goals: Goals, summaries: list[Summary]) -> list[Summary]:
    """The best of those that share an outcome, first those that miss no other constraint. All of them with several objectives, since such designs
    may lie on a front together."""
    if len(goals.objectives) > 1:
        return summaries

    def rank(one: Summary) -> tuple:
        # The last excess is that of failed cells.
        others = [excess for constraint, excess in zip((*goals.constraints, None), one.excess) if constraint is None or constraint.share is None]
        return (max(others) > 0.0, math.inf if one.means[0] is None else goals.objectives[0].sign * one.means[0], one.design.number)

    first: dict[tuple, Summary] = {}
    for one in sorted(summaries, key=rank):
        first.setdefault(outcome(goals, one.design), one)
    return [one for one in summaries if first[outcome(goals, one.design)] is one]


def evenly(summaries: list[Summary], count: int) -> list[int]:
    """At most so many of these, evenly among them and with the first."""
    if len(summaries) > count:
        summaries = [summaries[at * (len(summaries) - 1) // max(count - 1, 1)] for at in range(count)]
    return [one.design.number for one in summaries]


def about_the_limit(goals: Goals, designs: list[Design], summaries: list[Summary], count: int) -> list[int]:
    """The design of the least price; up to half as many as the count that keep their limits by more, since a search ends where its own runs just
    keep a limit, so other runs may not; and up to a quarter that are cheaper and miss a limit by less than their runs leave open."""
    kept = by_price(goals, [one for one in summaries if one.is_feasible])
    if not kept:
        return []
    hopeful = {one.design.number for one in summaries_of(goals, designs, STANDARD_ERRORS) if one.is_feasible}
    may_keep = by_price(goals, [one for one in summaries if one.design.number in hopeful])
    cheaper = [one for one in may_keep if not one.is_feasible]
    # First the one that misses by least.
    return evenly(kept, min(1 + count // 2, count)) + evenly(cheaper[::-1], count // 4)


def about_to_keep(goals: Goals, designs: list[Design], summaries: list[Summary], on_front: list[Summary]) -> list[Summary]:
    """Designs that miss limits on a share by at most `STANDARD_ERRORS_MOST`, nothing else, and that no kept one is better than: those first that
    miss by least. They are tried where few designs seem to keep the limits."""
    may_keep = {one.design.number for one in summaries_of(goals, designs, STANDARD_ERRORS_MOST) if one.is_feasible}
    kept = [objective_vector(goals, one.means) for one in on_front]
    missing = [one for one in summaries if one.design.number in may_keep and not one.is_feasible and not one.design.guess]
    better = [one for one in missing if not any(dominates(other, objective_vector(goals, one.means)) for other in kept)]
    return best_first(goals, better)


def choices_of(search: SearchFile, design: Design) -> list:
    """Its values of the factors that are no ranges."""
    return [design.is_.get(factor.name) for factor in search.factors if not factor.is_range]


def finalists(search: SearchFile, goals: Goals, designs: list[Design], count: int) -> list[int]:
    """Designs to evaluate anew: the best one at the stated prices, with others on both sides of the limits; those at prices that favour each
    objective; others along the front; the next behind it, first those with other values of the factors that are no ranges, since what few runs
    misjudge they misjudge in neighbours alike; see `about_to_keep`; and every guess. Of designs that share an outcome the best one goes first."""
    all_summaries = summaries_of(goals, designs)
    summaries = distinct(goals, all_summaries)
    on_front = front(goals, summaries)
    means = {one.design.number: one.means for one in on_front}
    chosen: list[int] = []

    def add(number: int | None) -> None:
        if number is not None and number not in chosen and len(chosen) < count:
            chosen.append(number)

    weights = weights_of(goals)
    for number in about_the_limit(goals, designs, summaries, count):
        add(number)
    for number in range(len(weights)):
        add(best(goals, means, [2.0 * weight if index == number else weight for index, weight in enumerate(weights)]))
    for one in on_front[:: max(1, math.ceil(len(on_front) / max(count, 1)))]:
        add(one.design.number)
    # Where no design keeps all constraints, those that miss them least.
    ordered = list(layers(goals, summaries) if on_front else best_first(goals, [one for one in summaries if one.runs]))
    seen = [choices_of(search, designs[number]) for number in chosen]
    for one in ordered:
        if choices_of(search, one.design) not in seen:
            seen.append(choices_of(search, one.design))
            add(one.design.number)
    repeated = best_first(goals, [one for one in all_summaries if one.runs and one.is_feasible])
    for one in [*ordered, *about_to_keep(goals, designs, summaries, on_front), *repeated]:
        add(one.design.number)
    guesses = [one.design.number for one in all_summaries if one.design.guess and one.runs]
    return sorted({*chosen, *guesses})
