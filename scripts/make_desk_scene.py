#!/usr/bin/env python3
"""Writes assets/desk/bare_set.glb: a real desk with marker and ball as phantoms; set.glb: the desk of assets/desk/photo.jpg, on
which a box and a can stand too; and desk.glb: the same with a few virtual things on it.

usage: scripts/make_desk_scene.py [FOLDER]

Shows what a scene has to say: node extras named like the crate's components. All lengths in metres, in the frame of the
printed marker (+X right, +Y out of the paper, +Z to its bottom edge). Needs nothing but Python 3.
"""
import json
import math
import struct
import sys


def revolve(profile, segments):
    """Surface of revolution about +Y from (radius, height, normal radius, normal height) rows, from bottom to top."""
    positions, normals, indices = [], [], []
    for radius, height, nr, nh in profile:
        for s in range(segments + 1):
            c, d = math.cos(2 * math.pi * s / segments), math.sin(2 * math.pi * s / segments)
            positions.append((radius * c, height, radius * d))
            normals.append((nr * c, nh, nr * d))
    row = segments + 1
    for r in range(len(profile) - 1):
        for s in range(segments):
            a, b, c, d = r * row + s, r * row + s + 1, (r + 1) * row + s, (r + 1) * row + s + 1
            indices += [a, c, b, b, c, d]
    return positions, normals, indices


def sphere(radius, rings=32, segments=64):
    rows = [-math.pi / 2 + math.pi * r / rings for r in range(rings + 1)]
    return revolve([(radius * math.cos(t), radius * math.sin(t), math.cos(t), math.sin(t)) for t in rows], segments)


def torus(radius, tube, rings=32, segments=64):
    rows = [-math.pi / 2 + 2 * math.pi * r / rings for r in range(rings + 1)]
    return revolve(
        [(radius + tube * math.cos(t), tube * math.sin(t), math.cos(t), math.sin(t)) for t in rows], segments
    )


def cylinder(radius, height, segments=64):
    h = height / 2
    profile = [(0, -h, 0, -1), (radius, -h, 0, -1), (radius, -h, 1, 0), (radius, h, 1, 0), (radius, h, 0, 1), (0, h, 0, 1)]
    return revolve(profile, segments)


def box(x, y, z):
    positions, normals, indices = [], [], []
    for axis in range(3):
        for sign in (-1, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            start = len(positions)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = [0.0, 0.0, 0.0]
                p[axis], p[u], p[v] = sign, a, b
                positions.append((p[0] * x / 2, p[1] * y / 2, p[2] * z / 2))
                normals.append(tuple(float(sign) if i == axis else 0.0 for i in range(3)))
            quad = [0, 1, 2, 0, 2, 3] if sign > 0 else [0, 2, 1, 0, 3, 2]
            indices += [start + i for i in quad]
    return positions, normals, indices


class Scene:
    def __init__(self):
        self.binary = bytearray()
        self.json = {
            "asset": {"version": "2.0", "generator": "bevy_mirrorball scripts/make_desk_scene.py"},
            "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "materials": [],
            "accessors": [], "bufferViews": [],
        }

    def accessor(self, rows, kind, component, pack):
        data = b"".join(struct.pack(pack, *row) for row in rows)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary += data
        self.json["bufferViews"].append(view)
        accessor = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component,
                    "count": len(rows), "type": kind}
        if kind == "VEC3":
            accessor["min"] = [min(r[i] for r in rows) for i in range(3)]
            accessor["max"] = [max(r[i] for r in rows) for i in range(3)]
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def material(self, name, color, metallic, roughness):
        self.json["materials"].append({"name": name, "pbrMetallicRoughness": {
            "baseColorFactor": [*color, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}})
        return len(self.json["materials"]) - 1

    def node(self, name, shape=None, material=None, at=(0, 0, 0), turn=None, extras=None):
        node = {"name": name, "translation": list(at)}
        if shape:
            positions, normals, indices = shape
            attributes = {"POSITION": self.accessor(positions, "VEC3", 5126, "<3f"),
                          "NORMAL": self.accessor(normals, "VEC3", 5126, "<3f")}
            primitive = {"attributes": attributes,
                         "indices": self.accessor([(i,) for i in indices], "SCALAR", 5125, "<I"), "material": material}
            self.json["meshes"].append({"name": name, "primitives": [primitive]})
            node["mesh"] = len(self.json["meshes"]) - 1
        if turn:
            axis, degrees = turn
            half = math.radians(degrees) / 2
            node["rotation"] = [math.sin(half) if a == axis else 0.0 for a in "xyz"] + [math.cos(half)]
        if extras:
            node["extras"] = extras
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]))
        self.json["nodes"].append(node)

    def write(self, path):
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        total = 12 + 8 + len(text) + 8 + len(data)
        with open(path, "wb") as out:
            out.write(struct.pack("<4sII", b"glTF", 2, total))
            out.write(struct.pack("<I4s", len(text), b"JSON") + text)
            out.write(struct.pack("<I4s", len(data), b"BIN\0") + data)


def bare_desk():
    """What is really there, on a desk with nothing but marker and ball: stand-ins."""
    scene = Scene()
    real = scene.material("real", (1, 1, 1), 0, 1)
    scene.node("marker", extras={"MarkerAnchor": {"id": 0, "size": 0.1}, "WorldOrigin": {}})
    scene.node("ball", at=(0.17, 0.05, 0.01), extras={"LightProbeSphere": {"radius": 0.05, "reflectance": 0.9}})
    scene.node("dome", extras={"ShadowDomeLight": {"directions": 64}})
    scene.node("desk", box(1.6, 0.02, 1.2), real, (0, -0.01, 0), extras={"PhantomObject": {"casts": False}})
    scene.node("real ball", sphere(0.05), real, (0.17, 0.05, 0.01), extras={"PhantomObject": {"receives": False}})
    return scene, real


def real_desk():
    """The desk of the photograph and the clip, with a box and a can on it."""
    scene, real = bare_desk()
    scene.node("real box", box(0.12, 0.06, 0.07), real, (-0.08, 0.03, 0.19), ("y", 25), {"PhantomObject": {}})
    scene.node("real can", cylinder(0.03, 0.09), real, (-0.285, 0.045, -0.1), extras={"PhantomObject": {}})
    return scene


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else "assets/desk"
    bare_desk()[0].write(f"{folder}/bare_set.glb")
    real_desk().write(f"{folder}/set.glb")
    scene = real_desk()
    white = scene.material("matte white", (0.8, 0.8, 0.8), 0, 0.9)
    gold = scene.material("gold", (0.95, 0.78, 0.45), 1, 0.2)
    red = scene.material("red lacquer", (0.6, 0.05, 0.04), 0, 0.25)
    scene.node("white ball", sphere(0.045), white, (-0.1, 0.045, -0.06))
    scene.node("gold ball", sphere(0.04), gold, (-0.205, 0.04, 0.03))
    scene.node("red ring", torus(0.035, 0.012), red, (0.03, 0.047, 0.12), ("x", 80))
    scene.write(f"{folder}/desk.glb")


if __name__ == "__main__":
    main()
