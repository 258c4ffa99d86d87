"""What a search ends with: the front on held-out seeds and trajectories, the chosen design, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

# Not `scipy.stats`, which takes a second to load.
from scipy import special

from .choice import best, weights_of
from .designs import Design, Goals, Summary, front, hypervolume, objective_vector, reference_of, summaries_of, summary
from .loop import State

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Mean:
    """Over runs; an interval of Student's t needs two of them."""

    value: float | None
    interval: tuple[float, float] | None
    count: int
    lost: int


@dataclass(frozen=True)
class Kept:
    """How many runs keep a constraint, with Clopper and Pearson's exact interval of the share."""

    met: int
    runs: int
    interval: tuple[float, float]
    verdict: str
    # What is asked for; none where all runs must keep it.
    share: float | None = None


@dataclass(frozen=True)
class Held:
    """What the held-out runs say of a design."""

    means: tuple[Mean, ...]
    kept: tuple[Kept, ...]

    @property
    def is_measured(self) -> bool:
        """Whether every objective is known."""
        return all(one.value is not None for one in self.means)

    @property
    def is_admissible(self) -> bool:
        """Whether the held-out runs keep every constraint as often as asked."""
        return self.is_measured and all(one.verdict != "missed" for one in self.kept)


@dataclass(frozen=True)
class Judged(Held):
    """A design of this search on the held-out runs."""

    summary: Summary

    @property
    def number(self) -> int:
        """Of the design."""
        return self.summary.design.number

    @property
    def is_shown(self) -> bool:
        """Whether every share that was asked for is shown, and there is one."""
        shares = [one for one in self.kept if one.share is not None]
        return bool(shares) and all(one.verdict == "shown" for one in shares)

    @property
    def sureness(self) -> float:
        """The least margin over all constraints with a share: (lower end of the interval - share) / (1 - share). 1 at most, and where there are none."""
        shares = [one for one in self.kept if one.share is not None]
        return min(((one.interval[0] - one.share) / (1.0 - one.share) for one in shares), default=1.0)


def mean_of(values: list[float], runs: int) -> Mean:
    """With its 95 % interval."""
    if not values:
        return Mean(None, None, 0, runs)
    mean = math.fsum(values) / len(values)
    if len(values) < 2:
        return Mean(mean, None, len(values), runs - len(values))
    sd = math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (len(values) - 1))
    half = float(special.stdtrit(len(values) - 1, 0.5 + CONFIDENCE / 2)) * sd / math.sqrt(len(values))
    return Mean(mean, (mean - half, mean + half), len(values), runs - len(values))


def kept_of(met: int, runs: int, share: float | None) -> Kept:
    """Shown: the interval lies above the share. Kept so far: the observed share reaches it. Missed: it does not."""
    tail = (1.0 - CONFIDENCE) / 2
    low = float(special.betaincinv(met, runs - met + 1, tail)) if met else 0.0
    high = float(special.betaincinv(met + 1, runs - met, 1.0 - tail)) if met < runs else 1.0
    wanted = 1.0 if share is None else share
    verdict = "missed" if met < wanted * runs - 1e-9 else "shown" if share is not None and low >= share else "kept so far"
    return Kept(met, runs, (low, high), verdict, share)


def judged(state: State) -> list[Judged]:
    """All designs of the final evaluation, by the first objective."""
    found = []
    for number, results in state.final.items():
        held = Design(number, state.designs[number].is_, state.designs[number].round, state.designs[number].guess, results=results)
        one = summary(state.goals, held)
        means = []
        for objective in state.goals.objectives:
            values = [state.goals.value(objective.figure, result) for result in results.values()]
            means.append(mean_of([value for value in values if value is not None], len(values)))
        kept = []
        for constraint in state.goals.constraints:
            values = [state.goals.value(constraint.figure, result) for result in results.values()]
            kept.append(kept_of(sum(constraint.is_met(value) for value in values), len(values), constraint.share))
        found.append(Judged(tuple(means), tuple(kept), one))
    return sorted(found, key=lambda one: (*(math.inf if mean is None else mean for mean in one.summary.means), one.number))


def eligible(all_judged: list[Judged]) -> list[Judged]:
    """The designs to choose among: those that are shown to keep every share; where there are none, those that keep all constraints so far."""
    admissible = [one for one in all_judged if one.is_admissible]
    return [one for one in admissible if one.is_shown] or admissible


def chosen(goals: Goals, all_judged: list[Judged]) -> int | None:
    """The eligible design of the least price; with a resolution, of those within it the one that keeps its constraints most surely."""
    among, objective = {one.number: one for one in eligible(all_judged)}, goals.objectives[0]
    means = {number: one.summary.means for number, one in among.items()}
    least = best(goals, means, weights_of(goals))
    if least is None or objective.resolution == 0.0:
        return least
    near = [number for number in means if abs(means[number][0] - means[least][0]) <= objective.resolution]
    return max(near, key=lambda number: (among[number].sureness, -objective.sign * means[number][0]))


def prices_doubled(state: State, all_judged: list[Judged]) -> list[tuple[str, int | None]]:
    """The choice if one percent of an objective weighed twice as much, for each objective."""
    weights, means = weights_of(state.goals), {one.number: one.summary.means for one in eligible(all_judged)}
    doubled = []
    for number, objective in enumerate(state.goals.objectives):
        own = [2.0 * weight if at == number else weight for at, weight in enumerate(weights)]
        doubled.append((objective.figure, best(state.goals, means, own)))
    return doubled


def limits_moved(state: State, share: float) -> list[tuple[str, float, int | None]]:
    """The best design of the search's own cells if a limit were looser (above 0) or tighter by a share of itself."""
    moved = []
    for number, constraint in enumerate(state.goals.constraints):
        if constraint.figure.endswith("tracked_fraction") or constraint.limit == 0.0:
            continue
        own = list(state.goals.constraints)
        own[number] = constraint.moved(share)
        goals = replace(state.goals, constraints=tuple(own))
        means = {one.design.number: one.means for one in summaries_of(goals, state.designs) if one.is_feasible}
        moved.append((constraint.text, own[number].limit, best(goals, means, weights_of(goals))))
    return moved


def progress(state: State) -> list[tuple[int, float]]:
    """After each round: finished cells, and the hypervolume of the designs so far by all that is known of them now; with one objective the
    best mean so far."""
    summaries = state.summaries()
    reference = reference_of([objective_vector(state.goals, one.means) for one in summaries if one.is_feasible])
    if reference is None:
        return []
    cells, line = 0, []
    for turn in range(state.rounds):
        cells = state.cells_after[turn]
        vectors = [objective_vector(state.goals, one.means) for one in summaries if one.is_feasible and one.design.round <= turn]
        if len(reference) > 1:
            line.append((cells, hypervolume(vectors, reference)))
        elif vectors:
            line.append((cells, state.goals.objectives[0].sign * min(vectors)[0]))
    return line


def search_front(state: State) -> list[Summary]:
    """By the search's own cells."""
    return front(state.goals, state.summaries())
