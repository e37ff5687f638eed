"""The court of the campus: paving, lawns, the round stage, stairs, benches, lamp posts and flags.

Enters: a scene and its material. Leaves: nodes with these names, in meters; the top of the stage is y = 0.
"""
import math

import numpy as np

from scenes.flat_shapes import Solids
from scenes.shared_scene import turned

# Linear colors.
STONE, STRIPE, PALE, DARK = (0.48, 0.45, 0.40), (0.38, 0.35, 0.31), (0.66, 0.64, 0.58), (0.055, 0.06, 0.07)
LAWN, KERB, WOOD, LAMP = (0.14, 0.34, 0.07), (0.56, 0.54, 0.50), (0.42, 0.20, 0.08), (0.95, 0.86, 0.55)
STAGE_COLORS = ((0.62, 0.10, 0.06), (0.80, 0.74, 0.62))
FLAGS = ((0.60, 0.06, 0.05), (0.06, 0.20, 0.48), (0.75, 0.48, 0.04))
# Height of the paving; the stage's top is y = 0.
PAVING = -0.3
# Half width and half depth of the paving.
WIDTH, DEPTH = 34.0, 30.0
STAGE_RADIUS, STEP = 3.4, 0.55
# Places (x, z); of benches the turn about +Y, too.
BENCHES = ((7.9, 1.0, 90), (7.9, 6.5, 90), (-7.9, 1.0, 90), (-7.9, 6.5, 90), (5.2, -7.0, 40))
LAMP_POSTS = ((8.2, -2.5), (-8.2, -2.5), (8.2, 4.0), (-8.2, 4.0), (8.2, 10.0), (-8.2, 10.0))


def add_court(scene, paint):
    paving().place(scene, "paving", paint)
    stage().place(scene, "stage", paint)
    for side, x in (("left", 14.5), ("right", -14.5)):
        lawn(x).place(scene, f"lawn {side}", paint)
    stairs().place(scene, "stairs", paint)
    bench_mesh = bench().mesh(scene, "bench", paint)
    for number, (x, z, turn) in enumerate(BENCHES, 1):
        scene.place(f"bench {number}", bench_mesh, (x, PAVING, z), turned((0, 1, 0), turn))
    lamp_mesh = lamp_post().mesh(scene, "lamp post", paint)
    for number, (x, z) in enumerate(LAMP_POSTS, 1):
        scene.place(f"lamp post {number}", lamp_mesh, (x, PAVING, z))
    for number, color in enumerate(FLAGS, 1):
        flag_mesh = flag(color).mesh(scene, f"flag {number}", paint)
        scene.place(f"flag {number}", flag_mesh, (-9.2 - 1.6 * number, PAVING, 13.5))


def paving():
    solids = Solids()
    solids.box((-WIDTH, PAVING - 0.6, -DEPTH), (WIDTH, PAVING - 0.02, DEPTH), STRIPE)
    # slabs with joints between them
    size = 2.0
    for column in range(-4, 4):
        for row in range(-10, 8):
            x, z = column * size, row * size
            color = PALE if (column + row) % 5 == 0 else STONE
            solids.box((x + 0.03, PAVING - 0.3, z + 0.03), (x + size - 0.03, PAVING, z + size - 0.03), color)
    return solids


def stage():
    """Two round steps and a floor of colored segments."""
    solids = Solids()
    solids.cylinder(STAGE_RADIUS + STEP, PAVING - 0.1, PAVING / 2, KERB, sides=64)
    solids.cylinder(STAGE_RADIUS, PAVING - 0.1, -0.02, PALE, sides=64)
    sectors, parts = 16, 3
    for sector in range(sectors):
        for ring, (inner, outer) in enumerate(((0.9, 2.0), (2.0, 3.15))):
            angles = [2 * math.pi * (sector + i / parts) / sectors for i in range(parts + 1)]
            outline = [(outer * math.cos(a), -outer * math.sin(a)) for a in angles]
            outline += [(inner * math.cos(a), -inner * math.sin(a)) for a in (angles[-1], angles[0])]
            solids.prism(outline, -0.1, 0.0, STAGE_COLORS[(sector + ring) % 2])
    solids.cylinder(0.9, -0.1, 0.0, STAGE_COLORS[0], sides=48)
    return solids


def lawn(x):
    solids = Solids()
    solids.box((x - 5.4, PAVING - 0.2, -9.4), (x + 5.4, PAVING + 0.16, 12.4), KERB)
    solids.box((x - 5.1, PAVING - 0.2, -9.1), (x + 5.1, PAVING + 0.28, 12.1), LAWN)
    return solids


def stairs():
    """Wide steps up to the terrace of the main building, with cheeks and handrails."""
    solids = Solids()
    count, rise, run = 7, 0.16, 0.36
    for step in range(count):
        color = KERB if step % 2 else PALE
        solids.box((-6, PAVING - 0.1, 13.0 + run * step), (6, PAVING + rise * (step + 1), 16.6), color)
    for x in (-6.4, 6.0):
        solids.box((x, PAVING, 12.7), (x + 0.4, PAVING + rise * count + 0.45, 16.6), STONE)
    for x in (-2.0, 2.0):
        for step in (0, 3, 6):
            foot = PAVING + rise * (step + 1)
            solids.cylinder(0.035, foot, foot + 0.95, DARK, (x, 0, 13.18 + run * step), 10)
        solids.include(rail(2.6, rise / run), np.eye(3), (x, PAVING + rise * 4 + 0.95, 14.26))
    return solids


def rail(length, slope):
    """A bar along z that rises with a slope, about the origin."""
    level, solids = Solids(), Solids()
    level.box((-0.05, -0.05, -length / 2), (0.05, 0.05, length / 2), DARK)
    solids.include(level, [(1, 0, 0), (0, 1, slope), (0, 0, 1)])
    return solids


def bench():
    solids = Solids()
    for x in (-0.75, 0.65):
        solids.box((x, 0, -0.22), (x + 0.1, 0.42, 0.22), DARK)
    for row in range(4):
        z = -0.26 + 0.135 * row
        solids.box((-0.95, 0.42, z), (0.95, 0.48, z + 0.11), WOOD)
    return solids


def lamp_post():
    solids = Solids()
    solids.cylinder(0.16, 0, 0.35, DARK, sides=16, top_radius=0.11)
    solids.cylinder(0.06, 0.35, 3.5, DARK, sides=14)
    solids.cylinder(0.17, 3.5, 3.56, DARK, sides=18)
    solids.ball((0.26, 0.26, 0.26), LAMP, (0, 3.78, 0), 12, 18)
    return solids


def flag(color):
    solids = Solids()
    solids.cylinder(0.08, 0, 8.2, KERB, sides=12, top_radius=0.05)
    solids.ball((0.12, 0.12, 0.12), DARK, (0, 8.25, 0), 8, 12)
    # a banner that hangs along the pole, in three waves
    for part in range(3):
        low = 7.8 - 1.1 * (part + 1)
        solids.box((0.1, low, -0.025), (1.15, low + 1.1, 0.025), color, 4 * (part - 1))
    return solids
