"""Noise in space: gradient noise (Perlin 2002), its sum over octaves, ridges (Musgrave 1994), cells (Worley 1996).

Enter: points, one a row, in units of the largest features. Leave: numbers about 0 (`gradient_noise`,
`fractal_noise`), or 0…1. The same seed gives the same noise on all machines.
"""
import numpy as np

# Directions to the twelve edges of a cube, and four of them twice (Perlin 2002).
GRADIENTS = np.array([
    (1, 1, 0), (-1, 1, 0), (1, -1, 0), (-1, -1, 0), (1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1),
    (0, 1, 1), (0, -1, 1), (0, 1, -1), (0, -1, -1), (1, 1, 0), (-1, 1, 0), (0, -1, 1), (0, -1, -1),
], float)


def scrambled(cells, seed):
    """Integers that look random, from lattice points: the finalizer of MurmurHash3 (Appleby 2011)."""
    x, y, z = (cells[..., i].astype(np.int64).astype(np.uint32) for i in range(3))
    mixed = x * np.uint32(0x8DA6B343) ^ y * np.uint32(0xD8163841) ^ z * np.uint32(0xCB1AB31F)
    mixed = mixed + np.uint32(seed * 0x9E3779B1 & 0xFFFFFFFF)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        mixed = (mixed ^ mixed >> np.uint32(shift)) * np.uint32(factor)
    return mixed ^ mixed >> np.uint32(16)


def gradient_noise(points, seed, period=None):
    """Smooth noise of about −1…1, zero at lattice points; with a period, in whole units, it repeats."""
    points = np.asarray(points, float)
    cell = np.floor(points)
    inside = points - cell
    weight = inside ** 3 * (inside * (6 * inside - 15) + 10)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        lattice = cell + corner if period is None else (cell + corner) % period
        gradient = GRADIENTS[scrambled(lattice, seed) & 15]
        factor = np.prod(np.where(corner, weight, 1 - weight), axis=-1)
        total += factor * ((inside - corner) * gradient).sum(-1)
    return total


def fractal_noise(points, seed, octaves=4, period=None):
    """Gradient noise summed over octaves, each half as strong and twice as fine."""
    points = np.asarray(points, float)
    periods = [None if period is None else period * 2 ** i for i in range(octaves)]
    return sum(gradient_noise(points * 2 ** i + 17.3 * i, seed + i, periods[i]) / 2 ** i for i in range(octaves))


def ridges(points, seed, octaves=3):
    """0…1, with sharp crests along the zero lines of gradient noise."""
    points = np.asarray(points, float)
    crests = [(1 - abs(gradient_noise(points * 2 ** i + 9.1 * i, seed + i))) ** 2 / 2 ** i for i in range(octaves)]
    return sum(crests) / (2 - 2 ** (1 - octaves))


def distance_to_cells(points, seed):
    """Distance to the nearest of the points that lie at random, one in each lattice cell."""
    points = np.asarray(points, float)
    base = np.floor(points)
    nearest = np.full(len(points), np.inf)
    for step in np.ndindex(3, 3, 3):
        cell = base + step - 1
        site = cell + np.stack([scrambled(cell, seed + i) / 2 ** 32 for i in range(3)], -1)
        nearest = np.minimum(nearest, np.linalg.norm(points - site, axis=-1))
    return nearest


def smoothstep(start, end, values):
    """0 up to the start, 1 from the end on, smooth between."""
    part = np.clip((values - start) / (end - start), 0, 1)
    return part * part * (3 - 2 * part)
