"""Weighs objectives against each other: which design to choose, and what it would be at other prices."""

from __future__ import annotations

import math

from .designs import Design, Summary, Wanted, best_first, front, layers, summaries_of
from .file import SearchFile


def score(wish: Wanted, means: tuple[float | None, ...], weights: list[float], all_means: list[tuple]) -> float:
    """The price of a design, small being good: the sum of weighted logarithms, so that one percent of each objective weighs its weight.

    Where a figure is not above zero in all designs, its share of the span of all designs takes the logarithm's place."""
    total = 0.0
    for number, (objective, weight) in enumerate(zip(wish.objectives, weights)):
        values = [one[number] for one in all_means]
        if all(value > 0.0 for value in values):
            part = math.log(means[number])
        else:
            part = (means[number] - min(values)) / ((max(values) - min(values)) or 1.0)
        total += weight * objective.sign * part
    return total


def best(wish: Wanted, means: dict[int, tuple], weights: list[float]) -> int | None:
    """The design of the least price."""
    if not means:
        return None
    everything = list(means.values())
    return min(means, key=lambda number: (score(wish, means[number], weights, everything), number))


def weights_of(wish: Wanted) -> list[float]:
    """As the file states them."""
    return [one.weight for one in wish.objectives]


def margin(wish: Wanted, one: Summary) -> float:
    """By how much a feasible design keeps the limits that a share of the runs must keep, small being good: the worst of them. A limit that is kept
    exactly, as counts and shares are, says nothing of that."""
    kept = [excess for constraint, excess in zip(wish.constraints, one.excess) if constraint.share is not None and excess != 0.0]
    return max(kept, default=0.0)


def by_margin(wish: Wanted, summaries: list[Summary], count: int) -> list[int]:
    """The design of the least price, and those that keep their limits by more than every cheaper one; evenly among them where there are more
    than the count. A search ends where its own runs just keep a limit, so other runs may not."""
    feasible = {one.design.number: one for one in summaries if one.is_feasible}
    all_means, weights = [one.means for one in feasible.values()], weights_of(wish)
    found: list[int] = []
    for number in sorted(feasible, key=lambda at: (score(wish, feasible[at].means, weights, all_means), at)):
        if not found or margin(wish, feasible[number]) < margin(wish, feasible[found[-1]]):
            found.append(number)
    if len(found) <= count:
        return found
    return [found[at * (len(found) - 1) // max(count - 1, 1)] for at in range(count)]


def choices_of(search: SearchFile, design: Design) -> list:
    """Its values of the factors that are no ranges."""
    return [design.is_.get(factor.name) for factor in search.factors if not factor.is_range]


def finalists(search: SearchFile, wish: Wanted, designs: list[Design], count: int) -> list[int]:
    """Designs to evaluate anew: the best one at the stated prices, and up to half as many as the count with more margin; those at prices that
    favour each objective; others along the front; the next behind it, first those with other values of the factors that are no ranges, since what
    few runs misjudge they misjudge in neighbours alike; where none keeps all constraints, those that miss them least; and every guess."""
    summaries = summaries_of(wish, designs)
    on_front = front(wish, summaries)
    means = {one.design.number: one.means for one in on_front}
    chosen: list[int] = []

    def add(number: int | None) -> None:
        if number is not None and number not in chosen and len(chosen) < count:
            chosen.append(number)

    weights = weights_of(wish)
    for number in by_margin(wish, summaries, min(1 + count // 2, count)):
        add(number)
    for number in range(len(weights)):
        add(best(wish, means, [2.0 * weight if place == number else weight for place, weight in enumerate(weights)]))
    for one in on_front[:: max(1, math.ceil(len(on_front) / max(count, 1)))]:
        add(one.design.number)
    # Where no design keeps all constraints, those that miss them least.
    ordered = list(layers(wish, summaries) if on_front else best_first(wish, [one for one in summaries if one.runs]))
    seen = [choices_of(search, designs[number]) for number in chosen]
    for one in ordered:
        if choices_of(search, one.design) not in seen:
            seen.append(choices_of(search, one.design))
            add(one.design.number)
    for one in ordered:
        add(one.design.number)
    known = {one.design.number for one in summaries if one.runs}
    guesses = [one.design.number for one in summaries if one.design.guess and one.design.number in known]
    return sorted({*chosen, *guesses})
