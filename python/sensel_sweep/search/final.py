"""A whole search: its rounds, and the evaluation of its finalists on seeds and trajectories that it never saw."""

from __future__ import annotations

import hashlib
import json
import math

from ..cluster import Engine
from .choice import by_price, distinct, evenly, finalists, outcome
from .designs import Design, Goals, summaries_of
from .loop import Paused, Plan, State, check_identity, play, run_round, runs_of
from .outcome import Judged, judged

# Further rounds of the final evaluation at most.
FURTHER_ROUNDS = 3


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
    if not evaluate(state, engine, finalists(state.search, state.goals, state.designs, count)):
        return False
    for _ in range(FURTHER_ROUNDS):
        numbers = further(state.goals, state.designs, judged(state), max(count // 2, 1))
        # A report is of what is there.
        if not numbers or not evaluate(state, engine, numbers):
            break
    return bool(state.final)


def evaluate(state: State, engine: Engine, numbers: list[int]) -> bool:
    """Runs these designs on the held-out seeds and trajectories."""
    final = state.search.final
    runs = [run for number in numbers for run in runs_of(final.trajectories, number, list(final.seeds))]
    if not runs:
        return True
    designs = {str(number): state.designs[number].is_ for number in numbers}
    named = json.dumps([designs, [run.label for run in runs], final.trajectories], sort_keys=True)
    plan_path = state.out / "rounds" / f"final-{hashlib.sha256(named.encode()).hexdigest()[:8]}.json"
    if state.reads_only and not plan_path.exists():
        return False
    plan = Plan.read(plan_path, state) if plan_path.exists() else Plan([], runs)
    results = run_round(state, engine, plan_path, plan, final.trajectories, f"Final evaluation of {state.search.path.name}")
    for run, result in results.items():
        state.final.setdefault(run.design, {})[run] = result
    return True


def further(goals: Goals, designs: list[Design], all_judged: list[Judged], count: int) -> list[int]:
    """Designs to evaluate next, none of which is known to miss anything: while none is shown to keep every share, worse ones than those that were
    evaluated, guesses left aside; then those between the best one that is shown and the next better one, until the resolution parts the two.
    None with several objectives, and where no constraint has a share. Designs are compared by the search's own runs, which all of them have."""
    if len(goals.objectives) > 1 or all(one.share is None for one in goals.constraints):
        return []
    objective, evaluated = goals.objectives[0], {one.number: one for one in all_judged}
    summaries = summaries_of(goals, designs)
    price = {one.design.number: objective.sign * one.means[0] for one in summaries if one.means[0] is not None}
    shown = [price[number] for number, one in evaluated.items() if one.is_shown and one.is_admissible]
    most = min(shown, default=math.inf)
    open_ones = [number for number, one in evaluated.items() if number in price and price[number] < most]
    bounds = sorted((price[number] for number in open_ones if evaluated[number].summary.design.guess is None), reverse=True)
    if shown:
        # Only the next better one bounds it.
        bounds = [bound for bound in bounds[:1] if most - bound > objective.resolution]
    known = {outcome(goals, designs[number]) for number in evaluated}
    kept = [one for one in distinct(goals, summaries) if one.is_feasible and outcome(goals, one.design) not in known]
    for bound in bounds:
        found = [one for one in kept if bound < price[one.design.number] < most]
        if found:
            return evenly(by_price(goals, found), count)
    return []
