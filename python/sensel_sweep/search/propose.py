"""Proposes designs. Nothing is kept between rounds: the study is built again from the finished designs, and the sampler's seed is that of
the round."""

from __future__ import annotations

import hashlib
import itertools
import warnings
from collections.abc import Iterator

import numpy
import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution

from .designs import Summary, Wanted, front
from .failure import Failure
from .file import Factor, SearchFile

# Share of a round's designs that are drawn evenly over the space: a sampler that saw few runs settles on what was lucky.
EXPLORE_SHARE = 0.25
# Share of a round's designs that lie beside the best ones known, once any keeps all constraints.
NEAR_SHARE = 0.25
# How far a range is moved at most, as a share of it.
STEP_SHARE = 0.15
# Asked again so often where a proposal is known already.
TRIES = 20
# Names of NSGA-II's generations in a study; a round is a generation.
GENERATION = "NSGAIISampler:generation"


def seed_of(search: SearchFile, turn: int) -> int:
    """Of a round."""
    return int.from_bytes(hashlib.sha256(f"{search.seed} {turn}".encode()).digest()[:4], "big")


def kind(search: SearchFile) -> str:
    """The sampler by name."""
    return "tpe" if search.sampler == "auto" else search.sampler


def sampler(search: SearchFile, turn: int) -> optuna.samplers.BaseSampler:
    """Seeded for a round."""
    seed = seed_of(search, turn)
    name = kind(search)
    if name == "random":
        return optuna.samplers.RandomSampler(seed=seed)
    if name == "nsga2":
        return optuna.samplers.NSGAIISampler(population_size=max(search.batch, 2), seed=seed)
    if name == "gp":
        try:
            import torch  # noqa: F401
        except ModuleNotFoundError:
            raise Failure(f"{search.path}: search.sampler = gp: needs torch, which is not installed; use tpe") from None
        return optuna.samplers.GPSampler(n_startup_trials=1, seed=seed)
    return optuna.samplers.TPESampler(n_startup_trials=1, seed=seed)


def distribution(factor: Factor) -> BaseDistribution:
    """Where a factor's values lie. Choices go by number, so that a choice may be any value; steps of a scale have neighbours."""
    if not factor.is_range:
        last = len(factor.choices) - 1
        return IntDistribution(0, last) if factor.is_scale else CategoricalDistribution(list(range(last + 1)))
    if factor.is_whole:
        return IntDistribution(int(factor.rounded(factor.low)), int(factor.rounded(factor.high)), log=factor.is_log)
    return FloatDistribution(factor.low, factor.high, log=factor.is_log)


def study_of(search: SearchFile, wish: Wanted, summaries: list[Summary], turn: int) -> optuna.Study:
    """The finished designs as trials. What could not be measured takes the worst value that was; its constraint says that it failed."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    directions = ["maximize" if one.is_maximised else "minimize" for one in wish.objectives]
    study = optuna.create_study(directions=directions, sampler=sampler(search, turn))
    worst = []
    for number, objective in enumerate(wish.objectives):
        known = [one.means[number] for one in summaries if one.means[number] is not None]
        worst.append(objective.sign * max((objective.sign * value for value in known), default=0.0))
    distributions = {factor.name: distribution(factor) for factor in search.factors}
    for one in summaries:
        is_ = one.design.is_
        params = {
            factor.name: is_[factor.name] if factor.is_range else factor.choices.index(is_[factor.name]) for factor in search.factors
        }
        trial = optuna.trial.create_trial(
            values=[worst[number] if mean is None else mean for number, mean in enumerate(one.means)],
            params=params,
            distributions=distributions,
            constraints={str(number): excess for number, excess in enumerate(one.excess)},
            system_attrs={GENERATION: one.design.round},
        )
        study.add_trial(trial)
    return study


def first(search: SearchFile) -> list[dict]:
    """A Latin hypercube: each range has as many equal parts as there are designs, and each part one of them (McKay 1979)."""
    generator = numpy.random.Generator(numpy.random.PCG64(seed_of(search, 0)))
    if kind(search) == "random":
        shares = generator.random((search.start, len(search.factors)))
    else:
        parts = [generator.permutation(search.start) for _ in search.factors]
        shares = (numpy.array(parts).T + generator.random((search.start, len(search.factors)))) / search.start
    return [{factor.name: factor.at(float(share)) for factor, share in zip(search.factors, row)} for row in shares]


def drawn(search: SearchFile, turn: int) -> Iterator[dict]:
    """Endless designs, evenly over the space."""
    generator = numpy.random.Generator(numpy.random.PCG64([seed_of(search, turn), 1]))
    while True:
        yield {factor.name: factor.at(float(share)) for factor, share in zip(search.factors, generator.random(len(search.factors)))}


def other_choices(factor: Factor, value) -> list:
    """The neighbours of a step of a scale, or all other choices."""
    at = factor.choices.index(value)
    return [one for number, one in enumerate(factor.choices) if abs(number - at) == 1 or (not factor.is_scale and number != at)]


def moved(factor: Factor, value, generator: numpy.random.Generator):
    """A value beside another: a step of a scale, up to a share of a range, or any other choice."""
    if factor.is_range:
        return factor.at(min(max(factor.share(value) + STEP_SHARE * (2.0 * generator.random() - 1.0), 0.0), 1.0))
    beside = other_choices(factor, value)
    return beside[generator.integers(len(beside))] if beside else value


def steps(search: SearchFile, is_: dict) -> Iterator[dict]:
    """Designs one step from another: along a scale, to another choice, or to the next whole number of an even range."""
    for factor in search.factors:
        value = is_[factor.name]
        if not factor.is_range:
            beside = other_choices(factor, value)
        elif factor.is_whole and not factor.is_log:
            beside = [one for one in (value - 1, value + 1) if factor.low <= one <= factor.high]
        else:
            beside = []
        yield from ({**is_, factor.name: one} for one in beside)


def beside_best(search: SearchFile, wish: Wanted, summaries: list[Summary], turn: int) -> Iterator[dict]:
    """Designs beside the best: every step from one of them along a scale, so that no search ends a step from a better design; then,
    endlessly, those that differ in one or two factors. None while no design keeps all constraints."""
    generator = numpy.random.Generator(numpy.random.PCG64([seed_of(search, turn), 2]))
    best = front(wish, summaries)
    known = [one.design.is_ for one in summaries]
    around = [is_ for one in best for is_ in steps(search, one.design.is_) if is_ not in known]
    for at in generator.permutation(len(around)):
        yield around[at]
    while best:
        is_ = dict(best[generator.integers(len(best))].design.is_)
        many = min(1 + int(generator.integers(2)), len(search.factors))
        for at in generator.choice(len(search.factors), many, replace=False):
            factor = search.factors[at]
            is_[factor.name] = moved(factor, is_[factor.name], generator)
        yield is_


def asked(search: SearchFile, wish: Wanted, summaries: list[Summary], turn: int) -> Iterator[dict]:
    """Endless proposals of Optuna's sampler."""
    study = study_of(search, wish, summaries, turn)
    distributions = {factor.name: distribution(factor) for factor in search.factors}
    while True:
        params = study.ask(distributions).params
        yield {
            factor.name: factor.rounded(params[factor.name]) if factor.is_range else factor.choices[params[factor.name]]
            for factor in search.factors
        }


def proposals(search: SearchFile, wish: Wanted, summaries: list[Summary], turn: int, count: int) -> list[dict]:
    """New designs of a round, each once; fewer where the space has no more."""
    known = [one.design.is_ for one in summaries]
    found: list[dict] = []

    def take(source, most: int) -> None:
        for is_ in itertools.islice(source, most + TRIES):
            if len(found) == most:
                return
            if is_ not in known and is_ not in found:
                found.append(is_)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        guided = count - int(EXPLORE_SHARE * count)
        if kind(search) == "random":
            take(asked(search, wish, summaries, turn), guided)
        else:
            take(asked(search, wish, summaries, turn), guided - int(NEAR_SHARE * count))
            take(beside_best(search, wish, summaries, turn), guided)
    take(drawn(search, turn), count)
    return found
