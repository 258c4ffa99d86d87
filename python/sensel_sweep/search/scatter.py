"""What few runs of a design say of many: the value at a share of further runs, by the scatter of all designs."""

from __future__ import annotations

import math
from dataclasses import dataclass

# Not `scipy.stats`, which takes a second to load.
from scipy import special

from .file import Constraint

# Designs that are pooled at least, if there are as many.
DESIGNS_POOLED = 10
# Degrees of freedom that the pooled variance counts as beside a design's own. Scatters of designs in the hall differ less than eight runs
# tell one (docs/search.md).
FREEDOM = 32.0
# Runs beyond a share that tell where it lies.
RUNS_BEYOND = 3
# A design misses a share where so few or fewer of designs that just keep it would miss as many runs.
SIGNIFICANCE = 0.05


@dataclass(frozen=True)
class Scatter:
    """Of a figure between runs of one design, pooled over designs."""

    variance: float
    # How much further out than by a normal distribution the value at the constraint's share lies.
    tail: float
    # Whether it is that of the logarithm.
    is_log: bool


def mean_of_all(values: list[float]) -> float:
    """Of one value or more."""
    return math.fsum(values) / len(values)


def squares_about_mean(values: list[float]) -> float:
    """Sum of the squared differences to the mean."""
    mean = mean_of_all(values)
    return math.fsum((value - mean) ** 2 for value in values)


def tail_of(constraint: Constraint, rows: list[list[float]], variance: float) -> float:
    """How much further from their design's mean the runs at the constraint's share are than by a normal distribution: 1 at least, and where
    too few runs are beyond the share to tell, or more than half of them."""
    normal, out = float(special.ndtri(constraint.share)), (1.0 - constraint.share) * sum(map(len, rows))
    if normal <= 0.0 or out < RUNS_BEYOND:
        return 1.0
    sign = constraint.sign
    beyond = sorted(
        sign * (value - mean_of_all(row)) * math.sqrt(len(row) / (len(row) - 1) / variance) for row in rows for value in row
    )
    return max(1.0, beyond[len(beyond) - math.ceil(out)] / normal)


def scatter_of(constraint: Constraint, rows: list[list[float | None]]) -> Scatter | None:
    """From a figure's values by design: of the better half of the designs of two runs or more whose mean keeps the limit. The others scatter
    more, by far where a run nearly loses its track. None without such designs."""
    known = [row for row in ([value for value in row if value is not None] for row in rows) if len(row) > 1]
    is_log = constraint.limit > 0.0 and all(value > 0.0 for row in known for value in row)
    known = [[math.log(value) if is_log else value for value in row] for row in known]
    limit = math.log(constraint.limit) if is_log else constraint.limit
    sign = constraint.sign
    known = sorted((row for row in known if sign * mean_of_all(row) <= sign * limit), key=lambda row: sign * mean_of_all(row))
    known = known[: max(DESIGNS_POOLED, math.ceil(0.5 * len(known)))]
    freedom = sum(len(row) - 1 for row in known)
    if not freedom:
        return None
    variance = math.fsum(map(squares_about_mean, known)) / freedom
    tail = tail_of(constraint, known, variance) if variance > 0.0 else 1.0
    return Scatter(variance, tail, is_log)


def at_share(constraint: Constraint, values: list[float], scatter: Scatter, errors: float = 0.0) -> float:
    """The value at a constraint's share of further runs, from few: the prediction limit of a normal distribution, by Student's t, stretched by
    the tail. A design's own scatter takes the place of that of all designs as its runs grow in number. The mean is better than it was measured
    by so many standard errors."""
    values = [math.log(value) if scatter.is_log else value for value in values]
    mean, runs = mean_of_all(values), len(values)
    freedom = FREEDOM + runs - 1
    variance = (FREEDOM * scatter.variance + squares_about_mean(values)) / freedom
    quantile = scatter.tail * float(special.stdtrit(freedom, constraint.share))
    margin = quantile * math.sqrt(variance * (1.0 + 1.0 / runs)) - errors * math.sqrt(variance / runs)
    value = mean + constraint.sign * margin
    return math.exp(value) if scatter.is_log else value


def misses_too_often(constraint: Constraint, missed: int, runs: int) -> bool:
    """Whether so many missed runs would be improbable for a design that just keeps the constraint's share (binomial test)."""
    return missed > 0 and float(special.bdtrc(missed - 1, runs, 1.0 - constraint.share)) < SIGNIFICANCE
