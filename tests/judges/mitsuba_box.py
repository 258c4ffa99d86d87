#!/usr/bin/env python3
"""Renders an exported box room with Mitsuba 3 and compares pixels.

Takes a folder with scene.json (written by tests/light.rs): camera, faces, lamp, photons per radiance of each band, and raw
little-endian float32 files: textures (linear, the top row first) and our own pictures; the number of paths a pixel; and a record of Mitsuba's
pictures. Prints the mean relative error of the direct light and of the light after all bounces as JSON.

Mitsuba's pictures depend on the scene, the two scripts and its version alone, and take nine tenths of the time. So it renders again only after
one of these has changed, and each week (SENSEL_ALL_CASES), when the record must show the same. SENSEL_UPDATE records what it renders.
"""

import hashlib
import importlib.metadata
import json
import os
import sys
from pathlib import Path

import numpy as np

folder = Path(sys.argv[1])
spp = int(sys.argv[2])
record = Path(sys.argv[3])
scene = json.loads((folder / "scene.json").read_text())
version = importlib.metadata.version("mitsuba")


def asked():
    """Hash of all that Mitsuba's pictures depend on but its version."""
    faces = scene["faces"]
    maps = [face[key]["file"] for face in faces for key in ("normal_map", "emission_map") if face.get(key)]
    files = sorted({face["texture"] for face in faces if face["texture"]} | set(maps))
    scripts = [Path(__file__), Path(__file__).with_name("mitsuba_pictures.py")]
    whole = hashlib.sha256(str(spp).encode())
    for path in [*scripts, folder / "scene.json", *(folder / name for name in files)]:
        whole.update(hashlib.sha256(path.read_bytes()).digest())
    return whole.hexdigest()


def squares(pictures):
    """Means over 2 by 2 pixels: an edge that falls a hundredth of a pixel apart, and noise, count less."""
    count, height, width = pictures.shape
    return pictures.reshape(count, height // 2, 2, width // 2, 2).mean(axis=(2, 4))


def theirs_by_name(depths):
    """Squares of Mitsuba's pictures, and what the record is to them: "found", "stale", "wrong", or "new" for another Mitsuba or a weekly run."""
    key, known = asked(), {}
    if record.exists():
        with np.load(record) as file:
            known = dict(file)
    is_of_version = str(known.get("mitsuba", version)) == version
    is_found = str(known.get("asked")) == key and is_of_version
    updates = "SENSEL_UPDATE" in os.environ
    if is_found and "SENSEL_ALL_CASES" not in os.environ and not updates:
        return known, "found"
    from mitsuba_pictures import rendered  # Takes seconds to load.

    weights = np.array(scene["photons_per_radiance"])
    pictures = {}
    for name, max_depth in depths.items():
        views = [rendered(folder, scene, view, max_depth, spp, number) @ weights for number, view in enumerate(scene["views"])]
        pictures[name] = squares(np.array(views)).astype(np.float32)
    if updates:
        record.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(record, asked=key, mitsuba=version, **pictures)
        return pictures, "found"
    if is_found and not all(np.allclose(known[name], picture, rtol=1e-4) for name, picture in pictures.items()):
        return pictures, "wrong"
    return pictures, "stale" if is_of_version and not is_found else "new"


def is_ours(name):
    """Whether we have rendered this comparison."""
    return (folder / f"{name}0.f32").exists()


def compared(name, theirs):
    """How far our pictures are from theirs, where these are lit."""
    width, height = scene["size"]
    lit = theirs > 0.0
    pictures = [np.fromfile(folder / f"{name}{number}.f32", dtype="<f4").reshape(height, width) for number in range(len(scene["views"]))]
    ours = squares(np.array(pictures, dtype=np.float64))
    error = np.abs(ours[lit] - theirs[lit]) / theirs[lit]
    bright = theirs[lit] > 0.3 * theirs.max()
    return {
        "mean_relative_error": float(error.mean()),
        "median_relative_error": float(np.median(error)),
        "bright_median_relative_error": float(np.median(error[bright])),
        "worst_relative_error": float(error.max()),
        "share_beyond_20_per_cent": float((error > 0.2).mean()),
        "ratio_of_means": float(ours.mean() / theirs.mean()),
    }


def main():
    comparisons = [(names, depth) for names, depth in ((["direct"], 2), (["full", "default"], -1)) if any(map(is_ours, names))]
    pictures, state = theirs_by_name({names[0]: depth for names, depth in comparisons})
    found = {"spp": spp, "pixels": 0, "mitsuba": version, "record": state}
    for names, _ in comparisons:
        theirs = pictures[names[0]].astype(np.float64)
        found.update({name: compared(name, theirs) for name in filter(is_ours, names)})
        found["pixels"] += int((theirs > 0.0).sum())
    print(json.dumps(found))


main()
