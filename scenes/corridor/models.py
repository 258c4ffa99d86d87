#!/usr/bin/env python3
"""Makes walker.glb, corridor.glb and ../fan/fan.glb. Needs numpy and Pillow; the files that it makes are part of the repository.

Everything is made here from numbers, pictures too, and is in the public domain (CC0).
"""

import io
import json
import math
import pathlib
import struct

import numpy
from PIL import Image

FLOAT, UINT = 5126, 5125
HERE = pathlib.Path(__file__).resolve().parent


class Gltf:
    """A binary glTF file in the making."""

    def __init__(self):
        self.binary = bytearray()
        self.json = {"asset": {"version": "2.0", "generator": "sensel scenes/corridor/models.py"}, "scene": 0}
        for name in ("scenes", "nodes", "meshes", "materials", "accessors", "bufferViews", "images", "textures", "samplers", "animations"):
            self.json[name] = []
        self.json["samplers"].append({})

    def view(self, data):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values, kind, component=FLOAT):
        values = numpy.ascontiguousarray(values, numpy.float32 if component == FLOAT else numpy.uint32)
        flat = values.reshape(len(values), -1)
        entry = {"bufferView": self.view(values.tobytes()), "componentType": component, "count": len(values), "type": kind}
        if component == FLOAT:
            entry |= {"min": flat.min(0).tolist(), "max": flat.max(0).tolist()}
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def material(self, name, colour=(1, 1, 1), picture=None, emission=None):
        surface = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}
        if picture is not None:
            out = io.BytesIO()
            Image.fromarray(picture).save(out, "PNG", optimize=True)
            self.json["images"].append({"bufferView": self.view(out.getvalue()), "mimeType": "image/png"})
            self.json["textures"].append({"source": len(self.json["images"]) - 1, "sampler": 0})
            surface["baseColorTexture"] = {"index": len(self.json["textures"]) - 1}
        entry = {"name": name, "pbrMetallicRoughness": surface}
        if emission is not None:
            entry["emissiveFactor"] = list(emission)
        self.json["materials"].append(entry)
        return len(self.json["materials"]) - 1

    def mesh(self, name, parts):
        primitives = []
        for material, (positions, normals, uvs, triangles) in parts:
            corners = positions[numpy.asarray(triangles)]
            areas = numpy.linalg.norm(numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
            triangles = numpy.asarray(triangles)[areas > 1e-9]
            primitives.append({
                "attributes": {
                    "POSITION": self.accessor(positions, "VEC3"),
                    "NORMAL": self.accessor(normals, "VEC3"),
                    "TEXCOORD_0": self.accessor(uvs, "VEC2"),
                },
                "indices": self.accessor(numpy.asarray(triangles).reshape(-1, 1), "SCALAR", UINT),
                "material": material,
            })
        self.json["meshes"].append({"name": name, "primitives": primitives})
        return len(self.json["meshes"]) - 1

    def node(self, **keys):
        self.json["nodes"].append(keys)
        return len(self.json["nodes"]) - 1

    def turns(self, name, tracks):
        """An animation of rotations about x or z, one node each: (node, axis, times in s, angles in rad)."""
        channels, samplers = [], []
        for node, axis, times_s, angles_rad in tracks:
            turns = numpy.zeros((len(times_s), 4))
            turns[:, "xyz".index(axis)] = numpy.sin(numpy.asarray(angles_rad) / 2)
            turns[:, 3] = numpy.cos(numpy.asarray(angles_rad) / 2)
            samplers.append({
                "input": self.accessor(numpy.asarray(times_s).reshape(-1, 1), "SCALAR"),
                "output": self.accessor(turns, "VEC4"),
                "interpolation": "LINEAR",
            })
            channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": "rotation"}})
        self.json["animations"].append({"name": name, "channels": channels, "samplers": samplers})

    def save(self, path, roots):
        self.json["scenes"].append({"nodes": roots})
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps({key: value for key, value in self.json.items() if value != []}, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def turned(profile, sides=16, tile=(2.0, 2.0), squeeze=1.0):
    """A surface of revolution about y through (radius, height) pairs from below; `squeeze` flattens it along z."""
    profile = numpy.asarray(profile, float)
    positions, normals, uvs, triangles = [], [], [], []
    slopes = numpy.gradient(profile, axis=0)
    for (radius, height), (dr, dh) in zip(profile, slopes):
        for side in range(sides + 1):
            angle = 2 * math.pi * side / sides
            cosine, sine = math.cos(angle), math.sin(angle)
            normal = numpy.array([dh * cosine, -dr, dh * sine / squeeze])
            positions.append([radius * cosine, height, squeeze * radius * sine])
            normals.append(normal / max(numpy.linalg.norm(normal), 1e-9))
            uvs.append([tile[0] * side / sides, tile[1] * (1 - height)])
    across = sides + 1
    for ring in range(len(profile) - 1):
        for side in range(sides):
            a = ring * across + side
            triangles += [[a, a + across, a + 1], [a + 1, a + across, a + across + 1]]
    return numpy.array(positions), numpy.array(normals), numpy.array(uvs), triangles


def ball(radius, middle, stretch=1.0, sides=16):
    profile = [(radius * math.sin(math.pi * k / 10), -stretch * radius * math.cos(math.pi * k / 10)) for k in range(11)]
    positions, normals, uvs, triangles = turned(profile, sides)
    return positions + numpy.array(middle), normals, uvs, triangles


def limb(top, bottom, radii):
    """A tapered limb with round ends that hangs from height `top` down to `bottom`."""
    upper, lower = radii
    profile = [(0.0, bottom - lower), (0.7 * lower, bottom - 0.7 * lower)]
    steps = 6
    profile += [(lower + (upper - lower) * k / steps, bottom + (top - bottom) * k / steps) for k in range(steps + 1)]
    profile += [(0.7 * upper, top + 0.7 * upper), (0.0, top + upper)]
    return turned(profile, 12)


def box(low, high, tile_m=1.0):
    low, high = numpy.asarray(low, float), numpy.asarray(high, float)
    positions, normals, uvs, triangles = [], [], [], []
    for axis in range(3):
        u, v = [(2, 1), (0, 2), (0, 1)][axis]
        for side in (0, 1):
            base = len(positions)
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = numpy.array([low[0], low[1], low[2]])
                corner[axis] = (low, high)[side][axis]
                corner[u] = (low, high)[a][u]
                corner[v] = (low, high)[b][v]
                positions.append(corner)
                normals.append([float((1 if side else -1) * (axis == k)) for k in range(3)])
                uvs.append([corner[u] / tile_m, -corner[v] / tile_m])
            triangles += [[base, base + 1, base + 2], [base, base + 2, base + 3]]
    positions, normals = numpy.array(positions), numpy.array(normals)
    # Front faces are counter-clockwise.
    for number, (a, b, c) in enumerate(triangles):
        if numpy.dot(numpy.cross(positions[b] - positions[a], positions[c] - positions[a]), normals[a]) < 0:
            triangles[number] = [a, c, b]
    return positions, normals, numpy.array(uvs), triangles


def grain(seed, size, base, contrast, coarse=8):
    """Noise of several octaves about a colour, seamless."""
    random = numpy.random.default_rng(seed)
    field = numpy.zeros((size, size))
    cells = coarse
    weight = 1.0
    while cells <= size:
        grid = random.normal(size=(cells, cells))
        field += weight * numpy.kron(grid, numpy.ones((size // cells, size // cells)))
        cells, weight = cells * 4, weight * 0.6
    field /= field.std()
    return numpy.clip(numpy.asarray(base, float) + contrast * field[..., None], 0, 255).astype(numpy.uint8)


def plaid(seed, colours, size=64):
    random = numpy.random.default_rng(seed)
    first, second, line = (numpy.asarray(colour, float) for colour in colours)
    stripes = (numpy.arange(size) // 8) % 2
    picture = numpy.where((stripes[:, None] + stripes[None, :])[..., None] == 1, first, 0.5 * (first + second))
    picture = numpy.where((stripes[:, None] * stripes[None, :])[..., None] == 1, second, picture)
    lines = (numpy.arange(size) % 16) == 3
    picture[lines], picture[:, lines] = line, line
    return numpy.clip(picture + random.normal(0, 5, (size, size, 1)), 0, 255).astype(numpy.uint8)


def walker():
    """A figure of 1.75 m that walks on the spot: two steps a second, legs and arms swing. It looks along +z."""
    file = Gltf()
    shirt = file.material("shirt", picture=plaid(1, [(170, 40, 40), (40, 50, 90), (225, 215, 190)]))
    jeans = file.material("jeans", picture=grain(2, 64, (60, 75, 110), 14))
    skin = file.material("skin", (0.68, 0.48, 0.38))
    hair = file.material("hair", picture=grain(3, 32, (50, 36, 28), 12))
    shoe = file.material("shoes", (0.10, 0.09, 0.09))
    bag = file.material("bag", picture=grain(4, 32, (150, 130, 70), 26, 4))
    torso = turned([(0.0, 0.84), (0.13, 0.86), (0.16, 0.95), (0.15, 1.08), (0.185, 1.28), (0.19, 1.40), (0.12, 1.47), (0.055, 1.50)],
                   20, squeeze=0.62)
    neck = turned([(0.055, 1.44), (0.052, 1.56)], 12)
    parts = [(shirt, torso), (skin, neck), (skin, ball(0.098, (0, 1.63, 0.01), 1.22)), (hair, ball(0.103, (0, 1.665, -0.018), 1.05))]
    parts.append((bag, box((-0.15, 1.0, -0.27), (0.15, 1.40, -0.12), 0.4)))
    body = file.node(name="body", mesh=file.mesh("body", parts))
    leg = file.mesh("leg", [(jeans, limb(-0.02, -0.78, (0.085, 0.055))), (shoe, box((-0.045, -0.88, -0.08), (0.045, -0.79, 0.18)))])
    arm = file.mesh("arm", [(shirt, limb(-0.02, -0.34, (0.055, 0.042))), (skin, limb(-0.40, -0.60, (0.038, 0.030)))])
    limbs = [(leg, -0.09, 0.88, 0.0, 0.42), (leg, 0.09, 0.88, math.pi, 0.42), (arm, -0.225, 1.40, math.pi, 0.36), (arm, 0.225, 1.40, 0.0, 0.36)]
    times_s = numpy.linspace(0.0, 1.0, 17)
    roots, tracks = [body], []
    for name, (mesh, x, y, phase, swing) in zip(("right leg", "left leg", "right arm", "left arm"), limbs):
        roots.append(file.node(name=name, mesh=mesh, translation=[x, y, 0.0]))
        tracks.append((roots[-1], "x", times_s, swing * numpy.sin(2 * math.pi * times_s + phase)))
    file.turns("walk", tracks)
    file.save(HERE / "walker.glb", roots)


def corridor():
    """A corridor of 2.6 by 24 m, 2.7 m high, with doors, notice boards and a window at its end; the floor at 0, its axis along z."""
    file = Gltf()
    plaster = file.material("plaster", picture=grain(11, 128, (208, 202, 188), 9, 8))
    skirting = file.material("skirting", (0.22, 0.20, 0.18))
    random = numpy.random.default_rng(12)
    tiles = numpy.kron(random.integers(105, 165, (8, 8, 1)), numpy.ones((16, 16, 1))).repeat(3, 2) + random.normal(0, 6, (128, 128, 1))
    tiles[::16], tiles[:, ::16] = 70, 70
    floor = file.material("floor", picture=numpy.clip(tiles, 0, 255).astype(numpy.uint8))
    ceiling = file.material("ceiling", picture=grain(13, 128, (222, 222, 216), 6, 16))
    door = file.material("doors", picture=grain(14, 128, (122, 86, 52), 16, 4))
    frame = file.material("door frames", (0.45, 0.47, 0.50))
    panel = file.material("lamps", (0.0, 0.0, 0.0), emission=(1.0, 1.0, 0.96))
    notice = numpy.full((128, 192, 3), (120, 84, 58), float) + random.normal(0, 10, (128, 192, 1))
    for _ in range(14):
        y, x = random.integers(0, 92), random.integers(0, 150)
        height, width = random.integers(22, 36), random.integers(18, 40)
        notice[y:y + height, x:x + width] = random.integers(150, 255, 3)
        for line in range(y + 4, y + height - 3, 4):
            notice[line:line + 2, x + 3:x + width - random.integers(3, 12)] = random.integers(20, 90, 3)
    board = file.material("notices", picture=numpy.clip(notice, 0, 255).astype(numpy.uint8))
    half, length, high = 1.3, 24.0, 2.7
    walls = [(plaster, box((x, 0, -length), (x + 0.1, high, 0), 1.5)) for x in (-half - 0.1, half)]
    walls += [(plaster, box((-half, 0, end - 0.1), (half, high, end), 1.5)) for end in (-length, 0.1)]
    parts = walls + [(floor, box((-half, -0.1, -length), (half, 0, 0), 2.4)), (ceiling, box((-half, high, -length), (half, high + 0.1, 0), 1.2))]
    for side in (-1, 1):
        edge = sorted((side * (half - 0.015), side * half))
        parts.append((skirting, box((edge[0], 0, -length), (edge[1], 0.1, 0))))
        for number in range(5):
            middle = -2.6 - 4.6 * number - (1.1 if side > 0 else 0.0)
            inner = sorted((side * (half - 0.04), side * half))
            parts.append((door, box((inner[0], 0, middle - 0.45), (inner[1], 2.05, middle + 0.45), 0.9)))
            proud = sorted((side * (half - 0.06), side * half))
            for edge in (-0.53, 0.45):
                parts.append((frame, box((proud[0], 0, middle + edge), (proud[1], 2.05, middle + edge + 0.08))))
            parts.append((frame, box((proud[0], 2.05, middle - 0.53), (proud[1], 2.13, middle + 0.53))))
            flat = sorted((side * (half - 0.02), side * half))
            wall_board = box((flat[0], 1.15, middle + 1.0), (flat[1], 1.95, middle + 2.2))
            positions, normals, uvs, triangles = wall_board
            uvs = numpy.stack([(positions[:, 2] - middle - 1.0) / 1.2, 1 - (positions[:, 1] - 1.15) / 0.8], 1)
            parts.append((board, (positions, normals, uvs, triangles)))
    for number in range(6):
        z = -2.0 - 4.0 * number
        parts.append((panel, box((-0.3, high - 0.02, z - 0.6), (0.3, high - 0.005, z + 0.6))))
    file.save(HERE / "corridor.glb", [file.node(name="corridor", mesh=file.mesh("corridor", parts))])


def fan():
    """A fan on a stand: four blades that turn five times a second, seen from +z; one blade has another colour."""
    file = Gltf()
    metal = file.material("stand", (0.35, 0.36, 0.38))
    blade = file.material("blades", picture=plaid(21, [(210, 205, 190), (150, 160, 165), (60, 60, 60)]))
    marked = file.material("marked blade", (0.70, 0.08, 0.06))
    hub = file.material("hub", (0.12, 0.12, 0.13))
    stand = file.mesh("stand", [(metal, turned([(0.0, 0.0), (0.22, 0.0), (0.22, 0.03), (0.03, 0.05), (0.025, 1.16)], 20)),
                                (metal, ball(0.07, (0, 1.2, -0.06)))])
    parts = [(hub, ball(0.05, (0, 0, 0)))]
    for number in range(4):
        angle = math.pi / 2 * number
        corners = numpy.array([(0.04, -0.03, 0.01), (0.28, -0.09, 0.03), (0.30, 0.07, -0.03), (0.05, 0.03, -0.01)])
        cosine, sine = math.cos(angle), math.sin(angle)
        flat = numpy.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
        front = corners @ flat
        normal = numpy.cross(front[1] - front[0], front[3] - front[0])
        normal /= numpy.linalg.norm(normal)
        positions = numpy.concatenate([front + 0.004 * normal, front - 0.004 * normal])
        normals = numpy.array([normal] * 4 + [-normal] * 4)
        uvs = numpy.array([(0, 0), (1, 0), (1, 1), (0, 1)] * 2, float)
        triangles = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]
        parts.append((marked if number == 0 else blade, (positions, normals, uvs, triangles)))
    roots = [file.node(name="stand", mesh=stand), file.node(name="blades", mesh=file.mesh("blades", parts), translation=[0.0, 1.2, 0.05])]
    times_s = numpy.linspace(0.0, 0.2, 9)
    file.turns("turning", [(roots[1], "z", times_s, -2 * math.pi * times_s / 0.2)])
    (HERE.parent / "fan").mkdir(exist_ok=True)
    file.save(HERE.parent / "fan" / "fan.glb", roots)


if __name__ == "__main__":
    walker()
    corridor()
    fan()
