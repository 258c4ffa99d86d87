"""Plays `sensel sweep` for a problem whose front is known: the same words, the same table, figures in closed form with noise.

Six factors. One trades power for pose error; the others each have a best value, and every distance from it costs both. A run's pose error
has a log-normal draw of 15 % by its seed, as cells of a study have; designs of a large pose error lose track in some runs. Fewer frames
drift less and have more noise. Expected codes tell nothing of the pose error here, so a search must leave a rung of them out."""

import csv
import hashlib
import json
import math
import random
import sys
import tomllib
from pathlib import Path

# Where each factor but the first is best, as a share of its range.
BEST = {"exposure_us": 0.62, "features": 0.55, "gain": 0.3, "threshold": 0.4}
RANGES = {
    "bias_ua": (1.0, 50.0),
    "exposure_us": (200.0, 20000.0),
    "features": (50.0, 800.0),
    "gain": (1.0, 8.0),
    "threshold": (4.0, 60.0),
}
NOISE = 0.15
# Frames of a full cell.
FRAMES = 60
FIGURES = ["energy.power_mw", "tracking.ate_m", "tracking.tracked_fraction"]
REFERENCE = (12.0, 0.04)


def share(name, value):
    """Of a factor's range on a logarithmic scale."""
    low, high = RANGES[name]
    return math.log(value / low) / math.log(high / low)


def distance(design):
    """1 at the best values; grows with the square of the distance from each."""
    squares = sum((share(name, design[name]) - best) ** 2 for name, best in BEST.items())
    return 1.0 + 4.0 * squares + (0.0 if design["smoothing"] == "binomial" else 0.6)


def truth(design):
    """Milliwatts and metres without noise. The front is where the distance is 1."""
    trade, far = share("bias_ua", design["bias_ua"]), distance(design)
    return (1.0 + 9.0 * trade) * math.sqrt(far), 0.004 * (1.0 + 6.0 * (1.0 - math.sqrt(trade))) * far


def front_volume(steps=20000):
    """Of the true front, below the reference."""
    power_most, ate_most = REFERENCE
    points = [(1.0 + 9.0 * at / steps, 0.004 * (1.0 + 6.0 * (1.0 - math.sqrt(at / steps)))) for at in range(steps + 1)]
    ends = [*(power for power, _ in points[1:]), power_most]
    return sum(max(0.0, ate_most - ate) * (end - power) for (power, ate), end in zip(points, ends))


def figures(keys):
    """Of one run."""
    power_mw, ate_m = truth(keys)
    draw = random.Random(hashlib.sha256(json.dumps(keys, sort_keys=True).encode()).digest())
    lost = draw.random() < min(max((ate_m - 0.05) / 0.1, 0.0), 0.9)
    noise = draw.gauss(0.0, 1.0)
    share = keys.get("run.frames", FRAMES) / FRAMES
    if keys.get("run.rung") == "expected":
        return [power_mw, 0.02 * math.exp(noise), 1.0]
    return [power_mw, math.sqrt(share) * ate_m * math.exp(NOISE / math.sqrt(share) * noise) * (20.0 if lost else 1.0), 0.5 if lost else 1.0]


def refuse(message):
    print(f"error: {message}", file=sys.stderr)
    sys.exit(2)


def main():
    _, part, file, *rest = sys.argv[1:]
    options = {word: rest[at + 1] for at, word in enumerate(rest[:-1]) if word in ("--out", "--cells")}
    sweep = tomllib.loads(Path(file).read_text(encoding="utf-8"))
    names = {cell["name"]: hashlib.sha256(json.dumps(cell["set"], sort_keys=True).encode()).hexdigest()[:32] for cell in sweep["cell"]}
    for cell in sweep["cell"]:
        for key in cell["set"]:
            if key not in RANGES and key not in ("smoothing", "seed", "run.frames", "run.rung"):
                refuse(f"{file}: {key}: unknown key")
    for word, spec in zip(rest, rest[1:]):
        if word == "--spec" and not any(name.endswith(spec.split()[0]) for name in FIGURES):
            refuse(f"figure of --spec '{spec.split()[0]}' is not known; known: {', '.join(FIGURES)}")
    folder = Path(options["--out"])
    if part == "run":
        (folder / "cells").mkdir(parents=True, exist_ok=True)
        asked = Path(options["--cells"]).read_text(encoding="utf-8").split() if "--cells" in options else names.values()
        for cell in sweep["cell"]:
            if names[cell["name"]] in asked:
                path = folder / "cells" / f"{names[cell['name']]}.json"
                path.write_text(json.dumps(figures(cell["set"])), encoding="utf-8")
        return
    if not folder.exists():
        sys.exit(4)
    with (folder / "cells.csv").open("w", encoding="utf-8", newline="") as table:
        rows = csv.writer(table, lineterminator="\n")
        rows.writerow(["cell", "status", "cell", *FIGURES])
        for label, name in names.items():
            path = folder / "cells" / f"{name}.json"
            if path.exists():
                rows.writerow([name, "done", label, *json.loads(path.read_text(encoding="utf-8"))])


if __name__ == "__main__":
    main()
