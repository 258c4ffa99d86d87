"""Reads a search file: what is varied, what is wanted, and how many cells it may cost. Unknown keys are refused."""

from __future__ import annotations

import hashlib
import json
import math
import re
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path

from .checks import Checks, finite
from .failure import Failure

SAMPLERS = ["auto", "tpe", "nsga2", "gp", "random"]
RELATIONS = ["<=", ">=", "<", ">"]
# "keeps_up" in a list of constraints.
KEEPS_UP = "timing.extractor.frames_over <= 0"
# Of the final evaluation, where the file gives a count.
SEEDS_MOST = 1_000_000


@dataclass(frozen=True)
class Factor:
    """What is varied: a key over values or from low to high, or named levels of several keys each."""

    name: str
    key: str | None = None
    values: tuple = ()
    levels: tuple = ()
    low: float = 0.0
    high: float = 0.0
    is_log: bool = False
    is_whole: bool = False

    @property
    def is_range(self) -> bool:
        """Whether it goes from low to high."""
        return not self.values and not self.levels

    @property
    def choices(self) -> list:
        """Values, or names of levels."""
        return list(self.values) or [name for name, _ in self.levels]

    @property
    def is_scale(self) -> bool:
        """Whether its choices are steps of a scale: numbers, or names that are numbers, in rising order."""
        try:
            numbers = [float("nan") if isinstance(one, (bool, list, dict)) else float(one) for one in self.choices]
        except ValueError:
            return False
        return all(low < high for low, high in zip(numbers, numbers[1:]))

    def at(self, share: float):
        """The value at a share of the range, 0 to below 1; choices are equally likely."""
        if not self.is_range:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        if self.is_log:
            return self.rounded(self.low * math.exp(share * math.log(self.high / self.low)))
        return self.rounded(self.low + share * (self.high - self.low))

    def share(self, value: float) -> float:
        """Where a value of a range lies in it, 0 to 1: what `at` makes the value of."""
        if self.is_log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def holds(self, value: object) -> bool:
        """Whether it is one of the choices, or a number of the range."""
        if not self.is_range:
            return value in self.choices
        number = finite(value)
        return number is not None and self.low <= number <= self.high and (not self.is_whole or value == int(value))

    def rounded(self, value):
        """Whole, or four significant digits within the bounds: the last bits of a processor's arithmetic decide no design."""
        if not self.is_range:
            return value
        if self.is_whole:
            return int(min(max(round(value), math.ceil(self.low)), math.floor(self.high)))
        return min(max(float(f"{value:.4g}"), self.low), self.high)

    @property
    def keys(self) -> set[str]:
        """Keys of the scenario that it varies."""
        return {key for _, keys in self.levels for key in keys} if self.levels else {self.key}

    def assigned(self, value) -> dict:
        """Keys of the scenario and their values."""
        if self.levels:
            return dict(next(keys for name, keys in self.levels if name == value))
        return {self.key: value}


@dataclass(frozen=True)
class Objective:
    """A figure that is to be small or large."""

    figure: str
    is_maximised: bool = False
    weight: float = 1.0
    # A smaller difference does not matter; of a single objective.
    resolution: float = 0.0

    @property
    def sign(self) -> float:
        """What makes smaller better."""
        return -1.0 if self.is_maximised else 1.0


@dataclass(frozen=True)
class Constraint:
    """A figure, its limit, and the share of the runs that must keep it; without a share, all of them."""

    figure: str
    relation: str
    limit: float
    share: float | None
    text: str

    @property
    def sign(self) -> float:
        """What makes smaller better."""
        return 1.0 if self.relation.startswith("<") else -1.0

    def moved(self, share: float) -> Constraint:
        """With a limit that is looser (above 0) or tighter by a share of itself."""
        return replace(self, limit=self.limit + self.sign * share * abs(self.limit))

    def is_met(self, value: float | None) -> bool:
        """Whether a run keeps it; one without the figure does not."""
        if value is None:
            return False
        return {"<": value < self.limit, "<=": value <= self.limit, ">": value > self.limit, ">=": value >= self.limit}[self.relation]


@dataclass(frozen=True)
class Rung:
    """Cheaper cells that choose which proposals run in full."""

    name: str
    # Share of the frames of a full cell.
    frames: float
    set: dict
    seeds: int
    # How many of the search's trajectories it uses, from the first on.
    trajectories: int
    # Of a full cell.
    cost: float
    # Share of the designs that go on.
    keep: float
    # Least rank correlation with full cells.
    correlation: float


@dataclass(frozen=True)
class Final:
    """The evaluation of the front on seeds and trajectories that the search never saw."""

    seeds: tuple[int, ...]
    trajectories: tuple
    designs: int


@dataclass(frozen=True)
class SearchFile:
    """A search file, checked."""

    path: Path
    scenario: str
    set: dict
    cameras_alone: bool
    factors: tuple[Factor, ...]
    trajectories: tuple
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    guesses: tuple
    final: Final
    seed: int
    cells: int
    batch: int
    start: int
    seeds: int
    seeds_most: int
    sampler: str
    rungs: tuple[Rung, ...] = ()
    identity: str = field(default="", compare=False)

    def holds(self, is_: dict) -> bool:
        """Whether a design is a point of the space."""
        return set(is_) == {factor.name for factor in self.factors} and all(factor.holds(is_[factor.name]) for factor in self.factors)

    @property
    def replicates(self) -> int:
        """Cells of a new design."""
        return self.seeds * len(self.trajectories)


def constraint(text: str) -> Constraint:
    """Reads `FIGURE < LIMIT`, with <, <=, > or >=, and `for SHARE %` or nothing after it."""
    example = 'write "ate_m < 0.010 for 99 %", "power_mw < 5" or "keeps_up"'
    if text.strip() == "keeps_up":
        return Constraint(*constraint_parts(KEEPS_UP, example), text=text.strip())
    return Constraint(*constraint_parts(text, example), text=text.strip())


def constraint_parts(text: str, example: str) -> tuple[str, str, float, float | None]:
    rule, has_share, share_text = text.partition(" for ")
    relation = next((sign for sign in RELATIONS if sign in rule), None)
    if relation is None:
        raise ValueError(f"there is no <, <=, > or >=; {example}")
    figure, _, limit_text = (part.strip() for part in rule.partition(relation))
    share = None
    if has_share:
        number = re.fullmatch(r"\s*([0-9]+\.?[0-9]*|\.[0-9]+)\s*%\s*", share_text)
        share = float(number[1]) / 100.0 if number else None
        if share is None or not 0.0 < share < 1.0:
            raise ValueError(f"the share must be above 0 and below 100 %; {example}")
    try:
        limit = float(limit_text)
    except ValueError:
        raise ValueError(f"the limit is no number; {example}") from None
    if not figure or not math.isfinite(limit):
        raise ValueError(f"a figure and a finite limit are needed; {example}")
    return figure, relation, limit, share


def read(path: Path, own: dict | None = None) -> SearchFile:
    """Reads and checks a search file; `own` keys take the place of those in its [search]."""
    try:
        # Some editors begin a file with a byte order mark.
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise Failure(f"{path}: {error.strerror or error}", 4) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise Failure(f"{path}: {error}") from None
    except (ValueError, RecursionError):
        # Python does not read a number of thousands of digits, nor lists within hundreds of lists.
        raise Failure(f"{path}: a number has too many digits, or lists and tables are nested too deeply; use finite numbers") from None
    if own and isinstance(table.get("search", {}), dict):
        table["search"] = {**table.get("search", {}), **own}
    return Reader(str(path)).search_file(path, table)


class Reader(Checks):
    """Checks the parts of a search file."""

    def factor(self, number: int, table: dict) -> Factor:
        where = f"factor.{number}"
        self.known(where, table, ["name", "key", "values", "low", "high", "spacing", "whole", "level"])
        name = self.text(where, table, "name", "bits") if "name" in table else table.get("key")
        ways = ["values" in table, "low" in table or "high" in table, "level" in table]
        if sum(ways) != 1:
            raise self.refused(f"{where}.values", None, "give one of values, low with high, or [[factor.level]] tables")
        if "level" in table:
            levels = self.levels(f"{where}.level", table["level"])
            if len(levels) < 2:
                raise self.refused(f"{where}.level", None, "give at least two levels")
            for at, (level, keys) in enumerate(levels):
                if keys in [one for _, one in levels[:at]]:
                    raise self.refused(f"{where}.level.{at}", level, "sets the same keys as a level before it; leave one out")
            return Factor(self.text(where, table, "name", "smoothing"), levels=levels)
        key = self.text(where, table, "key", "sensor.adc.bits")
        if "values" in table:
            values = table["values"]
            if not isinstance(values, list) or len(values) < 2:
                raise self.refused(f"{where}.values", values, "give at least two values, as in values = [8, 10, 12]")
            self.scenario_value(f"{where}.values", values)
            self.refuse_twins(f"{where}.values", values, "leave one out")
            return Factor(name, key, values=tuple(values))
        low, high = table.get("low"), table.get("high")
        for end, value in (("low", low), ("high", high)):
            if finite(value) is None:
                raise self.refused(f"{where}.{end}", value, "a range needs low and high, both finite, as in low = 1, high = 12")
        if not low < high:
            raise self.refused(f"{where}.high", high, f"must be above low, which is {low}")
        low, high = float(low), float(high)
        spacing = table.get("spacing", "linear")
        if spacing not in ("linear", "log"):
            raise self.refused(f"{where}.spacing", spacing, 'use "linear" or "log"')
        if spacing == "log" and low <= 0:
            raise self.refused(f"{where}.low", low, 'must be above 0 with spacing = "log"')
        if not math.isfinite(high / low if spacing == "log" else high - low):
            raise self.refused(f"{where}.high", high, f"is too far above low, which is {low}; use a narrower range")
        is_whole = table.get("whole", False)
        if is_whole not in (True, False):
            raise self.refused(f"{where}.whole", is_whole, "use true or false")
        if is_whole and math.floor(high) <= math.ceil(low):
            raise self.refused(f"{where}.high", high, "there are fewer than two whole numbers from low to high")
        return Factor(name, key, low=low, high=high, is_log=spacing == "log", is_whole=is_whole)

    def objective(self, number: int, table: dict) -> Objective:
        where = f"objective.{number}"
        self.known(where, table, ["figure", "goal", "weight", "resolution"])
        goal = table.get("goal", "minimise")
        if goal not in ("minimise", "maximise"):
            raise self.refused(f"{where}.goal", goal, 'use "minimise" or "maximise"')
        weight = self.number(where, table, "weight", 1.0, 1e-6, 1e6)
        resolution = self.number(where, table, "resolution", 0.0, 0.0, 1e12)
        return Objective(self.text(where, table, "figure", "power_mw"), goal == "maximise", float(weight), float(resolution))

    def guess(self, number: int, table: dict, factors: tuple[Factor, ...]) -> tuple:
        """A design that somebody wrote down: every factor has a value."""
        where = f"guess.{number}"
        self.known(where, table, ["name", "is"])
        name, given = self.text(where, table, "name", "expert"), table.get("is", {})
        self.known(f"{where}.is", given, [factor.name for factor in factors])
        for factor in factors:
            value = given.get(factor.name)
            if not factor.holds(value):
                ends = f"from {factor.low:g} to {factor.high:g}{', whole' if factor.is_whole else ''}"
                wanted = ends if factor.is_range else f"one of {factor.choices}"
                raise self.refused(f"{where}.is.{factor.name}", value, f"must be {wanted}")
        return name, {factor.name: factor.rounded(given[factor.name]) for factor in factors}

    def final(self, table: dict, seeds_most: int, trajectories: tuple) -> Final:
        self.known("final", table, ["seeds", "designs", "trajectory"])
        seeds = table.get("seeds", 8)
        if isinstance(seeds, int) and not isinstance(seeds, bool) and 0 < seeds <= SEEDS_MOST:
            seeds = list(range(seeds_most + 1, seeds_most + 1 + seeds))
        is_list = isinstance(seeds, list) and all(isinstance(one, int) and not isinstance(one, bool) and 0 <= one < 2**63 for one in seeds)
        if not is_list or not seeds:
            raise self.refused("final.seeds", seeds, f"must be a count from 1 to {SEEDS_MOST} or a list, as in seeds = 20")
        self.refuse_twins("final.seeds", seeds, "leave one out")
        seen = [seed for seed in seeds if seed <= seeds_most and seed > 0]
        if seen:
            raise self.refused("final.seeds", seen[0], f"the search itself uses seeds 1 to {seeds_most}; use {seeds_most + 1} or more")
        own = self.trajectories("final.trajectory", table["trajectory"]) if "trajectory" in table else trajectories
        designs = self.number("final", table, "designs", 6, 1, 1000)
        return Final(tuple(seeds), own, designs)

    def rung(self, number: int, table: dict, factors: tuple[Factor, ...], trajectories: int, seeds: int, has_frames: bool) -> Rung:
        where = f"rung.{number}"
        self.known(where, table, ["name", "frames", "set", "seeds", "trajectories", "cost", "keep", "correlation"])
        name = self.text(where, table, "name", "half as long")
        frames = float(self.number(where, table, "frames", 1.0, 1e-3, 1.0))
        if frames < 1.0 and not has_frames:
            raise self.refused(f"{where}.frames", frames, "needs run.frames in [set], or in every level of one factor")
        own = self.keys(f"{where}.set", table.get("set", {}))
        varied = {key for factor in factors for key in factor.keys}
        for key in own:
            if key in varied:
                raise self.refused(f"{where}.set.{key}", own[key], "is varied by a factor, so that a rung that sets it tells nothing of it")
        own_seeds = self.number(where, table, "seeds", 1, 1, seeds)
        own_trajectories = self.number(where, table, "trajectories", trajectories, 1, trajectories)
        cost = float(self.number(where, table, "cost", frames, 1e-6, 1.0))
        if not own and frames == 1.0 and own_seeds == seeds and own_trajectories == trajectories:
            raise self.refused(where, None, "is a full cell; give it fewer frames, seeds or trajectories, or keys that make cells cheaper")
        keep = float(self.number(where, table, "keep", 0.5, 0.01, 0.99))
        correlation = float(self.number(where, table, "correlation", 0.7, 0.0, 1.0))
        return Rung(name, frames, own, own_seeds, own_trajectories, cost, keep, correlation)

    def refuse_keys_of_others(self, factors: tuple[Factor, ...], own_set: dict) -> None:
        """Refuses factors on the seed, on a key of another factor, and on a key that [set] gives and no cell would have."""
        owner: dict[str, str] = {}
        for number, factor in enumerate(factors):
            for key in sorted(factor.keys):
                where = f"factor.{number}.level" if factor.levels else f"factor.{number}.key"
                if key == "seed":
                    raise self.refused(where, key, "the search itself gives each cell its seed; use search.seeds and final.seeds")
                if key in owner:
                    raise self.refused(where, key, f"is varied by the factor {owner[key]} too; leave it to one of them")
                owner[key] = f"'{factor.name}'"
                if key in own_set and all(key in keys for _, keys in factor.levels):
                    raise self.refused(f"set.{key}", own_set[key], f"is varied by the factor {owner[key]}; leave it out of set")

    def refuse_equal_guesses(self, guesses: tuple) -> None:
        """Refuses a design that stands there under two names."""
        for number, (name, is_) in enumerate(guesses):
            twin = next((other for other, known in guesses[:number] if known == is_), None)
            if twin is not None:
                raise self.refused(f"guess.{number}.name", name, f"is the same design as the guess '{twin}'; leave one out")

    def search_file(self, path: Path, table: dict) -> SearchFile:
        top = ["scenario", "set", "cameras_alone", "trajectory", "factor", "objective", "constraints", "guess", "rung", "search", "final"]
        self.known("", table, top)
        scenario = self.text("", table, "scenario", "hall")
        factors = tuple(self.factor(number, one) for number, one in enumerate(self.tables("factor", table.get("factor", []))))
        if not factors:
            raise self.refused("factor", None, "nothing is varied; write at least one [[factor]] with key, low and high")
        self.refuse_twins("factor", [factor.name for factor in factors])
        own_set = self.keys("set", table.get("set", {}))
        self.refuse_keys_of_others(factors, own_set)
        objectives = tuple(self.objective(number, one) for number, one in enumerate(self.tables("objective", table.get("objective", []))))
        if not objectives:
            raise self.refused("objective", None, 'nothing is wanted; write at least one [[objective]] with figure = "power_mw"')
        self.refuse_twins("objective", [one.figure for one in objectives])
        for number, one in enumerate(objectives):
            if one.resolution > 0.0 and len(objectives) > 1:
                raise self.refused(f"objective.{number}.resolution", one.resolution, "leave it out: several objectives are weighed by `weight`")
        constraints = []
        texts = table.get("constraints", [])
        if not isinstance(texts, list):
            raise self.refused("constraints", texts, 'must be a list, as in constraints = ["power_mw < 5"]')
        for number, text in enumerate(texts):
            try:
                constraints.append(constraint(str(text)))
            except ValueError as error:
                raise self.refused(f"constraints.{number}", text, str(error)) from None
        own = table.get("search", {})
        self.known("search", own, ["seed", "cells", "batch", "start", "seeds", "seeds_most", "sampler"])
        trajectories = self.trajectories("trajectory", table["trajectory"]) if "trajectory" in table else ((None, {}),)
        seeds = self.number("search", own, "seeds", 2, 1, 1000)
        seeds_most = self.number("search", own, "seeds_most", max(8, seeds), seeds, 1000)
        batch = self.number("search", own, "batch", 8, 1, 10_000)
        start = self.number("search", own, "start", max(batch, 2 * len(factors) + 2), 2, 10_000)
        cells = self.number("search", own, "cells", 240, 1, 1_000_000)
        guesses = tuple(self.guess(number, one, factors) for number, one in enumerate(self.tables("guess", table.get("guess", []))))
        self.refuse_twins("guess", [name for name, _ in guesses])
        self.refuse_equal_guesses(guesses)
        has_frames = "run.frames" in own_set or any(
            factor.levels and all("run.frames" in keys for _, keys in factor.levels) for factor in factors
        )
        rungs = tuple(
            self.rung(number, one, factors, len(trajectories), seeds, has_frames)
            for number, one in enumerate(self.tables("rung", table.get("rung", [])))
        )
        self.refuse_twins("rung", [one.name for one in rungs])
        least = (start + len(guesses)) * seeds * len(trajectories)
        if cells < least:
            reason = f"the first round alone takes {least} cells ({start} designs to start with, {len(guesses)} guesses, "
            raise self.refused("search.cells", cells, reason + f"{seeds * len(trajectories)} cells each); use {least} or more")
        sampler = own.get("sampler", "auto")
        if sampler not in SAMPLERS:
            raise self.refused("search.sampler", sampler, f"use one of {', '.join(SAMPLERS)}")
        return SearchFile(
            path=path,
            scenario=scenario,
            set=own_set,
            cameras_alone=self.switch("cameras_alone", table),
            factors=factors,
            trajectories=trajectories,
            objectives=objectives,
            constraints=tuple(constraints),
            guesses=guesses,
            final=self.final(table.get("final", {}), seeds_most, trajectories),
            seed=self.number("search", own, "seed", 1, 0, 2**63 - 1),
            cells=cells,
            batch=batch,
            start=start,
            seeds=seeds,
            seeds_most=seeds_most,
            sampler=sampler,
            rungs=rungs,
            identity=identity(table),
        )


def identity(table: dict) -> str:
    """Hash of everything that decides batches; the number of cells, the final evaluation and resolutions may change later."""
    kept = {key: value for key, value in table.items() if key != "final"}
    kept["objective"] = [{key: value for key, value in one.items() if key != "resolution"} for one in table["objective"]]
    kept["search"] = {key: value for key, value in table.get("search", {}).items() if key != "cells"}
    return hashlib.sha256(json.dumps(kept, sort_keys=True, default=str).encode()).hexdigest()[:16]
