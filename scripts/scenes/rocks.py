"""Rocks: boxes that are broken, worn and weathered.

Enter: size in meters, spacing of vertices, seed. Leave: closed smooth meshes that stand with their foot at y = 0, and
colors of weathered sandstone. Each box is divided, its edges are rounded, corners are chipped off along planes, and
several kinds of noise (scenes/noise.py) move the surface.
"""
import numpy as np

from scenes.noise import distance_to_cells, fractal_noise, gradient_noise, ridges, smoothstep

# Linear colors.
STONE, PALE_STONE, STREAK = (0.27, 0.245, 0.21), (0.44, 0.41, 0.36), (0.085, 0.08, 0.075)
LICHEN, OCHRE_LICHEN, MOSS = (0.42, 0.44, 0.34), (0.47, 0.31, 0.08), (0.055, 0.075, 0.03)


def divided_box(size, spacing):
    """A box about the origin: positions and triangles; faces share the vertices along edges."""
    counts = np.maximum(np.rint(np.divide(size, spacing)).astype(int), 1)
    corners = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        i, j = (grid.ravel() for grid in np.mgrid[0:counts[u], 0:counts[v]])
        for side in (0, 1):
            quads = np.zeros((len(i), 4, 3), int)
            quads[..., axis] = side * counts[axis]
            for corner, (du, dv) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
                quads[:, corner, u], quads[:, corner, v] = i + du, j + dv
            corners.append(quads if side else quads[:, ::-1])
    lattice, numbers = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    a, b, c, d = numbers.reshape(-1, 4).T
    flip = (np.arange(len(a)) % 2).astype(bool)[:, None]
    halves = np.where(flip, np.stack([a, b, c, a, c, d], 1), np.stack([a, b, d, b, c, d], 1))
    return (lattice / counts - 0.5) * size, halves.reshape(-1, 3)


def smooth_normals(positions, triangles):
    """Normals of vertices, weighted by the areas of the faces."""
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    faces = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    normals = np.stack([np.bincount(triangles.ravel(), faces[:, axis], len(positions)) for axis in range(3)], 1)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def relief(positions, triangles, normals):
    """How far each vertex stands out over its neighbors (positive) or lies in a hollow (negative), in meters."""
    total, count = np.zeros_like(positions), np.zeros(len(positions))
    for i, j in ((0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)):
        for axis in range(3):
            total[:, axis] += np.bincount(triangles[:, i], positions[triangles[:, j], axis], len(positions))
        count += np.bincount(triangles[:, i], minlength=len(positions))
    return ((positions - total / count[:, None]) * normals).sum(1)


def rock(size, spacing, seed, taper=0.12, chips=14, wear=0.22, bow_radius=None):
    """A rock that stands on y = 0: positions, triangles and normals.

    `taper` narrows it to the top, `wear` rounds the edges (meters), `bow_radius` bends its length (x) along a circle.
    """
    random = np.random.default_rng(seed)
    size = np.asarray(size, float)
    points, triangles = divided_box(size, spacing)
    # rounded edges, in some places more than in others
    radius = np.minimum(wear * (1 + 0.9 * gradient_noise(points / 0.9, seed)), 0.45 * size.min())[:, None]
    core = np.clip(points, -size / 2 + radius, size / 2 - radius)
    outward = (points - core) / np.maximum(np.linalg.norm(points - core, axis=1, keepdims=True), 1e-9)
    points = core + radius * outward
    # chips: half of them at corners, half along edges
    for chip in range(chips):
        direction = random.choice([-1, 1], 3) * random.uniform(0.25, 1, 3)
        if chip % 2:
            direction[random.integers(3)] = random.uniform(-0.15, 0.15)
        direction /= np.linalg.norm(direction)
        reach = (np.abs(direction) * size / 2).sum() - random.uniform(0.1, 0.34) * size.min()
        beyond = np.maximum(points @ direction + 0.05 * gradient_noise(points / 0.5, seed + chip) - reach, 0)
        points -= 0.95 * beyond[:, None] * direction
    # swelling, flutes that run down, broken ledges, pits
    swelling = 0.16 * gradient_noise(points / 1.5, seed + 50) + 0.06 * gradient_noise(points / 0.6, seed + 51)
    flutes = -0.09 * ridges(points / (0.8, 3.2, 0.8), seed + 52, 2) ** 3
    ledges = 0.035 * (ridges(points / (1.4, 0.35, 1.4), seed + 53, 2) - 0.5)
    pits = -0.09 * smoothstep(0.33, 0.1, distance_to_cells(points / (0.75, 0.95, 0.75), seed + 54))
    grain = 0.022 * fractal_noise(points / 0.22, seed + 55, 2)
    limit = min(1.0, size.min() / 0.9)
    points += (limit * (swelling + flutes + ledges + pits) + grain)[:, None] * outward
    height = points[:, 1] / size[1] + 0.5
    points[:, [0, 2]] *= (1 + taper * (0.45 - height) + 0.02 * np.sin(7 * height + seed))[:, None]
    points[:, 0] += 0.07 * size[1] / 4 * np.sin(2.2 * height + random.uniform(0, 6)) * (height > 0)
    if bow_radius:
        points[:, 2] -= points[:, 0] ** 2 / (2 * bow_radius)
    points[:, 1] += size[1] / 2
    return points, triangles, smooth_normals(points, triangles)


def weathered(points, triangles, normals, seed, damp_height=0.9):
    """Linear colors: pale and streaked stone, lichen where rain falls, moss up to the damp height, dark hollows."""

    def mixed(colors, target, weight):
        return colors + (np.asarray(target) - colors) * np.clip(weight, 0, 1)[:, None]

    colors = mixed(np.tile(STONE, (len(points), 1)), PALE_STONE, 0.5 + 1.1 * fractal_noise(points / 1.3, seed + 60, 4))
    streaks = smoothstep(0.05, 0.6, fractal_noise(points / (0.35, 4.0, 0.35), seed + 61, 3))
    colors = mixed(colors, STREAK, 0.75 * streaks * (1 - np.abs(normals[:, 1])))
    rain = 0.35 + 0.65 * smoothstep(-0.2, 0.7, normals[:, 1])
    spots = fractal_noise(points / 0.55, seed + 62, 4)
    colors = mixed(colors, LICHEN, 0.8 * rain * smoothstep(0.12, 0.4, spots))
    colors = mixed(colors, OCHRE_LICHEN, 0.7 * rain * smoothstep(0.42, 0.62, fractal_noise(points / 0.8, seed + 63, 4)))
    damp = smoothstep(damp_height, damp_height - 1.0, points[:, 1] + 0.45 * fractal_noise(points / 0.7, seed + 64, 3))
    colors = mixed(colors, MOSS, 0.85 * damp)
    bumps = relief(points, triangles, normals)
    return np.clip(colors * np.clip(1 + 16 * bumps, 0.35, 1.6)[:, None], 0.02, 0.85)
