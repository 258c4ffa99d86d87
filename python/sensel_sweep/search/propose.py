"""Proposes designs: by a sampler of Optuna, and once many have finished by Gaussian processes. Nothing is kept between rounds: the study is
built again from the finished designs, and the sampler's seed is that of the round."""

from __future__ import annotations

import importlib.metadata
import itertools
import warnings
from collections.abc import Iterator

import numpy
import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution

from .designs import Goals, Summary, front
from .failure import Failure
from .file import Factor, SearchFile
from .space import drawn, generator_of, moved, seed_of, steps

# Raises where scikit-learn is missing. It is loaded only by rounds in which Gaussian processes propose, since that takes a second.
SCIKIT_LEARN = importlib.metadata.version("scikit-learn")

# Share of a round's designs that are drawn evenly over the space: a sampler that saw few runs settles on what was lucky. As many lie beside
# the best ones known, once any keeps all constraints. Processes explore by themselves and need half of it.
EXPLORE_SHARE = 0.25
# Finished designs for each factor from which Gaussian processes propose: ten, by the rule of Loeppky, Sacks and Welch (2009).
DESIGNS_PER_FACTOR = 10
# Asked again so often where a proposal is known already.
TRIES = 20
# Names of NSGA-II's generations in a study; a round is a generation.
GENERATION = "NSGAIISampler:generation"


def kind(search: SearchFile) -> str:
    """The sampler of Optuna by name."""
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
            raise Failure(f"{search.path}: search.sampler = gp: needs torch, which is not installed; use auto") from None
        return optuna.samplers.GPSampler(n_startup_trials=1, seed=seed)
    return optuna.samplers.TPESampler(n_startup_trials=1, seed=seed)


def designs_for_processes(search: SearchFile) -> int:
    """From how many finished designs on Gaussian processes propose."""
    return DESIGNS_PER_FACTOR * len(search.factors)


def versions() -> dict[str, str]:
    """Of the libraries that proposals depend on, by name."""
    return {"optuna": optuna.__version__, "scikit-learn": SCIKIT_LEARN, "numpy": numpy.__version__}


def sampler_text(search: SearchFile) -> str:
    """The sampler in words."""
    text = f"{kind(search)} of Optuna {optuna.__version__}"
    if search.sampler != "auto":
        return text
    return f"{text}, from {designs_for_processes(search)} designs on Gaussian processes of scikit-learn {SCIKIT_LEARN}"


def distribution(factor: Factor) -> BaseDistribution:
    """Where a factor's values lie. Choices go by number, so that a choice may be any value; steps of a scale have neighbours."""
    if not factor.is_range:
        last = len(factor.choices) - 1
        return IntDistribution(0, last) if factor.is_scale else CategoricalDistribution(list(range(last + 1)))
    if factor.is_whole:
        return IntDistribution(int(factor.rounded(factor.low)), int(factor.rounded(factor.high)), log=factor.is_log)
    return FloatDistribution(factor.low, factor.high, log=factor.is_log)


def study_of(search: SearchFile, goals: Goals, summaries: list[Summary], turn: int) -> optuna.Study:
    """The finished designs as trials. What could not be measured takes the worst value that was; its constraint says that it failed."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    directions = ["maximize" if one.is_maximised else "minimize" for one in goals.objectives]
    study = optuna.create_study(directions=directions, sampler=sampler(search, turn))
    worst = []
    for number, objective in enumerate(goals.objectives):
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


def beside_best(search: SearchFile, goals: Goals, summaries: list[Summary], turn: int) -> Iterator[dict]:
    """Designs beside the best: every step from one of them along a scale, so that no search ends a step from a better design; then,
    endlessly, those that differ in one or two factors. None while no design keeps all constraints."""
    generator = generator_of(search, turn, 2)
    best = front(goals, summaries)
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


def asked(search: SearchFile, goals: Goals, summaries: list[Summary], turn: int) -> Iterator[dict]:
    """Endless proposals of Optuna's sampler."""
    study = study_of(search, goals, summaries, turn)
    distributions = {factor.name: distribution(factor) for factor in search.factors}
    while True:
        params = study.ask(distributions).params
        yield {
            factor.name: factor.rounded(params[factor.name]) if factor.is_range else factor.choices[params[factor.name]]
            for factor in search.factors
        }


def proposals(search: SearchFile, goals: Goals, summaries: list[Summary], turn: int, count: int) -> list[dict]:
    """New designs of a round, each once; fewer where the space has no more."""
    known = [one.design.is_ for one in summaries]
    found: list[dict] = []

    def take(source, most: int) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            for is_ in itertools.islice(source, most + TRIES):
                if len(found) == most:
                    return
                if is_ not in known and is_ not in found:
                    found.append(is_)

    by_processes = search.sampler == "auto" and len(summaries) >= designs_for_processes(search)
    aside = int((0.5 if by_processes else 1.0) * EXPLORE_SHARE * count)
    if kind(search) == "random":
        take(asked(search, goals, summaries, turn), count - aside)
    else:
        source = asked
        if by_processes:
            from .thompson import sampled as source
        take(source(search, goals, summaries, turn), count - 2 * aside)
        take(beside_best(search, goals, summaries, turn), count - aside)
    take(drawn(search, generator_of(search, turn, 1)), count)
    return found
