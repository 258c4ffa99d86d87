"""Writes a search's page, the chosen design, and the tables behind the page."""

from __future__ import annotations

import json
import math
import warnings
from collections import Counter
from html import escape
from pathlib import Path

import optuna

from . import beside, rungs
from .batch import value_text, write_whole
from .chart import Series, chart, digits
from .choice import best, weights_of
from .failure import one_line
from .file import Constraint, Rung
from .loop import State
from .outcome import CONFIDENCE, Judged, chosen, eligible, judged, limits_moved, prices_doubled, progress, search_front
from .propose import sampler_text, study_of, versions
from .sureness import best_interval

STYLE = """:root{color-scheme:light dark;--s1:#0b62c4;--s2:#b3541e;--s3:#2f7d32;--soft:#555;--grid:#e2e2e2;--rule:#888;--bg:#fff;
--fg:#1a1a1a}
@media(prefers-color-scheme:dark){:root{--s1:#7db7ff;--s2:#ffac7a;--s3:#8bd48e;--soft:#bbb;--grid:#333;--rule:#777;--bg:#141414;--fg:#eee}}
body{font:15px/1.5 system-ui,sans-serif;background:var(--bg);color:var(--fg);margin:0 auto;max-width:1200px;padding:1rem}
h1{margin:.2em 0}h2{border-bottom:1px solid var(--grid);padding-top:1em;font-size:1.2rem}
table{border-collapse:collapse}th,td{padding:.2em .7em;border-bottom:1px solid var(--grid);text-align:left}
td.n{text-align:right;font-variant-numeric:tabular-nums}.note{color:var(--soft);max-width:60em}
.pair{display:flex;flex-wrap:wrap;gap:2rem;align-items:flex-start}.chart{margin:0;width:min(520px,100%)}
.chart>svg{width:100%;height:auto;fill:var(--fg)}.legend{list-style:none;display:flex;gap:1rem;padding:0}.legend svg{width:1em;height:1em}
section{overflow-x:auto}p{max-width:60em}"""

# Designs that a statement on keys rests on, at least.
DESIGNS_FOR_IMPORTANCE = 20
# Share by which a limit is moved to see what it costs.
MOVED = 0.1


def write(state: State, others: list[Path]) -> None:
    """Writes report.html, report.json and, with a choice, chosen.toml; says what was found, also beside other searches."""
    all_judged = judged(state)
    number = chosen(state.goals, all_judged) if state.is_finished else None
    read_others = [beside.read(folder, state.goals) for folder in others]
    facts = facts_of(state, all_judged, number)
    write_whole(state.out / "report.json", json.dumps(facts, indent=1) + "\n")
    lines = sentences(state, all_judged, number)
    lines += [line for other in read_others for line in beside.sentences(state.goals, all_judged, other)]
    lines = [one_line(line) for line in lines]
    measured = [(rung, state.agreements[at]) for at, rung in enumerate(state.search.rungs) if at in state.agreements]
    lines += [f"Rung '{one_line(rung.name)}': {rungs.reason(rung, found, state.goals)}." for rung, found in measured]
    toml = None
    if number is not None:
        toml = design_toml(state, number, lines)
        write_whole(state.out / "chosen.toml", toml)
    write_whole(state.out / "report.html", page(state, all_judged, number, lines, toml, facts))
    print("\n".join(lines))
    print(f"report: {state.out / 'report.html'}")
    if toml:
        print(f"design: {state.out / 'chosen.toml'}")


def keys_of(state: State, number: int) -> dict:
    """Keys of the scenario that a design sets, with those that all designs share."""
    keys = dict(state.search.set)
    for factor in state.search.factors:
        keys.update(factor.assigned(state.designs[number].is_[factor.name]))
    return keys


def design_toml(state: State, number: int, lines: list[str]) -> str:
    """A design as lines of a scenario, with the reasons above them."""
    comments = "".join(f"# {line}\n" for line in lines)
    keys = keys_of(state, number)
    words = " ".join(f"--set {shell(f'{key}={value_text(value)}')}" for key, value in keys.items())
    rows = "".join(f"{key} = {value_text(value)}\n" for key, value in keys.items())
    return f"{comments}# {one_line(f'sensel run {state.search.scenario} {words}')}\n\n{rows}"


def shell(text: str) -> str:
    """For a POSIX shell."""
    return "'" + text.replace("'", "'\\''") + "'"


def importance(state: State) -> dict[str, float]:
    """Which factors mattered for reaching the best tenth of the designs (PED-ANOVA); empty with too few designs."""
    summaries = state.summaries()
    if len(summaries) < DESIGNS_FOR_IMPORTANCE:
        return {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = optuna.importance.get_param_importances(study_of(state.search, state.goals, summaries, 0))
    return {name: float(share) for name, share in found.items()}


def mean_text(mean) -> str:
    """A mean with its interval."""
    if mean.value is None:
        return "not measured"
    ends = f" ({digits(mean.interval[0])} to {digits(mean.interval[1])})" if mean.interval else ""
    return digits(mean.value) + ends


def design_text(state: State, number: int) -> str:
    """A design's factors in words."""
    is_ = state.designs[number].is_
    return ", ".join(f"{name} = {value:.6g}" if isinstance(value, float) else f"{name} = {value}" for name, value in is_.items())


def title_of(state: State, number: int) -> str:
    """A design's number, and whose guess it is."""
    guess = state.designs[number].guess
    return f"design {number}" + (f" (guess: {guess})" if guess else "")


def sentences(state: State, all_judged: list[Judged], number: int | None) -> list[str]:
    """The choice and why, and what other prices and limits would change."""
    search = state.search
    if not state.is_finished:
        if state.final:
            return [f"The final evaluation goes on; {len(state.final)} designs have run."]
        if not search_front(state):
            return [f"{state.cells} cells of {len(state.designs)} designs: no design keeps all constraints yet."]
        return [f"{state.cells} of {search.cells} cells are finished; the front is not evaluated yet."]
    if number is None:
        return ["No design keeps all constraints on the held-out runs. Loosen a limit, widen a range, or give more cells."]
    own = next(one for one in all_judged if one.number == number)
    lines = [f"Chosen: {title_of(state, number)}: {design_text(state, number)}."]
    lines += [
        f"{objective.figure} is {mean_text(mean)} over {mean.count} held-out runs (mean with 95 % interval)."
        for objective, mean in zip(state.goals.objectives, own.means)
    ]
    for constraint, kept in zip(state.goals.constraints, own.kept):
        low, high = (100.0 * end for end in kept.interval)
        interval = f"95 % interval {low:.1f} to {high:.1f} %"
        where = misses_text(state, number, constraint)
        lines.append(f"'{constraint.text}': {kept.met} of {kept.runs} held-out runs keep it ({interval}): {kept.verdict}{where}.")
    lines += better_sentence(state, all_judged, own)
    among = eligible(all_judged)
    kept = "are shown to keep every share" if own.is_shown else "keep all constraints"
    found = f"Designs that {kept}: {len(among)} of the {len(all_judged)} in the final evaluation."
    if len(state.goals.objectives) == 1:
        goal = "largest" if state.goals.objectives[0].is_maximised else "least"
        resolution = state.goals.objectives[0].resolution
        least = f"This one has the {goal} {own_figure(state)}."
        surest = f"Of those within {digits(resolution)} of the {goal} {own_figure(state)}, this one is most certain to keep them."
        lines.append(f"{found} {surest if resolution else least}")
        lines.append(front_sentence(state, goal, all_judged))
        lines.append(f"With {own_figure(state)} as the only objective, its price changes nothing.")
    else:
        lines.append(
            f"{found} This one has the least product of its objectives, each raised to its weight."
        )
        for objective, (figure, other) in zip(state.goals.objectives, prices_doubled(state, all_judged)):
            priced = "were worth" if objective.is_maximised else "cost"
            same = "the choice stays" if other == number else f"{title_of(state, other)} would be chosen: {design_text(state, other)}"
            lines.append(f"If {figure} {priced} twice as much, {same}.")
    for text, limit, other in limits_moved(state, -MOVED):
        best_one = "" if other is None else f"the best one of the search is {title_of(state, other)}, with {means_text(state, other)}"
        said = best_one or "no design of this search keeps it"
        lines.append(f"With the limit of '{text}' at {digits(limit)}, {said}.")
    return lines


def misses_text(state: State, number: int, constraint: Constraint) -> str:
    """On which trajectories a design's held-out runs miss a constraint: an interval that counts runs as independent does not tell that."""
    results = state.final[number]
    missed = Counter(run.trajectory for run, result in results.items() if not constraint.is_met(state.goals.value(constraint.figure, result)))
    runs = Counter(run.trajectory for run in results)
    if not missed or len(runs) < 2:
        return ""
    return "; misses: " + ", ".join(f"{name} ({count} of {runs[name]})" for name, count in missed.most_common())


def better_sentence(state: State, all_judged: list[Judged], own: Judged) -> list[str]:
    """Whether the choice is shown to keep every share, and which better design more runs might show; nothing where no constraint has a share."""
    goals = state.goals
    if not any(one.share is not None for one in goals.constraints):
        return []
    if not own.is_shown:
        return ["These runs show no design to keep every share and all other constraints: 'shown' takes an interval above the share."]
    means = {one.number: one.summary.means for one in all_judged if one.is_admissible}
    other = best(goals, means, weights_of(goals))
    gain, resolution = abs(means[other][0] - own.summary.means[0]), goals.objectives[0].resolution
    if any(one.number == other and one.is_shown for one in all_judged) or 0.0 < resolution >= gain:
        return []
    values = " and ".join(f"{one.figure} {digits(mean)}" for one, mean in zip(goals.objectives, means[other]))
    return [f"Better would be {title_of(state, other)}, with {values}, if more runs show that it keeps every share: {design_text(state, other)}."]


def front_sentence(state: State, goal: str, all_judged: list[Judged]) -> str:
    """The single objective's best value with its interval."""
    low, high = best_interval(state.goals, all_judged)
    what = f"95 % interval of the {goal} {own_figure(state)} under these constraints"
    if math.isinf(low) or math.isinf(high):
        end = f"{digits(low)} or more" if math.isinf(high) else f"{digits(high)} or less"
        return f"{what}: {end}. The runs do not exclude that no design here keeps them."
    is_open = any(one.share is not None for one in state.goals.constraints)
    why = " It allows for designs whose shares the runs do not decide." if is_open else ""
    return f"{what}: {digits(low)} to {digits(high)}.{why}"


def means_text(state: State, number: int) -> str:
    """A design's means in the search."""
    means = next(one.means for one in state.summaries() if one.design.number == number)
    return " and ".join(f"{one.figure} {digits(mean)}" for one, mean in zip(state.goals.objectives, means))


def own_figure(state: State) -> str:
    """The one objective."""
    return state.goals.objectives[0].figure


def facts_of(state: State, all_judged: list[Judged], number: int | None) -> dict:
    """Everything on the page, for programs."""
    search, goals = state.search, state.goals
    designs = []
    on_front = {one.design.number for one in search_front(state)}
    for one in state.summaries():
        design = one.design
        designs.append(
            {
                "number": design.number,
                "round": design.round,
                "guess": design.guess,
                "is": design.is_,
                "runs": one.runs,
                "means": dict(zip([objective.figure for objective in goals.objectives], one.means)),
                "is_feasible": one.is_feasible,
                "on_front": design.number in on_front,
                "refused": design.refusal,
            }
        )
    final = []
    for one in all_judged:
        means = {
            objective.figure: {"mean": mean.value, "interval": mean.interval, "runs": mean.count, "lost": mean.lost}
            for objective, mean in zip(goals.objectives, one.means)
        }
        kept = {
            constraint.text: {"met": own.met, "runs": own.runs, "interval": own.interval, "verdict": own.verdict}
            for constraint, own in zip(goals.constraints, one.kept)
        }
        verdicts = {"is_admissible": one.is_admissible, "is_shown": one.is_shown}
        final.append({"number": one.number, "is": state.designs[one.number].is_, "means": means, "constraints": kept, **verdicts})
    return {
        "file": search.path.name,
        "sampler": search.sampler,
        "seed": search.seed,
        "versions": versions(),
        "cells": state.cells,
        "rounds": state.rounds,
        "is_finished": state.is_finished,
        "objectives": [
            {"figure": one.figure, "goal": "maximise" if one.is_maximised else "minimise", "resolution": one.resolution}
            for one in goals.objectives
        ],
        "constraints": [one.text for one in goals.constraints],
        "designs": designs,
        "final": final,
        "chosen": number,
        "progress": progress(state),
        "importance": importance(state),
        "rungs": [rung_facts(state, number, rung) for number, rung in enumerate(search.rungs) if number in state.agreements],
    }


def rung_facts(state: State, number: int, rung: Rung) -> dict:
    """How a rung's figures agree with those of full cells."""
    agreements = [
        {"figure": one.figure, "correlation": one.correlation, "interval": one.interval, "designs": one.designs, "ratio": one.ratio}
        for one in state.agreements[number]
    ]
    return {"name": rung.name, "cost": rung.cost, "is_used": number in rungs.used(state), "figures": agreements}


def rungs_section(state: State, facts: list[dict]) -> str:
    """Rungs of fidelity; nothing where the file has none."""
    if not facts:
        return ""
    rows = []
    for one in facts:
        for figure in one["figures"]:
            interval = figure["interval"]
            ends = f" ({interval[0]:.2f} to {interval[1]:.2f})" if interval else ""
            rho = "not measured" if figure["correlation"] is None else f"{figure['correlation']:.2f}{ends}"
            use = "used" if one["is_used"] else "left out"
            rows.append([one["name"], use, figure["figure"], rho, str(figure["designs"]), digits(figure["ratio"])])
    note = (
        "Spearman's rank correlation over the designs of the first round, which run both on the rung and in full; 95 % intervals of Bonett "
        f"and Wright. Rungs left {len(state.left_out)} proposals out. Their cells count with their stated cost."
    )
    heads = ["rung", "state", "figure", "rank correlation", "designs", "full over rung"]
    return f'<section><h2>Rungs</h2><p class="note">{note}</p>{table(heads, rows)}</section>'


def page(state: State, all_judged: list[Judged], number: int | None, lines: list[str], toml: str | None, facts: dict) -> str:
    """The page, one file without network."""
    search, goals = state.search, state.goals
    title = escape(one_line(f"Search: {search.path.stem}"))
    refused = sum(design.refusal is not None for design in state.designs)
    failed = sum(result.has_failed for design in state.designs for result in design.results.values())
    lost = sum(
        any(not one.is_met(result.figures.get(one.figure)) for one in goals.tracked.values())
        for design in state.designs
        for result in design.results.values()
        if not result.has_failed
    )
    wanted = "; ".join([f"{'maximise' if one.is_maximised else 'minimise'} {one.figure}" for one in goals.objectives])
    limits = "; ".join(one.text for one in goals.constraints) or "none"
    body = [
        f"<header><h1>{title}</h1><p>Wanted: {escape(wanted)}. Constraints: {escape(limits)}.</p>"
        f"<p class=\"note\">{state.cells} cells of {len(state.designs)} designs in {state.rounds} rounds; sampler "
        f"{sampler_text(search)}, search seed {search.seed}. {refused} designs were refused by the scenario, {failed} cells failed, "
        f"{lost} runs lost track.</p></header><main>",
        "<section><h2>The choice</h2>" + "".join(f"<p>{escape(line)}</p>" for line in lines),
        f"<pre>{escape(toml.split(chr(10) * 2, 1)[1])}</pre>" if toml else "",
        "</section>",
        front_section(state, all_judged, number),
        progress_section(state, facts["progress"]),
        importance_section(facts["importance"]),
        rungs_section(state, facts["rungs"]),
        designs_section(state),
    ]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{title}</title><style>{STYLE}</style></head><body>{''.join(body)}</main></body></html>\n"
    )


def table(heads: list[str], rows: list[list[str]]) -> str:
    """A table of texts."""
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    lines = "".join("<tr>" + "".join(f"<td>{escape(one)}</td>" for one in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table>"


def front_section(state: State, all_judged: list[Judged], number: int | None) -> str:
    """The front on held-out runs, with intervals."""
    goals = state.goals
    figures = [one.figure for one in goals.objectives]
    trajectories = state.search.final.trajectories
    same = trajectories == state.search.trajectories
    held = f"{len(state.search.final.seeds)} seeds" + (
        ", on the trajectories of the search: no others were given" if same else f" and {len(trajectories)} trajectories"
    )
    rows, of_search = [], {one.design.number: one.means for one in state.summaries()}
    for one in all_judged:
        kept = [f"{own.met} of {own.runs}: {own.verdict}" for own in one.kept]
        # The final evaluation's own designs have none.
        search_means = [digits(mean) for mean in of_search.get(one.number, [])] or ["none"]
        name = title_of(state, one.number) + (" (chosen)" if one.number == number else "")
        rows.append([name, *(mean_text(mean) for mean in one.means), *kept, ", ".join(search_means), design_text(state, one.number)])
    heads = ["design", *figures, *(one.text for one in goals.constraints), "means in the search", "values"]
    picture = ""
    if len(figures) >= 2:
        feasible = [one for one in state.summaries() if one.is_feasible]
        final = [one for one in all_judged if all(mean.value is not None for mean in one.means)]
        picture = chart(
            f"{figures[1]} against {figures[0]}",
            figures[0],
            figures[1],
            [
                Series("search, feasible", "var(--rule)", [(one.means[0], one.means[1]) for one in feasible], radius_px=3.0),
                Series(
                    "held-out runs",
                    "var(--s1)",
                    [(one.means[0].value, one.means[1].value) for one in final],
                    [one.means[1].interval for one in final],
                    [one.means[0].interval for one in final],
                    [str(one.number) for one in final],
                ),
            ],
        )
    return (
        f"<section><h2>Front</h2>{picture}<p class=\"note\">Held-out runs, which the search never saw: {escape(held)}. Means with "
        f"{100 * CONFIDENCE:.0f} % intervals of Student's t, which count runs as independent. The search's own means are too good, "
        f"because designs were picked by them.</p>{table(heads, rows)}</section>"
    )


def progress_section(state: State, line: list[tuple[int, float]]) -> str:
    """Hypervolume, or the best figure, over cells."""
    several = len(state.goals.objectives) > 1
    label = "hypervolume" if several else f"best {own_figure(state)}"
    series = Series(label, "var(--s1)", [(float(cells), value) for cells, value in line], is_line=True)
    note = "The reference point is the worst feasible design, a tenth of the span further out. " if several else ""
    return (
        f"<section><h2>Progress</h2>{chart(f'{label} over cells', 'cells', label, [series])}<p class=\"note\">{note}Designs count by all "
        "that is known of them now.</p></section>"
    )


def importance_section(shares: dict[str, float]) -> str:
    """Which keys mattered."""
    if not shares:
        few = f"Not known from fewer than {DESIGNS_FOR_IMPORTANCE} designs."
        return f'<section><h2>Which keys mattered</h2><p class="note">{few}</p></section>'
    rows = [[name, f"{100 * share:.0f} %"] for name, share in shares.items()]
    note = (
        "PED-ANOVA: how far a key's values among the best tenth of the designs differ from those among all, as a share over the keys. It "
        "shows which keys distinguished good designs from the others in this search; it is not the size of an effect."
    )
    return f'<section><h2>Which keys mattered</h2>{table(["factor", "share"], rows)}<p class="note">{note}</p></section>'


def designs_section(state: State) -> str:
    """Every design."""
    rows = []
    on_front = {one.design.number for one in search_front(state)}
    for one in state.summaries():
        verdict = "front" if one.design.number in on_front else "feasible" if one.is_feasible else "misses a constraint"
        name, what = title_of(state, one.design.number), design_text(state, one.design.number)
        rows.append([name, str(one.design.round), str(one.runs), *map(digits, one.means), one.design.refusal or verdict, what])
    heads = ["design", "round", "runs", *(one.figure for one in state.goals.objectives), "state", "values"]
    return f"<section><h2>All designs</h2>{table(heads, rows)}</section>"
