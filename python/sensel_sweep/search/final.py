"""A whole search: its rounds, and the evaluation of its finalists on seeds and trajectories that it never saw."""

from __future__ import annotations

import hashlib
import json
import math

from ..cluster import Engine
from .choice import about_to_keep, by_price, distinct, evenly, finalists, outcome
from .designs import Design, Goals, Summary, summaries_of
from .loop import Paused, Plan, State, check_identity, play, run_round, runs_of
from .outcome import Judged, judged
from .propose import designs_for_processes

# Further rounds of the final evaluation at most.
FURTHER_ROUNDS = 5


def search_all(state: State, engine: Engine) -> None:
    """All rounds, then the final evaluation. Rounds that have run are read, not run."""
    check_identity(state)
    try:
        while play(state, engine):
            pass
        state.is_finished = evaluate_finalists(state, engine)
    except Paused:
        if not state.reads_only or state.goals is None:
            raise


def evaluate_finalists(state: State, engine: Engine) -> bool:
    """Runs the finalists, then others until one is shown to keep every share and no better one is far from it; false where the finalists' runs are
    missing and are only to be read. A guess that is shown counts as shown."""
    count = state.search.final.designs
    if not evaluate(state, engine, finalists(state.search, state.goals, state.designs, count), []):
        return False
    for turn in range(FURTHER_ROUNDS):
        most = max(count // 2, 1)
        numbers, new = further(state.goals, state.designs, judged(state), most), []
        if not numbers:
            new = proposed(state, turn, most)
            numbers = [one.number for one in new] or nearly_kept(state.goals, state.designs, judged(state), most)
        # A report is of what is there.
        if not numbers or not evaluate(state, engine, numbers, new):
            break
    return bool(state.final)


def evaluate(state: State, engine: Engine, numbers: list[int], new: list[Design]) -> bool:
    """Runs these designs on the held-out seeds and trajectories; the new ones among them are no designs of a round."""
    final = state.search.final
    runs = [run for number in numbers for run in runs_of(final.trajectories, number, list(final.seeds))]
    if not runs:
        return True
    designs = {str(one.number): one.is_ for one in [*state.designs, *new] if one.number in numbers}
    named = json.dumps([designs, [run.label for run in runs], final.trajectories], sort_keys=True)
    plan_path = state.out / "rounds" / f"final-{hashlib.sha256(named.encode()).hexdigest()[:8]}.json"
    if state.reads_only and not plan_path.exists():
        return False
    plan = Plan.read(plan_path, state) if plan_path.exists() else Plan(new, runs)
    results = run_round(state, engine, plan_path, plan, final.trajectories, f"Final evaluation of {state.search.path.name}")
    for run, result in results.items():
        state.final.setdefault(run.design, {})[run] = result
    return True


def open_ranges(goals: Goals, prices: dict[int, float], all_judged: list[Judged]) -> list[tuple[float, float]]:
    """Where better designs are wanted than the best one that is shown to keep every share, small prices being good: up to that one from the next
    better one beyond the resolution, or from the best that the search or a guess has, unless one within it misses something; while none is shown, from each
    that was evaluated up. An evaluated guess is no such better one. None with several objectives, and where no constraint has a share."""
    if len(goals.objectives) > 1 or all(one.share is None for one in goals.constraints):
        return []
    most = min((prices[one.number] for one in all_judged if one.is_shown and one.is_admissible), default=math.inf)
    searched = [one for one in all_judged if one.summary.design.guess is None and one.number in prices]
    better = [(prices[one.number], one.is_admissible) for one in searched if prices[one.number] < most]
    if most == math.inf:
        return [(price, most) for price, _ in sorted(better, reverse=True)]
    least = most - goals.objectives[0].resolution
    if any(price >= least and not is_admissible for price, is_admissible in better):
        return []
    low = max((price for price, _ in better if price < least), default=min(prices.values()))
    return [(low, most)] if low < most else []


def prices_of(goals: Goals, summaries: list[Summary], all_judged: list[Judged]) -> dict[int, float]:
    """The first objective by design, small being good: by the search's own runs, which nearly all of them have, else by the held-out ones."""
    sign = goals.objectives[0].sign
    held = {one.number: sign * one.means[0].value for one in all_judged if one.is_measured}
    return held | {one.design.number: sign * one.means[0] for one in summaries if one.means[0] is not None}


def further(goals: Goals, designs: list[Design], all_judged: list[Judged], count: int) -> list[int]:
    """Known designs to evaluate next, none of which is known to miss anything: the first of the open ranges that has any, see `open_ranges`."""
    summaries = summaries_of(goals, designs)
    prices = prices_of(goals, summaries, all_judged)
    known = {outcome(goals, designs[one.number]) for one in all_judged}
    kept = [one for one in distinct(goals, summaries) if one.is_feasible and outcome(goals, one.design) not in known]
    for low, high in open_ranges(goals, prices, all_judged):
        found = [one for one in kept if low < prices[one.design.number] < high]
        if found:
            return evenly(by_price(goals, found), count)
    return []


def nearly_kept(goals: Goals, designs: list[Design], all_judged: list[Judged], count: int) -> list[int]:
    """Known designs of the open ranges that miss a share by little (see `about_to_keep`), the one that misses by least first, then better ones.
    None while nothing is shown."""
    summaries = summaries_of(goals, designs)
    prices = prices_of(goals, summaries, all_judged)
    known = {outcome(goals, designs[one.number]) for one in all_judged}
    near = [one for one in about_to_keep(goals, designs, distinct(goals, summaries), []) if outcome(goals, one.design) not in known]
    for low, high in open_ranges(goals, prices, all_judged):
        if high < math.inf:
            found = [one for one in near if low < prices[one.design.number] < high]
            return [one.design.number for one in by_price(goals, found)[::-1][:count]]
    return []


def proposed(state: State, turn: int, count: int) -> list[Design]:
    """New designs between the best one that is shown and the next better one, where the search knows none: what Gaussian processes expect to keep
    the limits by most. None while nothing is shown, and for other samplers."""
    search, goals, summaries, all_judged = state.search, state.goals, state.summaries(), judged(state)
    ranges = [one for one in open_ranges(goals, prices_of(goals, summaries, all_judged), all_judged) if one[1] < math.inf]
    if not ranges or search.sampler != "auto" or len(summaries) < designs_for_processes(search):
        return []
    # Takes a second to load.
    from .thompson import between

    known = [one.is_ for one in state.designs]
    found = [is_ for is_ in between(search, goals, summaries, state.rounds + turn, ranges[0], count) if is_ not in known]
    return [Design(len(known) + at, is_, state.rounds) for at, is_ in enumerate(found)]
