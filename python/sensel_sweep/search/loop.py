"""The rounds of a search."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass, field
from pathlib import Path


from ..cluster import Engine
from .batch import Result, Run, gathered, read_table, reason_of_failure, refusal, run_batch, sweep_text, write_whole
from .choice import STANDARD_ERRORS
from .designs import Design, Goals, Summary, resolve_goals, summaries_of
from .failure import Failure, damaged
from .file import SearchFile
from .propose import proposals, versions
from . import rungs
from .racing import near_front, seeds_wanted, to_confirm
from .space import start

# Figures that only a finished cell names, because they depend on the run.
OF_A_RUN = ("cameras_alone.", "energy.blocks.", "energy.rails.", "timing.extractor.")
# Share of a round's new cells that designs near the front may take for more seeds.
RACE_SHARE = 0.25
# Share of all cells, the last ones, that go to more seeds of the best designs before any new design: few runs keep a limit by luck.
CONFIRM_SHARE = 0.2


@dataclass
class State:
    """All designs of a search with what is known of them."""

    search: SearchFile
    out: Path
    designs: list[Design] = field(default_factory=list)
    goals: Goals | None = None
    cells: int = 0
    rounds: int = 0
    # Finished cells after each round.
    cells_after: list[int] = field(default_factory=list)
    final: dict[int, dict[Run, Result]] = field(default_factory=dict)
    # Whether finished cells are read and nothing is written or run.
    reads_only: bool = False
    is_finished: bool = False
    # By rung, how its figures agree with those of full cells.
    agreements: dict[int, list[rungs.Agreement]] = field(default_factory=dict)
    # Proposals that a rung left out.
    left_out: list[dict] = field(default_factory=list)

    def summaries(self) -> list[Summary]:
        """Of all designs of which anything is known."""
        return summaries_of(self.goals, self.designs)

    @property
    def sweep(self) -> Path:
        """The folder of the cells."""
        return self.out / "sweep"


class Paused(Exception):
    """A batch is written and somebody else runs it."""


def assigned(search: SearchFile, trajectories: tuple, design: Design, run: Run) -> dict:
    """Keys of a cell."""
    keys: dict = {}
    for factor in search.factors:
        keys.update(factor.assigned(design.is_[factor.name]))
    keys.update(dict(trajectories)[run.trajectory])
    return {**keys, "seed": run.seed}


def runs_of(trajectories: tuple, number: int, seeds: list[int]) -> list[Run]:
    """Every trajectory with every seed."""
    return [Run(number, name, seed) for name, _ in trajectories for seed in seeds]


def check_identity(state: State) -> None:
    """A folder belongs to one search: rounds of another file would be read as this one's."""
    path = state.out / "search.json"
    if path.exists():
        try:
            found = json.loads(path.read_text(encoding="utf-8"))["search"]
        except (ValueError, KeyError, TypeError, RecursionError):
            whole = json.dumps({"search": state.search.identity})
            advice = f"if {state.search.path} is as it was when this folder was searched, write {whole} into it"
            raise damaged(path, f"{advice}; else name another folder with --out") from None
        if found == state.search.identity:
            return
        if (state.out / "rounds").exists():
            raise Failure(f"{state.search.path}: has changed since {state.out} was searched; name another folder with --out")
        # Its first round was refused, and now the file is another one.
    elif state.out.exists() and any(state.out.iterdir()) and not state.reads_only:
        raise Failure(f"{state.out}: holds files and no search; name an empty folder with --out")
    if state.reads_only:
        reason = f"holds no search; run 'sensel-sweep search {state.search.path.name}' first, or name its folder with --out"
        raise Failure(f"{state.out}: {reason}")
    write_whole(path, json.dumps({"search": state.search.identity, "versions": versions()}) + "\n")


@dataclass
class Plan:
    """What a round runs."""

    designs: list[Design]
    runs: list[Run]
    refused: dict[int, str] = field(default_factory=dict)
    # Proposals that a rung left out, and what the cells of rungs count as in full cells.
    left_out: list[dict] = field(default_factory=list)
    rung_cells: int = 0

    def text(self) -> str:
        """As JSON."""
        designs = [{"number": one.number, "is": one.is_, "guess": one.guess} for one in self.designs]
        runs = [[one.design, one.trajectory, one.seed] for one in self.runs]
        of_rungs = {"left_out": self.left_out, "rung_cells": self.rung_cells} if self.rung_cells else {}
        return json.dumps({"designs": designs, "runs": runs, "refused": self.refused, **of_rungs}, indent=1) + "\n"

    @staticmethod
    def read(plan_path: Path, state: State) -> Plan:
        """What `text` wrote; a file of anything else is refused."""
        advice = "delete it, and the search writes it again from its finished cells"
        try:
            found = json.loads(plan_path.read_text(encoding="utf-8"))
            designs = [Design(one["number"], one["is"], state.rounds, one["guess"]) for one in found["designs"]]
            refused = {int(number): why for number, why in found["refused"].items()}
            runs = [Run(*one) for one in found["runs"]]
            plan = Plan(designs, runs, refused, found.get("left_out", []), found.get("rung_cells", 0))
            is_whole = plan.continues(state)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            is_whole = False
        if not is_whole:
            raise damaged(plan_path, advice)
        if any(one.is_ == other.is_ for at, one in enumerate(designs) for other in designs[:at]):
            raise Failure(f"{plan_path}: holds a design twice, as an older sensel-sweep wrote it; {advice}")
        return plan

    def continues(self, state: State) -> bool:
        """Whether its designs are points of the space, numbered on from those before it, and its runs are of known designs."""
        known = len(state.designs)
        trajectories = {name for name, _ in (*state.search.trajectories, *state.search.final.trajectories)}
        return (
            [one.number for one in self.designs] == list(range(known, known + len(self.designs)))
            and all(state.search.holds(one.is_) for one in self.designs)
            and all(one.design in range(known + len(self.designs)) and one.trajectory in trajectories for one in self.runs)
            and all(number in range(known + len(self.designs)) for number in self.refused)
        )


def next_plan(state: State, engine: Engine) -> Plan:
    """What the finished cells and the search's seed propose; with rungs, what passes them."""
    search, turn = state.search, state.rounds
    left = search.cells - state.cells
    extra: dict[int, list[int]] = {}
    left_out: list[dict] = []
    rung_cells = 0
    if turn == 0:
        points = start(search)
    else:
        summaries = state.summaries()
        of_round = search.batch * search.replicates
        if search.sampler != "random":
            confirms = state.cells + of_round > (1.0 - CONFIRM_SHARE) * search.cells
            hopeful = summaries_of(state.goals, state.designs, STANDARD_ERRORS)
            ranked = to_confirm(search, state.goals, state.designs, hopeful) if confirms else near_front(state.goals, hopeful)
            extra = seeds_wanted(search, ranked, min(left, of_round if confirms else int(RACE_SHARE * of_round)))
            left = 0 if confirms and extra else left
        left -= sum(len(seeds) for seeds in extra.values()) * len(search.trajectories)
        climbed = [search.rungs[number] for number in rungs.used(state)]
        count = min(search.batch, int(left // rungs.cells_of_design(search, climbed)))
        points = []
        if count > 0:
            summaries += [rungs.estimate(one, turn) for one in state.left_out]
            points = [(is_, None) for is_ in proposals(search, state.goals, summaries, turn, rungs.widened(count, climbed))]
        if climbed and points:
            proposed = [Design(at, is_, turn) for at, (is_, _) in enumerate(points)]
            passed, others, rung_cells = rungs.sieved(state, engine, proposed, turn, count)
            points, left_out = [(one.is_, None) for one in passed], others
        if count > 0 and not points and not extra and search.sampler != "random":
            # A space of few designs has no more: what is left goes to the designs that would be evaluated anew.
            hopeful = summaries_of(state.goals, state.designs, STANDARD_ERRORS)
            extra = seeds_wanted(search, to_confirm(search, state.goals, state.designs, hopeful), min(left, of_round))
    new = [Design(len(state.designs) + index, is_, turn, guess) for index, (is_, guess) in enumerate(points)]
    runs = [run for design in new for run in runs_of(search.trajectories, design.number, list(range(1, search.seeds + 1)))]
    runs += [run for number, seeds in extra.items() for run in runs_of(search.trajectories, number, seeds)]
    return Plan(new, runs, left_out=left_out, rung_cells=rung_cells)


def play(state: State, engine: Engine) -> bool:
    """One round; false where there is nothing more to do."""
    search, turn = state.search, state.rounds
    if state.cells >= search.cells:
        return False
    plan_path = state.out / "rounds" / f"{turn:03d}.json"
    if state.reads_only and not plan_path.exists():
        return False
    plan = Plan.read(plan_path, state) if plan_path.exists() else next_plan(state, engine)
    if not plan.runs:
        return False
    results = run_round(state, engine, plan_path, plan, search.trajectories, f"Round {turn} of {search.path.name}")
    for run, result in results.items():
        state.designs[run.design].results[run] = result
    state.cells += len(plan.runs) + plan.rung_cells
    state.left_out += plan.left_out
    state.rounds += 1
    after_round(state)
    if turn == 0 and search.rungs:
        state.cells += rungs.measure(state, engine, plan.designs)
    state.cells_after.append(state.cells)
    return True


def run_round(state: State, engine: Engine, plan_path: Path, plan: Plan, trajectories: tuple, comment: str) -> dict[Run, Result]:
    """Writes a batch, runs it and reads it. A design that the scenario refuses stays out and says why."""
    search = state.search
    state.designs += plan.designs

    def cells(some: list[Run]) -> list[tuple[str, dict]]:
        return [(run.label, assigned(search, trajectories, state.designs[run.design], run)) for run in some]

    if not plan_path.exists():
        plan.refused = find_refused(state, engine, cells, plan.runs)
        accepted = [run for run in plan.runs if run.design not in plan.refused]
        if accepted:
            write_whole(plan_path.with_suffix(".toml"), sweep_text(search, plan_path.parent, cells(accepted), comment))
        write_whole(plan_path, plan.text())
    for number, why in plan.refused.items():
        state.designs[number].refusal = why
    accepted = [run for run in plan.runs if run.design not in plan.refused]
    if not accepted:
        return {}
    found = finished(state, engine, plan_path, cells(accepted), comment)
    return {run: found[run.label] for run in accepted}


def finished(state: State, engine: Engine, plan_path: Path, cells: list[tuple[str, dict]], comment: str) -> dict[str, Result]:
    """Results of a batch by label; writes its sweep file beside its plan and runs what is missing."""
    file, labels = plan_path.with_suffix(".toml"), [label for label, _ in cells]
    if not file.exists():
        if state.reads_only:
            raise Paused
        write_whole(file, sweep_text(state.search, file.parent, cells, comment))
    if engine.arguments.engine == "none" and not set(labels) <= set(read_or_gather(state, engine, file, labels)):
        if not state.reads_only:
            print(shlex.join(engine.words("run", file, state.sweep)))
        raise Paused
    return run_batch(engine, file, state.sweep, labels, f"{comment}: {len(labels)} cells")


def read_or_gather(state: State, engine: Engine, file: Path, labels: list[str]) -> dict:
    """What there is of a batch that others run."""
    table = file.with_suffix(".csv")
    found = read_table(table) if table.exists() else {}
    return found if set(labels) <= set(found) else gathered(engine, file, state.sweep, table)


def find_refused(state: State, engine: Engine, cells, runs: list[Run]) -> dict[int, str]:
    """Designs that the scenario refuses, with its reason; figures that no cell has end the search before its first cell."""
    search = state.search
    is_first = state.rounds == 0
    why_together = refusal(engine, search, cells(runs), [])
    if why_together is None:
        if is_first:
            check_figures(state, engine, cells(runs[:1]))
        return {}
    numbers = sorted({run.design for run in runs})
    refused = {}
    for number in numbers:
        why = refusal(engine, search, cells([run for run in runs if run.design == number]), [])
        if why is not None:
            refused[number] = why
    if is_first and len(refused) == len(numbers):
        raise Failure(f"{search.path}: {refused[numbers[0]]}")
    accepted = [run for run in runs if run.design not in refused]
    if refused and accepted:
        why_together = refusal(engine, search, cells(accepted), [])
    if accepted and why_together is not None:
        raise Failure(f"{search.path}: each design of round {state.rounds} is accepted alone, but not all of them together: {why_together}")
    if is_first:
        check_figures(state, engine, cells(accepted[:1]))
    return refused


def check_figures(state: State, engine: Engine, cells: list[tuple[str, dict]]) -> None:
    """Asks the program for every figure, so that a wrong name costs no cell."""
    search = state.search
    named = [(f"objective.{number}.figure", one.figure) for number, one in enumerate(search.objectives)]
    named += [(f"constraints.{number}", one.figure) for number, one in enumerate(search.constraints)]
    named = [(key, figure) for key, figure in named if not figure.startswith(OF_A_RUN)]
    if refusal(engine, search, cells, [figure for _, figure in named]) is None:
        return
    for key, figure in named:
        why = refusal(engine, search, cells, [figure])
        if why is not None:
            raise Failure(f"{search.path}: {key} = {figure}: {why.replace('figure of --spec', 'figure')}")


def after_round(state: State) -> None:
    """Names the figures once there is a cell, and ends a search in which nothing runs."""
    results = [result for design in state.designs for result in design.results.values()]
    whole = [result for result in results if not result.has_failed]
    if not whole:
        reason = reason_of_failure(state.sweep)
        raise Failure(f"{state.search.path}: all {len(results)} cells of the first round failed; one of them: {reason}", 3)
    if state.goals is None:
        known = sorted({name for result in whole for name in result.figures})
        try:
            state.goals = resolve_goals(state.search, known)
        except ValueError as error:
            raise Failure(f"{state.search.path}: {error}") from None
