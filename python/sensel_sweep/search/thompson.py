"""Proposes designs by Thompson sampling (Thompson 1933): Gaussian processes stand for every objective and constraint, and each proposal is
the best of many candidates in one draw of all of them. Designs that noise has misjudged are told by their neighbours."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterator

import numpy
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from threadpoolctl import threadpool_limits

from .designs import Goals, Summary, best_first
from .file import SearchFile
from .space import coordinates, drawn, generator_of, redrawn, scattered

# Candidates that are drawn evenly over the space, as many again near the best designs, and as many that agree with one of these in all but a
# few factors. Without the last, few candidates join the choices of the best designs with ranges far from theirs.
CANDIDATES = 600
BEST_DESIGNS = 10
# Designs that length scales and noise are fitted to; the processes themselves hold all.
FITTED_MOST = 140
LENGTH_SCALES = (0.3, 5.0)
# By how much a constraint counts as kept or missed at most: what lies far from a limit says little of its edge.
EXCESS_LEAST, EXCESS_MOST = -1.0, 1.5
# A limit that is kept exactly, as counts and shares are, does not say by how much.
EXCESS_EXACT = -0.5
# By which share of themselves limits on a share of the runs are tightened at most: designs that keep them with a margin are to be known, since
# those at the limit may miss it in other runs.
TIGHTER_MOST = 0.4
# Share of the sum in Knowles' augmented Chebyshev norm (2006), by which a draw weighs objectives against each other.
SUM_SHARE = 0.05
# Of a process's mean variance, added to the diagonal: candidates may lie close together.
JITTER = 1e-6


def fitted(points: numpy.ndarray, values: numpy.ndarray, generator: numpy.random.Generator) -> GaussianProcessRegressor:
    """A process with a Matern kernel of one length scale for each axis, by maximum likelihood. Its logarithms of length scales and noise are
    rounded, so that the last bits of a linear algebra do not reach the proposals."""
    kernel = ConstantKernel(1.0, (1e-2, 1e3)) * Matern(numpy.full(points.shape[1], 0.7), LENGTH_SCALES, nu=2.5)
    kernel += WhiteKernel(1e-2, (1e-8, 1.0))
    some = slice(None)
    if len(values) > FITTED_MOST:
        some = numpy.sort(generator.choice(len(values), FITTED_MOST, replace=False))
    with warnings.catch_warnings():
        # Length scales at their bounds are meant: an axis that does not matter has the longest.
        warnings.simplefilter("ignore", ConvergenceWarning)
        kernel = GaussianProcessRegressor(kernel, normalize_y=True).fit(points[some], values[some]).kernel_
    kernel = kernel.clone_with_theta(numpy.round(kernel.theta, 2))
    return GaussianProcessRegressor(kernel, optimizer=None, normalize_y=True).fit(points, values)


def draws(
    known: numpy.ndarray, values: numpy.ndarray, points: numpy.ndarray, count: int, generator: numpy.random.Generator
) -> numpy.ndarray:
    """What a process through the known values may be at the points without the noise of runs: points by draws."""
    process = fitted(known, values, generator)
    mean, covariance = process.predict(points, return_cov=True)
    own = numpy.arange(len(points))
    # Kernels are of values of unit variance.
    scale = float(values.std()) ** 2
    covariance[own, own] += (JITTER - process.kernel_.k2.noise_level) * scale + JITTER * numpy.mean(numpy.diag(covariance))
    root = numpy.linalg.cholesky(covariance)
    return mean[:, None] + root @ generator.standard_normal((len(points), count))


def objectives_of(goals: Goals, summaries: list[Summary]) -> list[tuple[list[int], list[float]]]:
    """By objective, which designs have it and what it is, small being good: the logarithm of a figure above zero."""
    found = []
    for number, objective in enumerate(goals.objectives):
        known = [at for at, one in enumerate(summaries) if one.means[number] is not None]
        values = [summaries[at].means[number] for at in known]
        is_log = all(value > 0.0 for value in values)
        found.append((known, [objective.sign * (math.log(value) if is_log else value) for value in values]))
    return found


def constraints_of(goals: Goals, summaries: list[Summary]) -> list[tuple[numpy.ndarray, float]]:
    """Excess of every constraint in which designs differ and that some design misses, and by how much its limit may be tightened: a limit that a
    share of the runs must keep up to what the best design keeps, others not."""
    found = []
    # The last excess is that of cells that failed.
    shared = [one.share is not None and one.limit != 0.0 for one in goals.constraints]
    for row, is_shared in zip(zip(*(one.excess for one in summaries)), [*shared, False]):
        values = numpy.array(row)
        values = numpy.clip(numpy.where(values == 0.0, EXCESS_EXACT, values), EXCESS_LEAST, EXCESS_MOST)
        most = min(math.log1p(TIGHTER_MOST), max(-float(values.min()), 0.0)) if is_shared else 0.0
        if values.max() > max(float(values.min()), -most):
            found.append((values, most))
    return found


def chebyshev(values: numpy.ndarray, is_kept: numpy.ndarray, weights: numpy.ndarray) -> numpy.ndarray:
    """One number for several objectives (objectives by points), small being good, over the span of the points that keep all constraints."""
    among = values[:, is_kept] if is_kept.any() else values
    low, high = among.min(axis=1), among.max(axis=1)
    weighted = weights[:, None] * (values - low[:, None]) / numpy.where(high > low, high - low, 1.0)[:, None]
    return weighted.max(axis=0) + SUM_SHARE * weighted.sum(axis=0)


def candidates(search: SearchFile, goals: Goals, summaries: list[Summary], generator: numpy.random.Generator) -> list[dict]:
    """Unknown designs, each once, over the space and from the best ones."""
    around = [one.design.is_ for one in best_first(goals, summaries)[:BEST_DESIGNS]]
    pool = list(itertools.islice(drawn(search, generator), CANDIDATES))
    for beside in (scattered, redrawn):
        pool += [beside(search, is_, generator) for is_ in around for _ in range(CANDIDATES // len(around))]
    # Few factors that are drawn anew give some designs often: each stays once, so that it is proposed once.
    once = {repr([is_[factor.name] for factor in search.factors]): is_ for is_ in pool}
    known = [one.design.is_ for one in summaries]
    return [is_ for is_ in once.values() if is_ not in known]


def sampled(search: SearchFile, goals: Goals, summaries: list[Summary], turn: int) -> Iterator[dict]:
    """A round's proposals, each once."""
    generator = generator_of(search, turn, 3)
    pool = candidates(search, goals, summaries, generator)
    objectives = [one for one in objectives_of(goals, summaries) if len(one[0]) > 1]
    if not pool or not objectives:
        return
    points = numpy.array([coordinates(search, is_) for is_ in pool])
    known = numpy.array([coordinates(search, one.design.is_) for one in summaries])
    # One thread, so that sums have one order on any number of cores.
    with threadpool_limits(1):
        drawn_objectives = numpy.array([
            draws(known[have], numpy.array(values), points, search.batch, generator) for have, values in objectives
        ])
        excess = numpy.zeros((len(pool), search.batch))
        constraints = constraints_of(goals, summaries)
        tightening = generator.random(search.batch) if any(most > 0.0 for _, most in constraints) else numpy.zeros(search.batch)
        for row, most in constraints:
            excess += numpy.maximum(draws(known, row, points, search.batch, generator) + most * tightening, 0.0)
    taken: set[int] = set()
    for at in range(min(search.batch, len(pool))):
        weights = generator.dirichlet(numpy.ones(len(objectives)))
        price = chebyshev(drawn_objectives[:, :, at], excess[:, at] <= 0.0, weights)
        best = next(int(index) for index in numpy.lexsort((price, excess[:, at])) if index not in taken)
        taken.add(best)
        yield pool[best]


def between(
    search: SearchFile, goals: Goals, summaries: list[Summary], turn: int, limits: tuple[float, float], count: int
) -> list[dict]:
    """Unknown designs whose single objective, small being good, is expected between two values: of each of so many equal parts the design that is
    expected to keep its limits by most, if it keeps them."""
    generator = generator_of(search, turn, 4)
    pool = candidates(search, goals, summaries, generator)
    known = numpy.array([coordinates(search, one.design.is_) for one in summaries])
    (have, values), *_ = objectives_of(goals, summaries)
    if not pool or len(have) < 2:
        return []
    points = numpy.array([coordinates(search, is_) for is_ in pool])
    with threadpool_limits(1):
        expected = fitted(known[have], numpy.array(values), generator).predict(points)
        excess = [fitted(known, row, generator).predict(points) for row, _ in constraints_of(goals, summaries)]
    sign = goals.objectives[0].sign
    if all(summaries[at].means[0] > 0.0 for at in have):
        # A logarithm, with its sign; see `objectives_of`.
        expected = sign * numpy.exp(sign * expected)
    worst = numpy.max(excess, axis=0) if excess else numpy.zeros(len(pool))
    ends = numpy.linspace(*limits, count + 1)
    found = []
    for low, high in itertools.pairwise(ends):
        inside = numpy.flatnonzero((expected > low) & (expected < high) & (worst <= 0.0))
        if len(inside):
            found.append(pool[int(inside[numpy.argmin(worst[inside])])])
    return found
