"""Parts of a search against closed forms and against Optuna's own hypervolume."""

import json
import math
import random
import tempfile
from pathlib import Path

import numpy
from optuna._hypervolume import compute_hypervolume
from sensel_sweep.search import file
from sensel_sweep.search.batch import Result, Run
from sensel_sweep.search.designs import Design, Wanted, excess_of, front, hypervolume, summary
from sensel_sweep.search.file import Objective, constraint
from sensel_sweep.search.outcome import kept_of, mean_of
from sensel_sweep.search.racing import near_front, residual_sd

TRACKED = constraint("tracking.tracked_fraction >= 1")
WISH = Wanted((Objective("energy.power_mw"), Objective("tracking.ate_m")), (TRACKED,), {"tracking.": TRACKED})


def result(power_mw, ate_m, tracked=1.0):
    return Result(False, {"energy.power_mw": power_mw, "tracking.ate_m": ate_m, "tracking.tracked_fraction": tracked})


def design(number, results):
    return Design(number, {}, 0, results={Run(number, None, seed): one for seed, one in enumerate(results, start=1)})


def volumes_agree():
    generator, compared = random.Random(1), 0
    for dimensions in (1, 2, 3, 4):
        for _ in range(20):
            places = [[generator.random() for _ in range(dimensions)] for _ in range(12)]
            reference = [0.9] * dimensions
            inside = [one for one in places if all(value < 0.9 for value in one)]
            theirs = compute_hypervolume(numpy.array(inside), numpy.array(reference)) if inside else 0.0
            # Sums of at most a thousand products of numbers below one.
            assert abs(hypervolume(places, reference) - theirs) < 1e-12, (places, theirs)
            compared += 1
    return compared


def a_lost_track_is_no_number():
    lost = summary(WISH, design(0, [result(10.0, 0.01), result(12.0, 5.0, tracked=0.5)]))
    assert lost.means == (11.0, 0.01) and not lost.is_feasible, lost
    nothing = summary(WISH, design(1, [Result(True, {})]))
    assert nothing.means == (None, None) and not nothing.is_feasible, nothing
    kept = summary(WISH, design(2, [result(11.0, 0.02)]))
    assert kept.is_feasible and [one.design.number for one in front(WISH, [lost, nothing, kept])] == [2]


def shares_pick_the_run():
    values = [0.008] * 9 + [0.02]
    assert excess_of(constraint("ate_m < 0.010 for 90 %"), values) < 0.0
    assert excess_of(constraint("ate_m < 0.010 for 91 %"), values) > 0.0
    assert excess_of(constraint("ate_m < 0.010"), values) == math.log1p(1.0)
    assert excess_of(constraint("ate_m < 0.010"), [0.01]) > 0.0 >= excess_of(constraint("ate_m <= 0.010"), [0.01])
    assert excess_of(constraint("ate_m < 0.010 for 90 %"), [0.008] * 8 + [None, None]) > 0.0
    assert excess_of(constraint("tracked_fraction >= 1"), [1.0, 0.9]) > 0.0 >= excess_of(constraint("tracked_fraction >= 1"), [1.0])


def intervals_are_exact():
    # 0.025^(1/n) reaches 0.99 first at n = 368.
    assert [kept_of(runs, runs, 0.99).verdict for runs in (367, 368)] == ["kept so far", "shown"]
    assert kept_of(98, 100, 0.99).verdict == "missed" and kept_of(5, 5, None).verdict == "kept so far"
    mean = mean_of([1.0, 2.0, 3.0], 4)
    # Student's t of two degrees of freedom at 0.975 is 4.30265.
    assert mean.lost == 1 and abs(mean.interval[1] - (2.0 + 4.30265 / math.sqrt(3.0))) < 1e-5


def noise_is_what_shifts_leave():
    generator = random.Random(2)
    shifts = [generator.gauss(0.0, 1.0) for _ in range(8)]

    def runs(level):
        return [result(10.0, level * math.exp(shift + generator.gauss(0.0, 0.1))) for shift in shifts]

    found, is_log = residual_sd(WISH, [summary(WISH, design(number, runs(0.01 * 1.5**number))) for number in range(60)], 1)
    # 413 degrees of freedom: a standard error of 3.5 %.
    assert is_log and abs(found / 0.1 - 1.0) < 4 * 0.035, found


def a_race_keeps_what_may_be_best():
    generator = random.Random(3)

    def runs(power_mw, ate_m):
        return [result(power_mw * math.exp(0.02 * generator.gauss(0.0, 1.0)), ate_m * math.exp(0.1 * generator.gauss(0.0, 1.0))) for _ in range(2)]

    crowd = [design(number, runs(30.0 + number, 0.05)) for number in range(40)]
    best, close, beaten = design(40, runs(10.0, 0.01)), design(41, runs(10.1, 0.0101)), design(42, runs(13.0, 0.02))
    kept = {one.design.number for one in near_front(WISH, [summary(WISH, one) for one in [*crowd, best, close, beaten]])}
    assert kept == {40, 41}, kept


def files_are_read():
    root = Path(__file__).parents[2]
    study = file.read(root / "scenes/studies/hall_power.toml")
    assert len(study.factors) == 7 and len(study.trajectories) == 2 and study.guesses[0][0] == "expert"
    seen = {name for name, _ in study.trajectories}
    assert not seen & {name for name, _ in study.final.trajectories} and min(study.final.seeds) > study.seeds_most
    text = (root / "docs/search.md").read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    with tempfile.TemporaryDirectory() as scratch:
        example = Path(scratch) / "example.toml"
        example.write_text(text, encoding="utf-8")
        assert len(file.read(example).constraints) == 3


def main():
    compared = volumes_agree()
    checks = [a_lost_track_is_no_number, shares_pick_the_run, intervals_are_exact, noise_is_what_shifts_leave]
    checks += [a_race_keeps_what_may_be_best, files_are_read]
    for check in checks:
        check()
    print(json.dumps({"volumes": compared, "checks": len(checks)}))


if __name__ == "__main__":
    main()
