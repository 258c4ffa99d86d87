"""A whole search: its rounds, and the evaluation of its finalists on seeds and trajectories that it never saw."""

from __future__ import annotations

import hashlib
import json
import math

from ..cluster import Engine
from .choice import by_price, evenly, finalists
from .designs import Design, Goals, summaries_of
from .loop import Paused, Plan, State, check_identity, play, run_round, runs_of
from .outcome import Judged, judged

# Further rounds of the final evaluation at most, where the first one shows no design to keep every share.
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
    """Runs the finalists, and others where none of them is shown to keep every share; false where runs are missing that are only to be read."""
    count = state.search.final.designs
    numbers = finalists(state.search, state.goals, state.designs, count)
    for turn in range(1 + FURTHER_ROUNDS):
        if not evaluate(state, engine, numbers):
            return False
        all_judged = judged(state)
        if turn == 0 and any(one.is_shown for one in all_judged if one.is_admissible):
            break
        numbers = further(state.goals, state.designs, all_judged, max(count // 2, 1))
        if not numbers:
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
    """Designs to evaluate next, none of which is known to miss anything: while none is shown to keep every share, worse ones than all that were
    evaluated, guesses left aside; then those between the best one that is shown and the next better one, until the resolution parts the two.
    None with several objectives, and where no constraint has a share."""
    if len(goals.objectives) > 1 or all(one.share is None for one in goals.constraints):
        return []
    sign, resolution = goals.objectives[0].sign, goals.objectives[0].resolution

    def price(means: tuple) -> float:
        return sign * means[0]

    shown = [price(one.summary.means) for one in all_judged if one.is_shown and one.is_admissible]
    most = min(shown, default=math.inf)
    others = [price(one.summary.means) for one in all_judged if one.is_measured and one.summary.design.guess is None]
    least = max((one for one in others if one < most), default=-math.inf)
    if most - least <= resolution:
        return []
    done = {one.number for one in all_judged}
    kept = [one for one in summaries_of(goals, designs) if one.is_feasible and one.design.number not in done]
    return evenly(by_price(goals, [one for one in kept if least < price(one.means) < most]), count)
