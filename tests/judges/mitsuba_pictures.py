"""Pictures of an exported room by Mitsuba 3. Nothing of ours but the scene's description goes into them."""

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")


def floats(path, shape):
    """A raw little-endian float32 file."""
    return np.fromfile(path, dtype="<f4").reshape(shape)


def quad(folder, number, corners, uvs):
    """A PLY of two triangles."""
    lines = ["ply", "format ascii 1.0", "element vertex 4"]
    lines += [f"property float {name}" for name in "xyzuv"]
    lines += ["element face 2", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(repr(float(x)) for x in [*corner, *uv]) for corner, uv in zip(corners, uvs)]
    lines += ["3 0 1 2", "3 0 2 3"]
    path = folder / f"quad{number}.ply"
    path.write_text("\n".join(lines) + "\n")
    return {"type": "ply", "filename": str(path), "face_normals": True}


def pictured(folder, texture):
    """Linear texels of a file, times a factor."""
    width, height = texture["size"]
    texels = floats(folder / texture["file"], (height, width, 3)) * np.array(texture["factors"], dtype=np.float32)
    return mi.Bitmap(np.ascontiguousarray(texels))


def world(folder, scene):
    parts = {"type": "scene"}
    for number, face in enumerate(scene["faces"]):
        shape = quad(folder, number, face["corners_m"], face["uvs"])
        if face.get("is_mirror"):
            colour = {"type": "rgb", "value": face["colour"]}
            shape["bsdf"] = {"type": "conductor", "material": "none", "specular_reflectance": colour}
        elif face["texture"] is None:
            shape["bsdf"] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": face["colour"]}}
        else:
            width, height = face["texture_size"]
            texels = floats(folder / face["texture"], (height, width, 3)) * np.array(face["colour"], dtype=np.float32)
            bitmap = mi.Bitmap(np.ascontiguousarray(texels))
            texture = {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}
            shape["bsdf"] = {"type": "diffuse", "reflectance": texture}
        if face.get("normal_map"):
            normals = {"type": "bitmap", "bitmap": pictured(folder, face["normal_map"]), "raw": True, "wrap_mode": "clamp"}
            shape["bsdf"] = {"type": "normalmap", "normalmap": normals, "bsdf": shape["bsdf"]}
        if face["two_sided"]:
            shape["bsdf"] = {"type": "twosided", "bsdf": shape["bsdf"]}
        if face.get("emission_map"):
            texels = {"type": "bitmap", "bitmap": pictured(folder, face["emission_map"]), "raw": True, "wrap_mode": "clamp"}
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


def rendered(folder, scene, view, max_depth, spp, seed):
    """Red, green and blue radiance of each pixel of a view: after one bounce for a depth of 2, after all for -1."""
    transform = mi.ScalarTransform4f().look_at(origin=view["origin_m"], target=view["target_m"], up=view["up"])
    width, height = scene["size"]
    parts = world(folder, scene)
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
