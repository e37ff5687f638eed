"""Writes meshes, a skin, and animations as binary glTF 2.0 (Khronos Group, 2021). Lengths are in meters."""
import numpy as np

from make_desk_scene import Scene

FLOAT, BYTE, SHORT = 5126, 5121, 5123
VERTEX_DATA, INDEX_DATA = 34962, 34963
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Glb:
    def __init__(self, asset):
        self.binary = bytearray()
        self.json = {"asset": {"version": "2.0", **asset}, "scene": 0, "scenes": [{"nodes": []}]}

    def add(self, kind, item):
        """Appends to a list of the file and returns its number there."""
        self.json.setdefault(kind, []).append(item)
        return len(self.json[kind]) - 1

    def accessor(self, rows, component, target=None, with_bounds=False):
        """Numbers of an array (n,) or (n, k), every row at a multiple of four bytes where there is a stride."""
        rows = np.ascontiguousarray(rows, {FLOAT: "<f4", BYTE: "u1", SHORT: "<u2"}[component])
        data = rows.tobytes()
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if target:
            view["target"] = target
        self.binary += data + b"\0" * (-len(data) % 4)
        accessor = {
            "bufferView": self.add("bufferViews", view), "componentType": component, "count": len(rows),
            "type": KINDS[rows.shape[1] if rows.ndim > 1 else 1],
        }
        if with_bounds:
            # As they are after rounding to 32 bits.
            accessor["min"] = np.atleast_1d(rows.min(axis=0)).tolist()
            accessor["max"] = np.atleast_1d(rows.max(axis=0)).tolist()
        return self.add("accessors", accessor)

    def material(self, name, color, roughness):
        """A dielectric of linear color (red, green, blue, gloss map)."""
        factors = {"baseColorFactor": color, "metallicFactor": 0, "roughnessFactor": roughness}
        return self.add("materials", {"name": name, "pbrMetallicRoughness": factors})

    def primitive(self, positions, normals, joints, weights, triangles, material):
        attributes = {
            "POSITION": self.accessor(positions, FLOAT, VERTEX_DATA, with_bounds=True),
            "NORMAL": self.accessor(normals, FLOAT, VERTEX_DATA),
            "JOINTS_0": self.accessor(joints, BYTE, VERTEX_DATA),
            "WEIGHTS_0": self.accessor(weights, FLOAT, VERTEX_DATA),
        }
        indices = self.accessor(np.asarray(triangles).reshape(-1), SHORT, INDEX_DATA)
        return {"attributes": attributes, "indices": indices, "material": material}

    def animation(self, name, times, translations, rotations):
        """Linear keys at times in seconds: by node, its translations (n, 3) and its rotations (n, 4) as x, y, z, w."""
        moment = self.accessor(times, FLOAT, with_bounds=True)
        channels, samplers = [], []
        for path, tracks in (("translation", translations), ("rotation", rotations)):
            for node, keys in tracks.items():
                samplers.append({"input": moment, "output": self.accessor(keys, FLOAT), "interpolation": "LINEAR"})
                channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
        self.add("animations", {"name": name, "channels": channels, "samplers": samplers})

    # the container is the same for all scenes
    write = Scene.write
