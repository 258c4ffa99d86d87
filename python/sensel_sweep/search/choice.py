"""Weighs objectives against each other: which design to choose, and what it would be at other prices."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from .designs import Design, Wanted, best_first, front, layers, summaries_of
from .file import SearchFile

# By which shares of themselves limits are tightened for finalists.
TIGHTER = (0.1, 0.2, 0.3)


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


def tightened(wish: Wanted, share: float) -> Wanted:
    """With limits that only a share of the runs must keep, tighter by a share of themselves."""
    constraints = tuple(one if one.share is None else one.moved(-share) for one in wish.constraints)
    return replace(wish, constraints=constraints)


def finalists(search: SearchFile, wish: Wanted, designs: list[Design], count: int) -> list[int]:
    """Designs to evaluate anew: the best ones at the stated prices, also with tighter limits, since a search ends where its runs just keep
    them; those at prices that favour each objective; others along the front; the next behind it; where none keeps all constraints, those that miss
    them least; and every guess."""
    summaries = summaries_of(wish, designs)
    on_front = front(wish, summaries)
    means = {one.design.number: one.means for one in on_front}
    chosen: list[int] = []

    def add(number: int | None) -> None:
        if number is not None and number not in chosen and len(chosen) < count:
            chosen.append(number)

    weights = weights_of(wish)
    add(best(wish, means, weights))
    for share in TIGHTER:
        tight = summaries_of(tightened(wish, share), designs)
        add(best(wish, {one.design.number: one.means for one in tight if one.is_feasible}, weights))
    for number in range(len(weights)):
        add(best(wish, means, [2.0 * weight if place == number else weight for place, weight in enumerate(weights)]))
    step = max(1, math.ceil(len(on_front) / max(count, 1)))
    # Where no design keeps all constraints, those that miss them least.
    ordered = layers(wish, summaries) if on_front else best_first(wish, [one for one in summaries if one.runs])
    for one in itertools.chain(on_front[::step], ordered):
        if len(chosen) == count:
            break
        add(one.design.number)
    known = {one.design.number for one in summaries if one.runs}
    guesses = [one.design.number for one in summaries if one.design.guess and one.design.number in known]
    return sorted({*chosen, *guesses})
