"""Turns a signed distance function into a closed mesh of even triangles with smooth normals.

A grid of cubic cells enters with the field; positions, unit normals, and triangles (counterclockwise from outside)
leave. Every cell that the surface crosses gets one vertex, and every grid edge that it crosses a quadrilateral (S. F.
Gibson, "Constrained elastic surface nets", 1998). Here the vertices are then drawn to the middle of their neighbors
and back onto the exact surface.
"""
import numpy as np

from dancer.distance_field import gradient

RELAXATIONS = 4
PROJECTIONS = 3
NORMAL_WIDTH = 0.9
# Of the space that is searched for a part, in millimeters: the whole figure and a rim.
LOW, HIGH = np.array([-56.0, -4.0, -34.0]), np.array([56.0, 158.0, 52.0])
SEARCH_CELL = 2.0


def grid(low, cell, counts):
    axes = [low[i] + cell * np.arange(counts[i]) for i in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def bounds(field):
    """Box around the surface with a rim of two search cells."""
    points = grid(LOW, SEARCH_CELL, np.ceil((HIGH - LOW) / SEARCH_CELL).astype(int))
    near = points[field(points) < SEARCH_CELL]
    return near.min(axis=0) - 2 * SEARCH_CELL, near.max(axis=0) + 2 * SEARCH_CELL


def projected(field, points, cell):
    """Points moved onto the surface by Newton's method, each step at most half a cell."""
    for _ in range(PROJECTIONS):
        slope = gradient(field, points)
        step = field(points)[:, None] * slope / np.maximum((slope * slope).sum(axis=1, keepdims=True), 1e-6)
        length = np.linalg.norm(step, axis=1, keepdims=True)
        points = points - step * np.minimum(1, 0.5 * cell / np.maximum(length, 1e-9))
    return points


def crossed_cells(values, low, cell):
    """Number of each crossed cell (-1 elsewhere), and the mean of the crossings on its edges."""
    shape = np.array(values.shape)
    sums, counts = np.zeros((*(shape - 1), 3)), np.zeros(shape - 1)
    corner = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).astype(float)
    for axis in range(3):
        first = np.take(values, range(shape[axis] - 1), axis)
        second = np.take(values, range(1, shape[axis]), axis)
        crosses = (first < 0) != (second < 0)
        fraction = np.where(crosses, first / np.where(crosses, first - second, 1), 0)
        at = np.take(corner, range(shape[axis] - 1), axis)
        at[..., axis] += fraction
        at = at * crosses[..., None]
        b, c = (other for other in range(3) if other != axis)
        # The edge is common to four cells.
        for i in (0, 1):
            for j in (0, 1):
                chosen = [slice(None)] * 3
                chosen[b] = slice(i, i + shape[b] - 1)
                chosen[c] = slice(j, j + shape[c] - 1)
                sums += at[tuple(chosen)]
                counts += crosses[tuple(chosen)]
    numbers = np.full(counts.shape, -1)
    numbers[counts > 0] = np.arange(np.count_nonzero(counts))
    return numbers, low + cell * sums[counts > 0] / counts[counts > 0, None]


def quadrilaterals(values, numbers):
    """Corners (n, 4) around each crossed grid edge, counterclockwise from outside."""
    faces = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        inside = np.moveaxis(values < 0, (axis, b, c), (0, 1, 2))
        cells = np.moveaxis(numbers, (axis, b, c), (0, 1, 2))
        leaves, enters = inside[:-1] & ~inside[1:], ~inside[:-1] & inside[1:]
        for crossing, order in ((leaves, (0, 1, 2, 3)), (enters, (3, 2, 1, 0))):
            i, j, k = np.nonzero(crossing[:, 1:-1, 1:-1])
            around = [cells[i, j, k], cells[i, j + 1, k], cells[i, j + 1, k + 1], cells[i, j, k + 1]]
            faces.append(np.stack([around[o] for o in order], axis=-1))
    return np.concatenate(faces)


def relaxed(field, points, quads, cell):
    """Vertices evened out along the surface."""
    edges = np.concatenate([quads[:, [i, (i + 1) % 4]] for i in range(4)])
    for _ in range(RELAXATIONS):
        sums, counts = np.zeros_like(points), np.zeros(len(points))
        for a, b in ((0, 1), (1, 0)):
            np.add.at(sums, edges[:, a], points[edges[:, b]])
            np.add.at(counts, edges[:, a], 1)
        points = projected(field, 0.5 * points + 0.5 * sums / counts[:, None], cell)
    return points


def mesh(field, cell):
    """Positions and normals (n, 3), and triangles (m, 3), of the surface where the field is zero."""
    low, high = bounds(field)
    # Symmetrical about x = 0, so that both halves of the figure are alike.
    low[0] = -np.ceil(max(-low[0], high[0]) / cell) * cell if low[0] < 0 < high[0] else low[0]
    high[0] = -low[0] if low[0] < 0 < high[0] else high[0]
    counts = np.ceil((high - low) / cell).astype(int) + 1
    # A value of exactly zero would have no side.
    values = field(grid(low, cell, counts)).reshape(counts) + 1e-9
    numbers, points = crossed_cells(values, low, cell)
    quads = quadrilaterals(values, numbers)
    points = relaxed(field, projected(field, points, cell), quads, cell)
    # Along the shorter diagonal.
    corners = points[quads]
    first = np.linalg.norm(corners[:, 0] - corners[:, 2], axis=1)
    second = np.linalg.norm(corners[:, 1] - corners[:, 3], axis=1)
    flip = (second < first)[:, None]
    triangles = np.where(flip, quads[:, [1, 2, 3, 1, 3, 0]], quads[:, [0, 1, 2, 0, 2, 3]]).reshape(-1, 3)
    # Over a width, so that a crease is round.
    normals = gradient(field, points, NORMAL_WIDTH)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True), triangles
