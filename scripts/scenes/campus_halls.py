"""The buildings of the campus: main building with colonnade, library with fins, lecture hall, clock tower.

Enters: a scene and its materials. Leaves: nodes named after the buildings, their windows apart as `… windows`. The
terrace and the paving have the heights of scenes/campus_court.py.
"""
import math

import numpy as np

from scenes.campus_court import PAVING
from scenes.flat_shapes import Solids

# Linear colors.
WHITE, CONCRETE, BRICK, DARK = (0.78, 0.76, 0.70), (0.50, 0.49, 0.47), (0.46, 0.13, 0.06), (0.045, 0.05, 0.06)
BLUE, YELLOW, ROOF, DOOR = (0.07, 0.19, 0.38), (0.80, 0.50, 0.06), (0.22, 0.23, 0.25), (0.10, 0.30, 0.30)
# Floor of the terrace that the stairs lead to, and height of a story.
TERRACE, STORY = PAVING + 1.12, 3.4
NO_COLOR = (1, 1, 1)
# Stories of the main building above the colonnade.
STORIES = 2
# Blocks far away: x of the middle, width, height, z of the front.
BLOCKS = ((34, 9, 17, 40), (20, 7, 19, 46), (-3, 8, 17, 50), (-30, 10, 16, 44), (-40, 6, 22, 38), (44, 8, 13, 30))


def add_halls(scene, paint, glass):
    for name, (walls, panes) in (
        ("main building", main_building()), ("library", library()), ("lecture hall", lecture_hall()),
    ):
        walls.place(scene, name, paint)
        panes.place(scene, f"{name} windows", glass, is_painted=False)
    clock_tower().place(scene, "clock tower", paint)
    far_blocks().place(scene, "far blocks", paint)


def window_band(walls, panes, start, end, bottom, top, normal, module=1.5):
    """A band of panes with posts, along a wall between two places (x, z); `normal` (x, z) points out of the wall."""
    start, end, normal = (np.asarray(v, float) for v in (start, end, normal))
    along = end - start
    length = np.hypot(*along)
    count = max(int(round(length / module)), 1)

    def slab(solids, a, b, depth_in, depth_out, low, high, color):
        corners = np.stack([start + a * along - depth_in * normal, start + b * along + depth_out * normal])
        solids.box((corners[0][0], low, corners[0][1]), (corners[1][0], high, corners[1][1]), color)

    slab(panes, 0, 1, 0.3, 0.03, bottom, top, NO_COLOR)
    slab(walls, -0.12 / length, 1 + 0.12 / length, 0.3, 0.16, bottom - 0.14, bottom, CONCRETE)
    slab(walls, -0.12 / length, 1 + 0.12 / length, 0.3, 0.12, top, top + 0.1, CONCRETE)
    for post in range(count + 1):
        middle = post / count
        slab(walls, middle - 0.045 / length, middle + 0.045 / length, 0.2, 0.1, bottom, top, DARK)


def main_building():
    """A slab of two stories over a colonnade; its front is at z = 17, the upper stories reach out to z = 16."""
    walls, panes = Solids(), Solids()
    walls.box((-24, PAVING - 0.2, 16.6), (24, TERRACE, 30), CONCRETE)
    walls.box((-24, PAVING - 0.2, 15.4), (-6.4, TERRACE, 16.6), CONCRETE)
    walls.box((6.4, PAVING - 0.2, 15.4), (24, TERRACE, 16.6), CONCRETE)
    walls.box((-23, TERRACE, 20), (23, TERRACE + STORY, 29), BLUE)
    low = TERRACE + STORY
    walls.box((-23.4, low, 16.4), (23.4, low + STORIES * STORY, 29.4), WHITE)
    walls.box((-24, low + STORIES * STORY, 15.9), (24, low + STORIES * STORY + 0.45, 30), ROOF)
    walls.box((-20, low + STORIES * STORY + 0.45, 20), (-6, low + STORIES * STORY + 2.4, 27), CONCRETE)
    walls.box((9, low + STORIES * STORY + 0.45, 21), (17, low + STORIES * STORY + 1.9, 26), CONCRETE)
    for pillar in range(13):
        x = -22.2 + 3.7 * pillar
        walls.cylinder(0.3, TERRACE, low, WHITE, (x, 0, 17.2), 20)
        walls.box((x - 0.42, low - 0.25, 16.78), (x + 0.42, low, 17.62), CONCRETE)
    for story in range(STORIES):
        bottom = low + STORY * story + 0.95
        window_band(walls, panes, (-22.6, 16.4), (-3.4, 16.4), bottom, bottom + 1.6, (0, -1), 1.6)
        window_band(walls, panes, (3.4, 16.4), (22.6, 16.4), bottom, bottom + 1.6, (0, -1), 1.6)
        window_band(walls, panes, (23.4, 17.2), (23.4, 28.6), bottom, bottom + 1.6, (1, 0), 1.9)
        window_band(walls, panes, (-23.4, 17.2), (-23.4, 28.6), bottom, bottom + 1.6, (-1, 0), 1.9)
    # the stairwell in the middle: a tall window in a yellow frame
    walls.box((-2.6, low + 0.3, 16.0), (2.6, low + STORIES * STORY - 0.2, 16.6), YELLOW)
    for story in range(STORIES):
        bottom = low + STORY * story + 0.6
        window_band(walls, panes, (-2.2, 16.0), (2.2, 16.0), bottom, bottom + 2.5, (0, -1), 1.1)
    window_band(walls, panes, (-22, 20), (-3.2, 20), TERRACE + 0.5, low - 0.5, (0, -1), 1.9)
    window_band(walls, panes, (3.2, 20), (22, 20), TERRACE + 0.5, low - 0.5, (0, -1), 1.9)
    for x in (-1.9, 0.1):
        walls.box((x, TERRACE, 19.9), (x + 1.8, TERRACE + 2.5, 20.1), DOOR)
        panes.box((x + 0.3, TERRACE + 0.9, 19.85), (x + 1.5, TERRACE + 2.2, 20.0), NO_COLOR)
    return walls, panes


def library():
    """A glass slab with fins on the right, its front at x = −21, open at the corner to the court."""
    walls, panes = Solids(), Solids()
    walls.box((-33, PAVING - 0.2, -12), (-21.6, PAVING + 0.5, 13.4), CONCRETE)
    walls.box((-32.6, PAVING + 0.5, -11.2), (-22, PAVING + 10.1, 12.6), WHITE)
    walls.box((-33.2, PAVING + 10.1, -12.2), (-20.7, PAVING + 10.6, 13.6), ROOF)
    for story in range(3):
        bottom = PAVING + 0.9 + 3.15 * story
        window_band(walls, panes, (-22, -10.8), (-22, 12.2), bottom, bottom + 2.3, (1, 0), 2.1)
        window_band(walls, panes, (-31.8, -11.2), (-22.8, -11.2), bottom, bottom + 2.3, (0, -1), 1.8)
    for fin in range(12):
        z = -11.0 + 2.1 * fin
        walls.box((-22, PAVING + 0.5, z - 0.09), (-21.05, PAVING + 10.1, z + 0.09), YELLOW if fin % 4 == 1 else WHITE)
    return walls, panes


def lecture_hall():
    """A brick wedge on the left, higher away from the court, with a canopy along its glass front at x = 20.5."""
    walls, panes, roof = Solids(), Solids(), Solids()
    outline, slope = [(-6.5, -9), (-6.5, 9), (6.5, 9), (6.5, -9)], 0.28
    walls.prism(outline, PAVING - 0.2, PAVING + 7.2, BRICK, (27.0, 0, 1.0), slant=(slope, 0))
    roof.box((-7.0, 0, -9.5), (7.0, 0.45, 9.5), ROOF)
    walls.include(roof, [(1, 0, 0), (slope, 1, 0), (0, 0, 1)], (27.0, PAVING + 7.15, 1.0))
    window_band(walls, panes, (20.5, -7.2), (20.5, 9.2), PAVING + 0.4, PAVING + 2.9, (-1, 0), 1.8)
    window_band(walls, panes, (21.2, -8), (26.0, -8), PAVING + 3.4, PAVING + 4.8, (0, -1), 1.2)
    walls.box((18.4, PAVING + 3.1, -8.4), (20.6, PAVING + 3.4, 10.4), WHITE)
    for pillar in range(6):
        walls.cylinder(0.14, PAVING, PAVING + 3.1, WHITE, (18.8, 0, -7.8 + 3.5 * pillar), 14)
    # a row of slim windows below the roof
    for slot in range(7):
        z = -6.0 + 2.3 * slot
        walls.box((20.38, PAVING + 3.75, z - 0.08), (20.6, PAVING + 5.1, z + 0.98), CONCRETE)
        panes.box((20.3, PAVING + 3.85, z + 0.02), (20.6, PAVING + 5.0, z + 0.88), NO_COLOR)
    return walls, panes


def clock_tower():
    """Two slim slabs with a clock between them, right of the stairs; it shows ten past ten."""
    solids = Solids()
    x, z = -8.6, 14.6
    for side in (-0.95, 0.75):
        solids.box((x + side, PAVING - 0.1, z - 0.35), (x + side + 0.2, 10.6, z + 0.35), WHITE)
    for level in range(5):
        solids.box((x - 0.75, 1.2 + 1.35 * level, z - 0.2), (x + 0.75, 1.35 + 1.35 * level, z + 0.2), BLUE)
    solids.box((x - 1.15, 7.9, z - 0.5), (x + 1.15, 10.2, z + 0.5), BLUE)
    solids.include(disc(0.98, 0.10, WHITE), np.eye(3), (x, 9.05, z - 0.5))
    solids.include(disc(0.09, 0.06, DARK), np.eye(3), (x, 9.05, z - 0.62))
    for hour in range(12):
        angle = math.radians(30 * hour)
        # seen from −Z, x runs to the left
        place = (x - 0.82 * math.sin(angle), 9.05 + 0.82 * math.cos(angle))
        size = 0.07 if hour % 3 == 0 else 0.04
        solids.box((place[0] - size, place[1] - size, z - 0.64), (place[0] + size, place[1] + size, z - 0.58), DARK)
    for degrees, length, width in ((305, 0.48, 0.06), (60, 0.72, 0.04)):
        solids.include(hand(degrees, length, width), np.eye(3), (x, 9.05, z - 0.66))
    return solids


def disc(radius, depth, color):
    """A flat cylinder whose face looks along −Z."""
    flat, upright = Solids(), Solids()
    flat.cylinder(radius, 0, depth, color, sides=40)
    upright.include(flat, [(1, 0, 0), (0, 0, 1), (0, -1, 0)])
    return upright


def hand(degrees, length, width):
    """A hand of the clock, turned clockwise from twelve as seen from −Z."""
    solids, turned = Solids(), Solids()
    solids.box((-width, -0.12, 0), (width, length, 0.04), DARK)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turned.include(solids, [(c, -s, 0), (s, c, 0), (0, 0, 1)])
    return turned


def far_blocks():
    """Plain blocks of the town behind and the ground below them, in the color of haze."""
    solids = Solids()
    haze = (0.42, 0.47, 0.55)
    solids.box((-62, PAVING - 0.9, 27), (62, PAVING - 0.3, 58), (0.36, 0.44, 0.32))
    for x, width, height, z in BLOCKS:
        solids.box((x - width / 2, PAVING - 0.5, z), (x + width / 2, height, z + 6), haze)
    return solids
