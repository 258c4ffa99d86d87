"""Points of a search's space: drawn evenly, beside one another, as coordinates."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy

from .file import Factor, SearchFile

# How far a range is moved at most, as a share of it.
STEP_SHARE = 0.15
# Standard deviations of a scattered point, as powers of ten of the share of a range.
SCATTER_POWERS = (-2.0, -0.5)
# Factors of a design that are drawn anew at most.
REDRAWN_MOST = 3


def seed_of(search: SearchFile, turn: int) -> int:
    """Of a round."""
    return int.from_bytes(hashlib.sha256(f"{search.seed} {turn}".encode()).digest()[:4], "big")


def generator_of(search: SearchFile, turn: int, stream: int) -> numpy.random.Generator:
    """One of a round's streams of random numbers."""
    return numpy.random.Generator(numpy.random.PCG64([seed_of(search, turn), stream]))


def first(search: SearchFile) -> list[dict]:
    """Designs of the first round: a Latin hypercube, in which each range has as many equal parts as there are designs, and each part one of
    them (McKay 1979); uniform points for the sampler "random"."""
    generator = numpy.random.Generator(numpy.random.PCG64(seed_of(search, 0)))
    if search.sampler == "random":
        shares = generator.random((search.start, len(search.factors)))
    else:
        parts = [generator.permutation(search.start) for _ in search.factors]
        shares = (numpy.array(parts).T + generator.random((search.start, len(search.factors)))) / search.start
    return [{factor.name: factor.at(float(share)) for factor, share in zip(search.factors, row)} for row in shares]


def start(search: SearchFile) -> list[tuple[dict, str | None]]:
    """The first round with the names of guesses: each design once. A point that is a guess or that was drawn before stays out, so that a
    space of few designs gives fewer."""
    guesses = [is_ for _, is_ in search.guesses]
    points: list[dict] = []
    for is_ in first(search):
        if is_ not in guesses and is_ not in points:
            points.append(is_)
    return [(is_, None) for is_ in points] + [(is_, name) for name, is_ in search.guesses]


def drawn(search: SearchFile, generator: numpy.random.Generator) -> Iterator[dict]:
    """Endless designs, evenly over the space."""
    while True:
        yield {factor.name: factor.at(float(share)) for factor, share in zip(search.factors, generator.random(len(search.factors)))}


def other_choices(factor: Factor, value) -> list:
    """The neighbours of a step of a scale, or all other choices."""
    at = factor.choices.index(value)
    return [one for number, one in enumerate(factor.choices) if abs(number - at) == 1 or (not factor.is_scale and number != at)]


def shifted(factor: Factor, value, share: float):
    """A value of a range moved by a share of it, inside its bounds."""
    return factor.at(min(max(factor.share(value) + share, 0.0), 1.0))


def moved(factor: Factor, value, generator: numpy.random.Generator):
    """A value beside another: a step of a scale, up to a share of a range, or any other choice."""
    if factor.is_range:
        return shifted(factor, value, STEP_SHARE * (2.0 * generator.random() - 1.0))
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


def scattered(search: SearchFile, is_: dict, generator: numpy.random.Generator) -> dict:
    """A design near another: half of its ranges move, all by one scale that is drawn evenly over its logarithm, and a quarter of its choices."""
    scale = 10.0 ** generator.uniform(*SCATTER_POWERS)
    near = dict(is_)
    for factor in search.factors:
        if generator.random() < 0.5:
            if factor.is_range:
                near[factor.name] = shifted(factor, is_[factor.name], scale * float(generator.standard_normal()))
            elif generator.random() < 0.5:
                near[factor.name] = moved(factor, is_[factor.name], generator)
    return near


def redrawn(search: SearchFile, is_: dict, generator: numpy.random.Generator) -> dict:
    """A design that agrees with another in all but one to three factors, which are drawn evenly: each number of factors as likely."""
    many = min(1 + int(generator.integers(REDRAWN_MOST)), len(search.factors))
    fresh = {search.factors[at].name for at in generator.choice(len(search.factors), many, replace=False)}
    return {factor.name: factor.at(float(generator.random())) if factor.name in fresh else is_[factor.name] for factor in search.factors}


def coordinates(search: SearchFile, is_: dict) -> list[float]:
    """Of a design in a box of unit edges; a choice without order has an axis for each value."""
    point: list[float] = []
    for factor in search.factors:
        value = is_[factor.name]
        if factor.is_range:
            point.append(factor.share(value))
        elif factor.is_scale:
            point.append(factor.choices.index(value) / max(len(factor.choices) - 1, 1))
        else:
            point += [float(value == one) for one in factor.choices]
    return point
