"""Shapes for scenes in flat colors: boxes, prisms, cylinders and balls, collected into one mesh with vertex colors.

Enter: sizes and places in meters, linear colors. Leave: closed solids whose triangles run counterclockwise as seen
from outside, with flat normals on plane faces and smooth ones on round faces.
"""
import math

import numpy as np

from scenes.rocks import smooth_normals


class Solids:
    """Solids of one mesh."""

    def __init__(self):
        self.positions, self.normals, self.colors, self.triangles, self.count = [], [], [], [], 0

    def add(self, positions, normals, triangles, color, at=(0, 0, 0), turn=0.0):
        """Adds a shape, turned about +Y by degrees and moved, in one color or with those of its vertices."""
        angle = math.radians(turn)
        turned = np.array([(math.cos(angle), 0, -math.sin(angle)), (0, 1, 0), (math.sin(angle), 0, math.cos(angle))])
        positions = np.asarray(positions, float)
        self.positions.append(positions @ turned + at)
        self.normals.append(np.asarray(normals, float) @ turned)
        self.colors.append(np.broadcast_to(color, positions.shape))
        self.triangles.append(np.asarray(triangles, int) + self.count)
        self.count += len(positions)

    def box(self, low, high, color, turn=0.0):
        """A box between two corners, turned about its own middle."""
        low, high = np.minimum(low, high), np.maximum(low, high)
        x, z = (high - low)[[0, 2]] / 2
        middle = (low + high) / 2 * (1, 0, 1)
        self.prism([(-x, -z), (-x, z), (x, z), (x, -z)], low[1], high[1], color, middle, turn)

    def prism(self, outline, bottom, top, color, at=(0, 0, 0), turn=0.0, slant=(0, 0)):
        """A convex outline in x and z, counterclockwise as seen from above (x to the right, z down), raised from bottom
        to top. A slant raises the top by so much for each meter of x and z."""
        outline = np.asarray(outline, float)
        count = len(outline)
        tops = top + outline @ slant
        low = np.stack([outline[:, 0], np.full(count, bottom), outline[:, 1]], 1)
        high = np.stack([outline[:, 0], tops, outline[:, 1]], 1)
        fan = np.array([(0, i, i + 1) for i in range(1, count - 1)])
        up = np.array([-slant[0], 1, -slant[1]]) / math.hypot(1, *slant)
        points, triangles = [high, low], [fan, fan[:, ::-1] + count]
        normals = [np.tile(up, (count, 1)), np.tile((0, -1, 0), (count, 1))]
        for i in range(count):
            j = (i + 1) % count
            along = outline[j] - outline[i]
            normal = np.array([-along[1], 0, along[0]]) / np.hypot(*along)
            triangles.append(np.array([(0, 1, 2), (0, 2, 3)]) + 2 * count + 4 * i)
            points.append(np.stack([low[i], low[j], high[j], high[i]]))
            normals.append(np.tile(normal, (4, 1)))
        self.add(np.concatenate(points), np.concatenate(normals), np.concatenate(triangles), color, at, turn)

    def cylinder(self, radius, bottom, top, color, at=(0, 0, 0), sides=20, top_radius=None):
        """An upright cylinder or cone frustum with smooth sides."""
        upper = radius if top_radius is None else top_radius
        angle = -np.arange(sides) / sides * 2 * np.pi
        circle = np.stack([np.cos(angle), np.sin(angle)], 1)
        ring = np.stack([circle[:, 0], 0 * angle, circle[:, 1]], 1)
        level = np.array([0, 1, 0])
        sideways = ring * (top - bottom) + level * (radius - upper)
        sideways /= np.linalg.norm(sideways, axis=1, keepdims=True)
        low, high = radius * ring + level * bottom, upper * ring + level * top
        a, b = np.arange(sides), (np.arange(sides) + 1) % sides
        wall = np.concatenate([np.stack([a, b, b + sides], 1), np.stack([a, b + sides, a + sides], 1)])
        fan = np.array([(0, i, i + 1) for i in range(1, sides - 1)])
        points = np.concatenate([low, high, high, low])
        normals = np.concatenate([sideways, sideways, np.tile(level, (sides, 1)), np.tile(-level, (sides, 1))])
        self.add(points, normals, np.concatenate([wall, fan + 2 * sides, fan[:, ::-1] + 3 * sides]), color, at)

    def ball(self, radii, color, at, rings=14, sides=22, dent=0.0, seed=0):
        """An ellipsoid; a dent makes it bumpy, as a fraction of the radii."""
        polar = np.arange(1, rings) / rings * np.pi
        angle = -np.arange(sides) / sides * 2 * np.pi
        t, s = (grid.ravel() for grid in np.meshgrid(polar, angle, indexing="ij"))
        unit = np.stack([np.sin(t) * np.cos(s), np.cos(t), np.sin(t) * np.sin(s)], 1)
        unit = np.concatenate([unit, [(0, 1, 0), (0, -1, 0)]])
        waves = sum(np.sin(unit @ direction + phase) for direction, phase in bumps(seed))
        points = unit * radii * (1 + dent * waves / 3)[:, None]
        ring, side = (grid.ravel() for grid in np.mgrid[0:rings - 2, 0:sides])
        following = (side + 1) % sides
        a, b = ring * sides + side, ring * sides + following
        north, south = (rings - 1) * sides, (rings - 1) * sides + 1
        first, last = np.arange(sides), np.arange(sides) + (rings - 2) * sides
        triangles = np.concatenate([
            np.stack([a, b + sides, b], 1), np.stack([a, a + sides, b + sides], 1),
            np.stack([np.full(sides, north), first, np.roll(first, -1)], 1),
            np.stack([np.full(sides, south), np.roll(last, -1), last], 1),
        ])
        self.add(points, smooth_normals(points, triangles), triangles, color, at)

    def include(self, other, matrix, at=(0, 0, 0)):
        """Adds other solids, transformed by a matrix of 3 × 3 that does not mirror, and moved."""
        matrix = np.asarray(matrix, float)
        positions, triangles, normals, colors = other.arrays()
        normals = normals @ np.linalg.inv(matrix)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        self.add(positions @ matrix.T, normals, triangles, colors, at)

    def arrays(self):
        """Positions, triangles, normals and colors of all solids."""
        return tuple(np.concatenate(rows) for rows in (self.positions, self.triangles, self.normals, self.colors))

    def mesh(self, scene, name, material, is_painted=True):
        """Adds the mesh to a scene, with its colors if it is painted; returns its number."""
        positions, triangles, normals, colors = self.arrays()
        return scene.mesh(name, positions, triangles, material, normals, colors if is_painted else None)

    def place(self, scene, name, material, is_painted=True):
        """Adds the mesh and a node for it."""
        scene.place(name, self.mesh(scene, name, material, is_painted))


def bumps(seed):
    """Directions and phases of the waves that make a ball bumpy."""
    random = np.random.default_rng(seed)
    return [(random.normal(size=3) * 3.2, random.uniform(0, 6)) for _ in range(3)]
