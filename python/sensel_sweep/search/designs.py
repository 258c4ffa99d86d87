"""What the finished cells say of each design: objectives over its runs, and by how much it misses its constraints."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from .batch import Result, Run
from .failure import nearest
from .file import Constraint, Objective, SearchFile
from .scatter import Scatter, at_share, mean_of_all, misses_too_often, scatter_of

# Sections of figures that a lost track makes meaningless, with the share of frames that are tracked.
TRACKED = {"tracking.": "tracking.tracked_fraction", "cameras_alone.": "cameras_alone.tracked_fraction"}
# Of two figures with one last part, the one outside this section is meant.
SECOND = "cameras_alone."
# By how much a run without a figure misses a limit, as a share of the limit.
MISSING_EXCESS = 1.0
# What a limit that is met exactly where it must be undercut counts as.
TOUCHED_EXCESS = 1e-9


def full_name(figure: str, known: list[str]) -> str:
    """The full name of a figure that is called by its last part or by all of it; raises ValueError with the nearest ones."""
    if figure in known:
        return figure
    ends = [name for name in known if name.endswith(f".{figure}")]
    first = [name for name in ends if not name.startswith(SECOND)]
    if len(ends) == 1 or len(first) == 1:
        return (first or ends)[0]
    if ends:
        raise ValueError(f"several figures have this name: {', '.join(sorted(ends))}")
    last_parts = {name.rsplit(".", 1)[-1]: name for name in known}
    raise ValueError(f"no cell has this figure; {nearest(figure, sorted(set(last_parts) | set(known)))}")


@dataclass(frozen=True)
class Goals:
    """Objectives and constraints with full names of figures, and the constraints that say that a track is kept."""

    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    tracked: dict[str, Constraint]

    def is_lost(self, figure: str, result: Result) -> bool:
        """Whether a run's figure is no number: the track was lost."""
        return any(
            figure.startswith(section) and not one.is_met(result.figures.get(one.figure)) for section, one in self.tracked.items()
        )

    def value(self, figure: str, result: Result) -> float | None:
        """A run's figure, if it was measured and the track was kept."""
        value = result.figures.get(figure)
        if result.has_failed or value is None or not math.isfinite(value):
            return None
        is_share = any(figure == one.figure for one in self.tracked.values())
        return None if not is_share and self.is_lost(figure, result) else value


def resolve_goals(search: SearchFile, known: list[str]) -> Goals:
    """Finds the figures among those of a cell. Raises ValueError with the key of the file first."""

    def named(key: str, figure: str) -> str:
        try:
            return full_name(figure, known)
        except ValueError as error:
            raise ValueError(f"{key} = {figure}: {error}") from None

    objectives = tuple(
        replace(one, figure=named(f"objective.{number}.figure", one.figure))
        for number, one in enumerate(search.objectives)
    )
    constraints = [
        replace(one, figure=named(f"constraints.{number}", one.figure))
        for number, one in enumerate(search.constraints)
    ]
    tracked: dict[str, Constraint] = {}
    used = [one.figure for one in (*objectives, *constraints)]
    for section, share in TRACKED.items():
        if not any(figure.startswith(section) for figure in used) or share not in known:
            continue
        own = next((one for one in constraints if one.figure == share), None)
        if own is None:
            own = Constraint(share, ">=", 1.0, None, f"{share} >= 1")
            constraints.append(own)
        tracked[section] = own
    return Goals(objectives, tuple(constraints), tracked)


@dataclass
class Design:
    """A point of the space with its finished runs."""

    number: int
    is_: dict
    round: int
    guess: str | None = None
    refusal: str | None = None
    results: dict[Run, Result] = field(default_factory=dict)

    @property
    def has_run(self) -> bool:
        """Whether anything is known of it."""
        return bool(self.results) or self.refusal is not None


@dataclass(frozen=True)
class Summary:
    """What the runs of a design say."""

    design: Design
    # Means over the runs that have the figure; none where no run has it.
    means: tuple[float | None, ...]
    # By constraint: above 0 where it is missed.
    excess: tuple[float, ...]
    runs: int

    @property
    def is_feasible(self) -> bool:
        """Whether every constraint is kept and every objective is known."""
        return all(one <= 0.0 for one in self.excess) and all(mean is not None for mean in self.means)

    @property
    def total_excess(self) -> float:
        """The sum over the constraints that are missed."""
        return sum(one for one in self.excess if one > 0.0)


def scatters(goals: Goals, designs: list[Design]) -> tuple[Scatter | None, ...]:
    """By constraint; none for those without a share."""

    def rows(figure: str) -> list[list[float | None]]:
        return [[goals.value(figure, result) for result in design.results.values()] for design in designs]

    return tuple(None if one.share is None else scatter_of(one, rows(one.figure)) for one in goals.constraints)


def excess_at(constraint: Constraint, value: float | None) -> float:
    """By how much a value is beyond the limit, as a share of the limit."""
    if value is None:
        return MISSING_EXCESS
    beyond = constraint.sign * (value - constraint.limit) / (abs(constraint.limit) or 1.0)
    return TOUCHED_EXCESS if beyond <= 0.0 and not constraint.is_met(value) else beyond


def excess_of(constraint: Constraint, values: list[float | None], scatter: Scatter | None = None, errors: float = 0.0) -> float:
    """By how much the run at the constraint's share misses the limit: 0 or below where it is kept, on a logarithmic scale. With a scatter it is
    the value that is expected at that share, and the run of these only where more of them miss than chance explains."""
    beyond = sorted(excess_at(constraint, value) for value in values)
    at = len(beyond) - 1 if constraint.share is None else min(math.ceil(constraint.share * len(beyond) - 1e-9), len(beyond)) - 1
    most, known = beyond[at], [value for value in values if value is not None]
    if scatter is not None and known and (not scatter.is_log or min(known) > 0.0):
        expected = excess_at(constraint, at_share(constraint, known, scatter, errors))
        most = max(most, expected) if misses_too_often(constraint, sum(one > 0.0 for one in beyond), len(values)) else expected
    return math.copysign(math.log1p(abs(most)), most)


def summary(goals: Goals, design: Design, scatter: tuple[Scatter | None, ...] = (), errors: float = 0.0) -> Summary:
    """Sums up a design's runs; the scatter is by constraint. Constraints on a share of the runs are judged as if the design were better by so
    many standard errors."""
    if not design.results:
        return Summary(design, (None,) * len(goals.objectives), (MISSING_EXCESS,) * (len(goals.constraints) + 1), 0)
    results = list(design.results.values())
    means = []
    for objective in goals.objectives:
        values = [value for value in (goals.value(objective.figure, one) for one in results) if value is not None]
        means.append(mean_of_all(values) if values else None)
    by_constraint = zip(goals.constraints, scatter or (None,) * len(goals.constraints))
    excess = [excess_of(one, [goals.value(one.figure, result) for result in results], of, errors) for one, of in by_constraint]
    failed = sum(result.has_failed for result in results)
    # A cell that failed counts where nothing else does.
    excess.append(MISSING_EXCESS * failed / len(results))
    return Summary(design, tuple(means), tuple(excess), len(results))


def summaries_of(goals: Goals, designs: list[Design], errors: float = 0.0) -> list[Summary]:
    """Of all designs of which anything is known; see `summary`."""
    scatter = scatters(goals, designs)
    return [summary(goals, design, scatter, errors) for design in designs if design.has_run]


def dominates(first: list[float], second: list[float]) -> bool:
    """Whether the first objective vector, small being good, is nowhere worse and somewhere better."""
    return all(a <= b for a, b in zip(first, second)) and any(a < b for a, b in zip(first, second))


def objective_vector(goals: Goals, means: tuple[float | None, ...]) -> list[float]:
    """Means with small being good."""
    return [one.sign * mean for one, mean in zip(goals.objectives, means)]


def front(goals: Goals, summaries: list[Summary]) -> list[Summary]:
    """The feasible designs that none dominates, by the first objective."""
    feasible = [one for one in summaries if one.is_feasible]
    vectors = [objective_vector(goals, one.means) for one in feasible]
    kept = [one for one, own in zip(feasible, vectors) if not any(dominates(other, own) for other in vectors)]
    return sorted(kept, key=lambda one: (objective_vector(goals, one.means), one.design.number))


def layers(goals: Goals, summaries: list[Summary]) -> Iterator[Summary]:
    """All feasible designs: the front, then the front without it, and so on."""
    left = [one for one in summaries if one.is_feasible]
    while left:
        first = front(goals, left)
        yield from first
        left = [one for one in left if one not in first]


def best_first(goals: Goals, summaries: list[Summary]) -> list[Summary]:
    """Feasible designs by layers of fronts, then the others by how far they miss."""
    others = [one for one in summaries if not one.is_feasible]
    return [*layers(goals, summaries), *sorted(others, key=lambda one: (one.total_excess, one.design.number))]


def hypervolume(vectors: list[list[float]], reference: list[float]) -> float:
    """Volume between objective vectors and a reference, small being good: slices along the last objective."""
    inside = sorted({tuple(one) for one in vectors if all(a < b for a, b in zip(one, reference))}, key=lambda one: one[-1])
    if not inside:
        return 0.0
    if len(reference) == 1:
        return reference[0] - inside[0][0]
    volume = 0.0
    for number, one in enumerate(inside):
        upper = inside[number + 1][-1] if number + 1 < len(inside) else reference[-1]
        if upper > one[-1]:
            volume += (upper - one[-1]) * hypervolume([list(low[:-1]) for low in inside[: number + 1]], reference[:-1])
    return volume


def reference_of(vectors: list[list[float]]) -> list[float] | None:
    """Where a hypervolume ends: the worst of the vectors, a tenth of the span further out. None without vectors."""
    columns = list(zip(*vectors))
    return [max(column) + 0.1 * ((max(column) - min(column)) or abs(max(column)) or 1.0) for column in columns] or None
