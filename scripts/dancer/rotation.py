"""Rotations of many frames at once, as matrices (n, 3, 3), from angles in degrees; and as quaternions x, y, z, w.

The figure faces −Z: she leans forward, turns left, and tilts left with positive angles.
"""
import numpy as np

AXES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


def about(axis, degrees):
    """Rotation about one axis, right-handed."""
    angle = np.radians(np.asarray(degrees, float))
    first, second = AXES[axis]
    result = np.tile(np.eye(3), (*angle.shape, 1, 1))
    result[..., first, first] = result[..., second, second] = np.cos(angle)
    result[..., first, second], result[..., second, first] = -np.sin(angle), np.sin(angle)
    return result


def leaning(angles):
    """Rotation that leans forward, turns left, and tilts left (n, 3): the tilt comes first, the turn last."""
    lean, turn, tilt = np.asarray(angles, float).T
    return about("y", turn) @ about("x", -lean) @ about("z", tilt)


def quaternions(matrices):
    """Unit quaternions (n, 4) of rotations (n, 3, 3), each on the side of the one before (S. W. Shepperd, 1978)."""
    result = np.empty((len(matrices), 4))
    for row, m in enumerate(matrices):
        trace = np.trace(m)
        squares = np.array([*(1 + 2 * np.diag(m) - trace), 1 + trace])
        x, y, z, w = range(4)
        products = np.empty((4, 4))
        products[x, y] = products[y, x] = m[1, 0] + m[0, 1]
        products[x, z] = products[z, x] = m[0, 2] + m[2, 0]
        products[y, z] = products[z, y] = m[2, 1] + m[1, 2]
        products[x, w] = products[w, x] = m[2, 1] - m[1, 2]
        products[y, w] = products[w, y] = m[0, 2] - m[2, 0]
        products[z, w] = products[w, z] = m[1, 0] - m[0, 1]
        np.fill_diagonal(products, squares)
        # The row of the largest square is the most exact.
        best = products[squares.argmax()]
        result[row] = best / np.linalg.norm(best)
        against = result[row - 1] if row else (0, 0, 0, 1)
        if result[row] @ against < 0:
            result[row] *= -1
    return result


def fraction_of(matrices, fraction):
    """The same rotations by a fraction of their angle, which stays below a half turn."""
    xyzw = quaternions(matrices)
    xyzw[xyzw[:, 3] < 0] *= -1
    sine = np.linalg.norm(xyzw[:, :3], axis=1)
    half = np.arctan2(sine, xyzw[:, 3])
    axis = xyzw[:, :3] / np.maximum(sine, 1e-12)[:, None]
    return turned(axis, 2 * fraction * half)


def turned(axis, radians):
    """Rotation about unit axes (n, 3) (O. Rodrigues, 1840)."""
    cross = np.zeros((len(axis), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -axis[:, 2], axis[:, 1], -axis[:, 0]
    cross -= cross.transpose(0, 2, 1)
    angle = radians[:, None, None]
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def applied(matrices, vectors):
    return np.einsum("nij,nj->ni", matrices, np.broadcast_to(vectors, (len(matrices), 3)))
