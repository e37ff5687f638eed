"""Trees, bushes and clouds of the campus: round forms, which show bands of light and outlines best.

Enters: a scene and its material. Leaves: nodes `tree …`, `bush …` and `cloud …`, which share few meshes.
"""
import numpy as np

from scenes.campus_court import PAVING
from scenes.flat_shapes import Solids
from scenes.shared_scene import turned

# Linear colors.
BARK, CLOUD = (0.20, 0.10, 0.045), (0.92, 0.93, 0.95)
LEAVES = ((0.16, 0.40, 0.06), (0.28, 0.46, 0.06), (0.10, 0.30, 0.09))
# Places (x, z) and sizes.
TREES = (
    (12.5, 9.0, 1.1), (15.8, 4.4, 0.95), (12.2, -0.6, 1.0), (16.2, -5.6, 1.15),
    (-12.6, 8.8, 1.05), (-15.6, 3.6, 1.1), (-12.4, -1.4, 0.9), (-16.0, -6.2, 1.1),
    (27.5, 14.0, 1.3), (-27.0, 19.0, 1.3), (31.0, -12.0, 1.25), (-30.0, -17.0, 1.2),
)
BUSHES = ((10.4, -8.2), (-10.4, -8.2), (10.5, 11.2), (-10.5, 11.2))
# With their height as the second coordinate.
CLOUDS = ((20, 24, 60, 1.2), (-9, 28, 70, 1.5), (-44, 25, 60, 1.1), (52, 24, 56, 1.0))
# On the lawn, which is higher than the paving.
GROUND = PAVING + 0.2


def add_trees(scene, paint):
    kinds = [tree(color, seed).mesh(scene, f"tree {seed}", paint) for seed, color in enumerate(LEAVES)]
    for number, (x, z, size) in enumerate(TREES, 1):
        turn = turned((0, 1, 0), 67 * number)
        scene.place(f"tree {number}", kinds[number % len(kinds)], (x, GROUND, z), turn, (size, size, size))
    bush = bushes().mesh(scene, "bush", paint)
    for number, (x, z) in enumerate(BUSHES, 1):
        scene.place(f"bush {number}", bush, (x, GROUND, z), turned((0, 1, 0), 90 * number))
    puffs = cloud().mesh(scene, "cloud", paint)
    for number, (x, y, z, size) in enumerate(CLOUDS, 1):
        turn = turned((0, 1, 0), 180 * number)
        scene.place(f"cloud {number}", puffs, (x, y, z), turn, (size, size, size))


def tree(color, seed):
    solids = Solids()
    solids.cylinder(0.24, -0.2, 2.6, BARK, sides=14, top_radius=0.15)
    random = np.random.default_rng(seed + 20)
    solids.ball((1.75, 1.6, 1.75), color, (0, 4.0, 0), 18, 28, 0.12, seed)
    for part in range(4):
        angle = part * 1.57 + random.uniform(-0.3, 0.3)
        at = (1.15 * np.cos(angle), 3.4 + random.uniform(-0.2, 0.7), 1.15 * np.sin(angle))
        size = random.uniform(0.85, 1.15)
        solids.ball((size, 0.9 * size, size), color, at, 14, 22, 0.12, seed + part + 1)
    solids.ball((1.0, 0.95, 1.0), color, (0.2, 5.2, -0.1), 14, 22, 0.12, seed + 9)
    return solids


def bushes():
    solids = Solids()
    for part in range(3):
        radii, at = (0.75, 0.6 + 0.12 * part, 0.75), (part - 1, 0.4, 0.15 * part)
        solids.ball(radii, LEAVES[2], at, 12, 20, 0.12, part)
    return solids


def cloud():
    solids = Solids()
    random = np.random.default_rng(1)
    for part in range(6):
        x = (part - 2.5) * 3.0
        radius = 2.2 + 1.6 * np.exp(-((part - 2.5) / 1.6) ** 2) + random.uniform(-0.4, 0.4)
        solids.ball((1.25 * radius, 0.8 * radius, radius), CLOUD, (x, 0.5 * radius, 0), 12, 20, 0.05, part)
    return solids
