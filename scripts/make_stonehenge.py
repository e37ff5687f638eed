#!/usr/bin/env python3
"""Writes stonehenge.glb, the monument as it stands today, and stonehenge_sky.hdr, a sky with a low sun around it.

usage: scripts/make_stonehenge.py [FOLDER]

All lengths in meters, true to scale: the dancer, 1.7 m tall, stands at the origin and faces −Z; +Y is up. The node
`sun` is turned like a directional light: its −Z is the direction of the sunlight. The candela of the spot light go
with a sky whose radiance of 1 is 150 cd/m². Needs Python 3 and numpy.
"""
import math
import os
import struct
import sys
import zlib

import numpy as np

from scenes.henge_plan import all_stones
from scenes.low_sun_sky import write_sky
from scenes.meadow import ground_height, meadow, tree_line, tuft, wear_at
from scenes.noise import fractal_noise
from scenes.rocks import rock, weathered
from scenes.shared_scene import SharedScene, combined, looking, turned

# Of the sun: clockwise from −Z as seen from above, and above the horizon, in degrees.
SUN_AZIMUTH, SUN_HEIGHT = 180.2, 8.5
SKY_WIDTH = 640
# Rocks: size in meters, spacing of vertices, number of variants, what they are made for (see scenes/rocks.py).
ROCKS = {
    "upright": ((2.1, 4.8, 1.1), 0.135, 3, {}),
    "lintel": ((3.3, 0.8, 1.05), 0.115, 2, {"taper": 0, "chips": 8, "wear": 0.14, "bow_radius": 15.4}),
    "trilithon": ((2.2, 6.2, 1.2), 0.13, 3, {"taper": 0.16, "chips": 20}),
    "trilithon lintel": ((4.9, 1.0, 1.3), 0.13, 1, {"taper": -0.1, "chips": 9, "wear": 0.16}),
    "fallen": ((3.9, 0.9, 2.0), 0.145, 3, {"taper": 0.1, "chips": 18}),
    "bluestone": ((0.75, 1.9, 0.6), 0.095, 3, {"taper": 0.3, "wear": 0.12}),
}
# Part of the height of standing stones that is in the ground, and how deep lying ones have sunk in, in meters.
FOOT, SUNK = 0.13, 0.16
# Tufts: how many, up to which distance from the center, and for each kind the blades, the spread and the height.
TUFTS, TUFT_REACH = 360, 16.0
TUFT_KINDS = ((100, 1.1, 0.19), (110, 1.5, 0.14), (70, 0.6, 0.28))
# Pixels of the grain along each side, and what it covers of a stone and of the turf, in meters.
GRAIN, GRAIN_METERS, TURF_METERS = 256, 2.0, 1.1


def png(gray):
    """A square gray image as a PNG file."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">2I5B", *gray.shape[::-1], 8, 0, 0, 0, 0)
    rows = b"".join(b"\0" + row.tobytes() for row in gray)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def grain():
    """Grain of the stone, gray, that repeats in both directions."""
    cells = 12
    u, v = (grid.ravel() / GRAIN * cells for grid in np.mgrid[0:GRAIN, 0:GRAIN])
    rough = fractal_noise(np.stack([u, v, 0 * u + 0.5], 1), 80, 5, cells)
    return np.rint(np.clip(212 + 58 * rough, 110, 255)).astype(np.uint8).reshape(GRAIN, GRAIN)


def add_rocks(scene, material):
    """Adds the meshes; returns their numbers and sizes by kind."""
    meshes = {}
    for kind, (size, spacing, variants, options) in ROCKS.items():
        for variant in range(variants):
            seed = 10 * len(meshes) + variant + 1
            points, triangles, normals = rock(size, spacing, seed, **options)
            is_high = kind.endswith("lintel")
            damp_height = -1.0 if is_high else 0.3 if kind == "fallen" else 1.1
            colors = weathered(points, triangles, normals, seed, damp_height)
            # One linear map for all sides of a box: none of the three planes is seen edge on.
            x, y, z = points.T / GRAIN_METERS
            uvs = np.stack([x + z, y + 0.4 * (x - z)], 1)
            number = scene.mesh(f"{kind} {variant}", points, triangles, material, normals, colors, uvs)
            meshes.setdefault(kind, []).append(number)
    return meshes


def is_on_ground(stone):
    return not stone.kind.endswith("lintel")


def add_stones(scene, stones, meshes):
    for order, stone in enumerate(stones):
        variants = meshes[stone.kind]
        scale = np.divide(stone.size, ROCKS[stone.kind][0])
        x, y, z = stone.at
        is_lying = stone.kind == "fallen"
        if is_on_ground(stone):
            foot = SUNK * scale[1] if is_lying else FOOT * stone.size[1] / (1 - FOOT)
            y = (float(ground_height(x, z)) if is_lying else 0.0) - foot
            scale[1] *= 1 if is_lying else 1 / (1 - FOOT)
        # Every second one shows its other side.
        turn = turned((0, 1, 0), stone.turn + 180 * (order // len(variants) % 2) * (stone.kind != "lintel"))
        lean = turned((1, 0, 0.4), stone.lean + (4 * math.sin(order) if is_lying else 0))
        scene.place(stone.name, variants[order % len(variants)], (x, y, z), combined(turn, lean), scale)


def add_tufts(scene, stones, material):
    """Scatters grass over the meadow, more of it at the feet of stones, none where the ground is worn."""
    random = np.random.default_rng(4)
    kinds = []
    for seed, (blades, spread, height) in enumerate(TUFT_KINDS, 1):
        points, triangles, normals, colors = tuft(blades, spread, height, seed)
        kinds.append(scene.mesh(f"tuft {seed}", points, triangles, material, normals, colors))
    feet = [stone for stone in stones if is_on_ground(stone) and math.hypot(stone.at[0], stone.at[2]) < TUFT_REACH]
    placed = 0
    while placed < TUFTS:
        angle = random.uniform(0, 2 * math.pi)
        if random.uniform() < 0.5:
            stone = feet[random.integers(len(feet))]
            turn, reach = math.radians(stone.turn), random.uniform(0.9, 1.15)
            u = reach * (stone.size[0] / 2 + 0.1) * math.cos(angle)
            v = reach * (stone.size[2] / 2 + 0.1) * math.sin(angle)
            x = stone.at[0] + u * math.cos(turn) + v * math.sin(turn)
            z = stone.at[2] - u * math.sin(turn) + v * math.cos(turn)
        else:
            radius = TUFT_REACH * random.uniform() ** 0.75
            x, z = radius * math.cos(angle), radius * math.sin(angle)
        if wear_at(np.array([x]), np.array([z]))[0] > 0.6:
            continue
        size = random.uniform(0.7, 1.3)
        at = (x, float(ground_height(x, z)), z)
        turn = turned((0, 1, 0), random.uniform(0, 360))
        scene.place(f"grass {placed + 1}", kinds[placed % len(kinds)], at, turn, (size, size, size))
        placed += 1


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else "assets/scenes"
    os.makedirs(folder, exist_ok=True)
    scene = SharedScene("scripts/make_stonehenge.py", "MIT OR Apache-2.0, the authors of bevy_mirrorball")
    stone = scene.material("weathered sarsen", (1, 1, 1), 0, 0.92)
    texture = scene.texture("grain of sarsen", png(grain()))
    grass = scene.material("blades of grass", (1, 1, 1), 0, 0.95)
    turf = scene.material("turf", (1, 1, 1), 0, 0.95)
    for material in (stone, turf):
        scene.json["materials"][material]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": texture}
    stones = all_stones()
    feet = [(s.at[0], s.at[2], 0.35 * (s.size[0] + s.size[2])) for s in stones if is_on_ground(s)]
    points, triangles, normals, colors, meters = meadow(feet)
    scene.place("meadow", scene.mesh("meadow", points, triangles, turf, normals, colors, meters / TURF_METERS))
    trees = scene.material("far trees", (0.055, 0.058, 0.062), 0, 1)
    points, triangles, normals = tree_line()
    scene.place("tree line", scene.mesh("tree line", points, triangles, trees, normals))
    add_stones(scene, stones, add_rocks(scene, stone))
    add_tufts(scene, stones, grass)
    azimuth, height = math.radians(SUN_AZIMUTH), math.radians(SUN_HEIGHT)
    to_sun = (math.sin(azimuth) * math.cos(height), math.sin(height), -math.cos(azimuth) * math.cos(height))
    scene.place("sun", at=np.multiply(60, to_sun), turn=looking(to_sun, (0, 0, 0)))
    scene.spot("moody spot", (3.2, 8.5, -12.5), (-0.6, 2.2, 2.0), 90000, (1.0, 0.80, 0.58), (30, 14))
    scene.camera("camera_wide", (1.3, 1.2, -5.5), (0.0, 2.1, 0), 55)
    scene.camera("camera_close", (0.6, 1.3, -4.6), (0, 1.35, 0), 40)
    path = f"{folder}/stonehenge.glb"
    scene.write(path)
    sky = f"{folder}/stonehenge_sky.hdr"
    write_sky(sky, SKY_WIDTH, to_sun)
    print(f"make_stonehenge: {path} has {len(stones)} stones; {scene.summary()}; {os.path.getsize(path)} bytes")
    print(f"make_stonehenge: {sky} has {os.path.getsize(sky)} bytes; the sun is towards {np.round(to_sun, 3).tolist()}")


if __name__ == "__main__":
    main()
