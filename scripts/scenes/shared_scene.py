"""A glTF scene of numpy arrays: meshes that several nodes share, colors of vertices, cameras, a spot light.

Enter: positions in meters, normals, linear colors 0…1, triangles wound counterclockwise as seen from outside. Leaves:
a binary glTF 2.0 file (Khronos 2021). Positions stay 32-bit floats: Bevy 0.19 does not read KHR_mesh_quantization.
"""
import math

import numpy as np

from make_desk_scene import Scene

FLOAT, BYTE, SHORT = 5126, 5121, 5123
VERTICES, INDICES = 34962, 34963
LIGHTS = "KHR_lights_punctual"


def turned(axis, degrees):
    """Rotation about an axis as a glTF quaternion."""
    half = math.radians(degrees) / 2
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return [*(math.sin(half) * axis), math.cos(half)]


def combined(*quaternions):
    """Rotations one after the other, the last one first."""
    x, y, z, w = quaternions[0]
    for a, b, c, d in quaternions[1:]:
        x, y, z, w = (w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a,
                      w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c)
    return [x, y, z, w]


def looking(eye, at):
    """Rotation of a camera or a lamp, which look along −Z."""
    back = np.subtract(eye, at) / np.linalg.norm(np.subtract(eye, at))
    yaw, pitch = math.degrees(math.atan2(back[0], back[2])), math.degrees(math.asin(back[1]))
    return combined(turned((0, 1, 0), yaw), turned((1, 0, 0), -pitch))


class SharedScene(Scene):
    def __init__(self, script, copyright_line):
        super().__init__()
        self.json["asset"] = {"version": "2.0", "generator": f"bevy_mirrorball {script}", "copyright": copyright_line}
        self.drawn_vertices = self.drawn_triangles = 0
        self.sizes = []

    def array(self, values, kind, component, target):
        """Adds an accessor; returns its number."""
        data = np.ascontiguousarray(values)
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": data.nbytes, "target": target}
        self.binary += data.tobytes()
        self.json["bufferViews"].append(view)
        number = len(self.json["bufferViews"]) - 1
        accessor = {"bufferView": number, "componentType": component, "count": len(data), "type": kind}
        if component == BYTE:
            accessor["normalized"] = True
        if kind == "VEC3":
            accessor["min"], accessor["max"] = data.min(0).tolist(), data.max(0).tolist()
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def mesh(self, name, positions, triangles, material, normals, colors=None, uvs=None):
        """Adds a mesh; returns its number."""
        if len(positions) > 65535:
            raise ValueError(f"mesh {name} has {len(positions)} vertices, more than 16 bits count: make two of it")
        attributes = {"POSITION": self.array(np.asarray(positions, "<f4"), "VEC3", FLOAT, VERTICES),
                      "NORMAL": self.array(np.asarray(normals, "<f4"), "VEC3", FLOAT, VERTICES)}
        if colors is not None:
            opaque = np.hstack([np.clip(colors, 0, 1), np.ones((len(colors), 1))])
            attributes["COLOR_0"] = self.array(np.rint(255 * opaque).astype(np.uint8), "VEC4", BYTE, VERTICES)
        if uvs is not None:
            attributes["TEXCOORD_0"] = self.array(np.asarray(uvs, "<f4"), "VEC2", FLOAT, VERTICES)
        indices = self.array(np.asarray(triangles, "<u2").reshape(-1), "SCALAR", SHORT, INDICES)
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        self.json["meshes"].append({"name": name, "primitives": [primitive]})
        self.sizes.append((len(positions), len(triangles)))
        return len(self.json["meshes"]) - 1

    def place(self, name, mesh=None, at=(0, 0, 0), turn=None, scale=None, **more):
        """Adds a node."""
        node = {"name": name, "translation": [round(float(x), 4) for x in at]}
        if mesh is not None:
            node["mesh"] = mesh
            self.drawn_vertices += self.sizes[mesh][0]
            self.drawn_triangles += self.sizes[mesh][1]
        if turn is not None:
            node["rotation"] = [float(x) for x in np.asarray(turn) / np.linalg.norm(turn)]
        if scale is not None:
            node["scale"] = [round(float(x), 4) for x in scale]
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]))
        self.json["nodes"].append({**node, **more})

    def camera(self, name, eye, at, vertical_degrees):
        cameras = self.json.setdefault("cameras", [])
        lens = {"yfov": math.radians(vertical_degrees), "znear": 0.1, "zfar": 1000.0}
        cameras.append({"name": name, "type": "perspective", "perspective": lens})
        self.place(name, at=eye, turn=looking(eye, at), camera=len(cameras) - 1)

    def spot(self, name, eye, at, candela, color, cone_degrees):
        """Adds a spot light. The cone is the half angle outside and inside the soft edge. The light has no range, which
        Bevy 0.19 would take for the radius of the lamp, too."""
        outer, inner = map(math.radians, cone_degrees)
        light = {"name": name, "type": "spot", "intensity": candela, "color": list(color),
                 "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}
        self.json["extensionsUsed"] = [LIGHTS]
        self.json["extensions"] = {LIGHTS: {"lights": [light]}}
        self.place(name, at=eye, turn=looking(eye, at), extensions={LIGHTS: {"light": 0}})

    def texture(self, name, png):
        """Adds the one texture, an embedded PNG that repeats; returns its number."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(png)})
        self.binary += png
        view = len(self.json["bufferViews"]) - 1
        self.json["images"] = [{"name": name, "mimeType": "image/png", "bufferView": view}]
        self.json["samplers"] = [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}]
        self.json["textures"] = [{"name": name, "source": 0, "sampler": 0}]
        return 0

    def summary(self):
        """What all nodes together draw, in words."""
        return f"draws {self.drawn_vertices} vertices, {self.drawn_triangles} triangles"
