"""Solids as signed distance functions: points (n, 3) in millimeters enter, distances (n,) leave, negative inside.

Distances are exact or slightly off where a comment says so; surface_net.py needs only their sign, their zero, and a
smooth gradient. Sources: J. C. Hart, "Sphere tracing" (1996), for solids and their combination; I. Quilez, "Smooth
minimum" (2013), for the blend.
"""
import numpy as np

from dancer.spline import through

# Limbs between two points of a strand, and the width in millimeters over which they blend.
STRAND_PARTS, STRAND_BLEND = 6, 0.6


def ellipsoid(center, radii):
    """Ellipsoid along the axes. The distance is of first order: exact on the surface and for a ball."""
    center, radii = np.asarray(center, float), np.asarray(radii, float)

    def distance(points):
        scaled = (points - center) / radii
        length = np.linalg.norm(scaled, axis=1)
        slope = np.linalg.norm(scaled / radii, axis=1)
        return length * (length - 1) / np.maximum(slope, 1e-9)

    return distance


def ball(center, radius):
    return ellipsoid(center, (radius,) * 3)


def limb(start, end, start_radius, end_radius):
    """Capsule whose radius changes evenly along it. Exact for equal radii."""
    start, along = np.asarray(start, float), np.subtract(end, start)

    def distance(points):
        fraction = np.clip((points - start) @ along / (along @ along), 0, 1)
        radius = start_radius + fraction * (end_radius - start_radius)
        return np.linalg.norm(points - start - fraction[:, None] * along, axis=1) - radius

    return distance


def strand(points, radii):
    """A limb along a smooth curve through points, with a radius for each."""
    curve = through(np.column_stack([points, radii]), STRAND_PARTS)
    pieces = [limb(a[:3], b[:3], a[3], b[3]) for a, b in zip(curve, curve[1:])]
    return union(STRAND_BLEND, *pieces)


def ring(center, normal, radius, thickness):
    """Torus about an axis."""
    center, normal = np.asarray(center, float), np.asarray(normal, float) / np.linalg.norm(normal)

    def distance(points):
        offset = points - center
        height = offset @ normal
        aside = np.linalg.norm(offset - height[:, None] * normal, axis=1)
        return np.hypot(aside - radius, height) - thickness

    return distance


def beyond(point, normal):
    """Half of space on the side that the normal points to."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    return lambda points: (np.asarray(point, float) - points) @ normal


def smooth_minimum(a, b, width):
    """Quadratic blend of two distances, which bulges by at most a quarter of the width."""
    overlap = np.maximum(width - np.abs(a - b), 0)
    return np.minimum(a, b) - overlap * overlap / (4 * width)


def union(blend, *fields):
    """All solids, their seams filleted over a width."""

    def distance(points):
        result = fields[0](points)
        for field in fields[1:]:
            result = smooth_minimum(result, field(points), blend)
        return result

    return distance


def intersection(blend, *fields):
    """What all solids have in common, its edges rounded over a width."""
    inverted = union(blend, *(inverse(field) for field in fields))
    return inverse(inverted)


def cut(blend, field, *tools):
    """A solid without others, its edges rounded over a width."""
    return intersection(blend, field, *(inverse(tool) for tool in tools))


def inverse(field):
    return lambda points: -field(points)


def flattened(field, factors):
    """A solid scaled along the axes. Distances shrink with the smallest factor, and never overshoot."""
    factors = np.asarray(factors, float)
    return lambda points: field(points / factors) * factors.min()


def placed(field, origin, axes):
    """A solid moved to an origin and turned so that its x, y, z lie along three unit vectors."""
    axes = np.asarray(axes, float)
    return lambda points: field((points - origin) @ axes.T)


def on_both_sides(field):
    """A solid of the right half (+X) and its mirror image; they don't blend."""

    def distance(points):
        right = points.copy()
        right[:, 0] = np.abs(right[:, 0])
        return field(right)

    return distance


def gradient(field, points, step=0.02):
    """Central difference of the distance."""
    result = np.empty_like(points)
    for axis, offset in enumerate(np.eye(3) * step):
        result[:, axis] = (field(points + offset) - field(points - offset)) / (2 * step)
    return result
