"""How sure a front is, given the held-out runs of its designs.

Draws of what the runs leave open (parametric bootstrap): a mean from Student's t about the measured one, and the share of runs that keep a
constraint from the posterior of Jeffreys' prior, Beta(met + 1/2, missed + 1/2). A design counts in the draws where all its shares reach
what is asked, so one that kept a limit for 99 % in all of 20 runs counts in some of them only."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy
from scipy import special

from .designs import Goals, hypervolume, objective_vector, reference_of
from .outcome import CONFIDENCE, Held

DRAWS = 2000


@dataclass(frozen=True)
class Volume:
    """Of a front below a reference: as measured, and by draw. With one objective how far the best design is below the reference."""

    measured: float
    draws: numpy.ndarray


def interval_of(draws: numpy.ndarray) -> tuple[float, float]:
    """Quantiles of 2.5 and 97.5 %."""
    tail = (1.0 - CONFIDENCE) / 2
    low, high = numpy.quantile(draws, [tail, 1.0 - tail], method="inverted_cdf")
    return float(low), float(high)


def drawn_means(held: Held, generator: numpy.random.Generator) -> numpy.ndarray:
    """Means of the objectives, by draw."""
    columns = []
    for one in held.means:
        errors = 0.0
        if one.interval:
            freedom = one.count - 1
            standard_error = 0.5 * (one.interval[1] - one.interval[0]) / float(special.stdtrit(freedom, 0.5 + CONFIDENCE / 2))
            errors = standard_error * generator.standard_t(freedom, DRAWS)
        columns.append(one.value + errors * numpy.ones(DRAWS))
    return numpy.array(columns).T


def drawn_admissible(goals: Goals, held: Held, generator: numpy.random.Generator) -> numpy.ndarray:
    """Whether a design keeps all constraints, by draw. One that names no share must be kept by all runs, and is or is not."""
    admissible = numpy.ones(DRAWS, dtype=bool)
    for constraint, kept in zip(goals.constraints, held.kept):
        if constraint.share is None:
            admissible &= kept.met == kept.runs
        else:
            admissible &= generator.beta(kept.met + 0.5, kept.runs - kept.met + 0.5, DRAWS) >= constraint.share
    return admissible


def drawn(goals: Goals, side: list[Held], seed: int) -> list[tuple[numpy.ndarray, numpy.ndarray]]:
    """Of each measured design of a front, by draw: its means, and whether it keeps all constraints."""
    generator = numpy.random.Generator(numpy.random.PCG64(seed))
    return [(drawn_means(one, generator), drawn_admissible(goals, one, generator)) for one in side if one.is_measured]


def measured_vectors(goals: Goals, side: list[Held]) -> list[list[float]]:
    """Measured means with small being good."""
    return [objective_vector(goals, tuple(mean.value for mean in one.means)) for one in side]


def volumes(goals: Goals, sides: list[list[Held]]) -> list[Volume] | None:
    """Of several fronts below a common reference. None where nothing is measured."""
    reference = reference_of([own for side in sides for own in measured_vectors(goals, [one for one in side if one.is_measured])])
    if reference is None:
        return None
    found = []
    for seed, side in enumerate(sides):
        designs = drawn(goals, side, seed)
        draws = [
            hypervolume([objective_vector(goals, tuple(means[draw])) for means, admissible in designs if admissible[draw]], reference)
            for draw in range(DRAWS)
        ]
        measured = hypervolume(measured_vectors(goals, [one for one in side if one.is_admissible]), reference)
        found.append(Volume(measured, numpy.array(draws)))
    return found


def best_interval(goals: Goals, side: list[Held]) -> tuple[float, float]:
    """Of the single objective of the best design that keeps all constraints; an infinite end where none of these may keep them."""
    sign, best = goals.objectives[0].sign, numpy.full(DRAWS, math.inf)
    for means, admissible in drawn(goals, side, 0):
        best = numpy.minimum(best, numpy.where(admissible, sign * means[:, 0], math.inf))
    low, high = interval_of(best)
    return (low, high) if sign > 0 else (-high, -low)
