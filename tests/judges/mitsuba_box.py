#!/usr/bin/env python3
"""Renders an exported box room with Mitsuba 3 and compares pixels.

Takes a folder with scene.json (written by tests/light.rs): camera, faces, lamp, photons per radiance of each band, and raw
little-endian float32 files: textures (linear, the top row first) and our own pictures. Prints the mean relative error of the
direct light and of the light after all bounces as JSON. Nothing of ours but the scene's description goes into Mitsuba's picture.
"""

import json
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

folder = Path(sys.argv[1])
spp = int(sys.argv[2])
scene = json.loads((folder / "scene.json").read_text())


def floats(name, shape):
    return np.fromfile(folder / name, dtype="<f4").reshape(shape)


def quad(number, corners, uvs):
    """A PLY of two triangles."""
    lines = ["ply", "format ascii 1.0", "element vertex 4"]
    lines += [f"property float {name}" for name in "xyzuv"]
    lines += ["element face 2", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(repr(float(x)) for x in [*corner, *uv]) for corner, uv in zip(corners, uvs)]
    lines += ["3 0 1 2", "3 0 2 3"]
    path = folder / f"quad{number}.ply"
    path.write_text("\n".join(lines) + "\n")
    return {"type": "ply", "filename": str(path), "face_normals": True}


def pictured(texture):
    """Linear texels of a file, times a factor."""
    width, height = texture["size"]
    texels = floats(texture["file"], (height, width, 3)) * np.array(texture["factors"], dtype=np.float32)
    return mi.Bitmap(np.ascontiguousarray(texels))


def world():
    parts = {"type": "scene"}
    for number, face in enumerate(scene["faces"]):
        shape = quad(number, face["corners_m"], face["uvs"])
        if face.get("is_mirror"):
            colour = {"type": "rgb", "value": face["colour"]}
            shape["bsdf"] = {"type": "conductor", "material": "none", "specular_reflectance": colour}
        elif face["texture"] is None:
            shape["bsdf"] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": face["colour"]}}
        else:
            width, height = face["texture_size"]
            texels = floats(face["texture"], (height, width, 3)) * np.array(face["colour"], dtype=np.float32)
            bitmap = mi.Bitmap(np.ascontiguousarray(texels))
            texture = {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}
            shape["bsdf"] = {"type": "diffuse", "reflectance": texture}
        if face.get("normal_map"):
            normals = {"type": "bitmap", "bitmap": pictured(face["normal_map"]), "raw": True, "wrap_mode": "clamp"}
            shape["bsdf"] = {"type": "normalmap", "normalmap": normals, "bsdf": shape["bsdf"]}
        if face["two_sided"]:
            shape["bsdf"] = {"type": "twosided", "bsdf": shape["bsdf"]}
        if face.get("emission_map"):
            texels = {"type": "bitmap", "bitmap": pictured(face["emission_map"]), "raw": True, "wrap_mode": "clamp"}
            shape["emitter"] = {"type": "area", "radiance": texels}
        elif any(face["radiance"]):
            shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": face["radiance"]}}
        parts[f"face{number}"] = shape
    for number, light in enumerate(scene.get("lights", [])):
        if light["type"] == "sun":
            # A ball of the sun's width a kilometre away.
            sine = np.sin(light["radius_rad"])
            radiance = [float(e / (np.pi * sine * sine)) for e in light["irradiance"]]
            parts[f"light{number}"] = {
                "type": "sphere", "center": [1000.0 * x for x in light["towards"]], "radius": float(1000.0 * sine),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}}}
            continue
        emitter = {"type": light["type"], "intensity": {"type": "rgb", "value": light["intensity"]}}
        if light["type"] == "point":
            emitter["position"] = light["position_m"]
        else:
            emitter["to_world"] = mi.ScalarTransform4f().look_at(
                origin=light["position_m"], target=light["target_m"], up=[0.0, 0.0, 1.0])
            emitter["cutoff_angle"], emitter["beam_width"] = light["outer_deg"], light["inner_deg"]
        parts[f"light{number}"] = emitter
    return parts


def rendered(view, max_depth, seed):
    transform = mi.ScalarTransform4f().look_at(origin=view["origin_m"], target=view["target_m"], up=view["up"])
    width, height = scene["size"]
    parts = world()
    parts["sensor"] = {
        "type": "perspective",
        "fov": scene["horizontal_fov_deg"],
        "fov_axis": "x",
        "to_world": transform,
        "near_clip": 0.001,
        "film": {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb",
                 "component_format": "float32", "rfilter": {"type": "box"}},
        "sampler": {"type": "multijitter", "sample_count": spp},
    }
    # Paths end by chance from the eighth bounce on: without bias, and in a sixth of the time that fifty bounces take.
    parts["integrator"] = {"type": "path", "max_depth": max_depth, "rr_depth": 8}
    return np.array(mi.render(mi.load_dict(parts), spp=spp, seed=seed))


def squares(pictures):
    """Means over 2 by 2 pixels: an edge that falls a hundredth of a pixel apart, and noise, count less."""
    count, height, width = pictures.shape
    return pictures.reshape(count, height // 2, 2, width // 2, 2).mean(axis=(2, 4))


def main():
    width, height = scene["size"]
    weights = np.array(scene["photons_per_radiance"])
    found = {"spp": spp, "pixels": 0, "mitsuba": mi.__version__}
    for names, max_depth in ((["direct"], 2), (["full", "default"], -1)):
        if not any((folder / f"{name}0.f32").exists() for name in names):
            continue
        views = enumerate(scene["views"])
        theirs = np.array([rendered(view, max_depth, number) @ weights for number, view in views])
        theirs = squares(theirs)
        lit = theirs > 0.0
        for name in names:
            if not (folder / f"{name}0.f32").exists():
                continue
            pictures = [floats(f"{name}{number}.f32", (height, width)) for number in range(len(scene["views"]))]
            ours = squares(np.array(pictures, dtype=np.float64))
            error = np.abs(ours[lit] - theirs[lit]) / theirs[lit]
            bright = theirs[lit] > 0.3 * theirs.max()
            found[name] = {
                "mean_relative_error": float(error.mean()),
                "median_relative_error": float(np.median(error)),
                "bright_median_relative_error": float(np.median(error[bright])),
                "worst_relative_error": float(error.max()),
                "share_beyond_20_per_cent": float((error > 0.2).mean()),
                "ratio_of_means": float(ours.mean() / theirs.mean()),
            }
        found["pixels"] += int(lit.sum())
        np.save(folder / f"{names[0]}_mitsuba.npy", theirs)
    print(json.dumps(found))


main()
