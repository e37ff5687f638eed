"""Small closed meshes from formulas: patches (eyes, cheeks) and tubes (mouth, lashes) on a face, and tori.

A solid's field and places (x, y) on its front (−Z) in millimeters enter; positions, unit normals, and triangles
(counterclockwise from outside) leave.
"""
import numpy as np

from dancer.distance_field import gradient
from dancer.spline import through

RINGS, SEGMENTS, SIDES = 4, 16, 6
TUBE_PARTS = 3
# Of the line of sight, in millimeters.
FAR, NEAR, STEP = -40.0, 0.0, 0.25


def on_front(field, places):
    """Where lines of sight along +Z first meet the surface at places (n, 2), and the unit normals there."""
    places = np.asarray(places, float)
    depths = np.arange(FAR, NEAR, STEP)
    lines = np.concatenate([np.repeat(places, len(depths), axis=0), np.tile(depths, len(places))[:, None]], axis=1)
    inside = field(lines).reshape(len(places), -1) < 0
    points = np.column_stack([places, depths[inside.argmax(axis=1)]])
    for _ in range(6):
        points[:, 2] -= field(points) / np.minimum(gradient(field, points)[:, 2], -0.2)
    normals = gradient(field, points)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def patch(field, center, radii, thickness, height=0.0, tilt=0.0):
    """A cushion at a height over the surface: from the front, an ellipse, tilted counterclockwise in degrees."""
    latitudes = np.linspace(np.pi / 2, -np.pi / 2, RINGS + 2)[1:-1]
    longitudes = np.arange(SEGMENTS) * 2 * np.pi / SEGMENTS
    ring = np.stack([np.cos(longitudes), np.sin(longitudes)], axis=-1)
    sphere = np.concatenate([np.column_stack([np.cos(a) * ring, np.full(SEGMENTS, np.sin(a))]) for a in latitudes])
    sphere = np.concatenate([[(0, 0, 1)], sphere, [(0, 0, -1)]])
    cosine, sine = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    flat = sphere[:, :2] * radii @ np.array([[cosine, sine], [-sine, cosine]])
    points, normals = on_front(field, flat + center)
    points += normals * (height + thickness * sphere[:, 2:])
    triangles = ring_triangles(RINGS, SEGMENTS)
    return points, mean_normals(points, triangles), triangles


def tube_on(field, places, radii, height=0.0):
    """A round line on the surface, smooth through its places (n, 2)."""
    smooth = through(np.column_stack([places, radii]), TUBE_PARTS)
    points, normals = on_front(field, smooth[:, :2])
    return tube(points + height * normals, normals, smooth[:, 2])


def tube(points, normals, radii):
    """A round line along points with round ends; the normals are unit vectors across it."""
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    aside = np.cross(along, normals)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    angles = -np.arange(SIDES) * 2 * np.pi / SIDES
    rings = [
        point + radius * (np.cos(angles)[:, None] * a + np.sin(angles)[:, None] * np.cross(a, t))
        for point, radius, a, t in zip(points, radii, aside, along)
    ]
    ends = points[[0]] - radii[0] * along[[0]], points[[-1]] + radii[-1] * along[[-1]]
    points = np.concatenate([ends[0], *rings, ends[1]])
    triangles = ring_triangles(len(rings), SIDES)
    return points, mean_normals(points, triangles), triangles


def torus(center, axis, radius, thickness, segments):
    """A ring about an axis; its cross section has the radius `thickness`."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    right = np.cross(axis, (0, 0, 1) if abs(axis[2]) < 0.9 else (0, 1, 0))
    right /= np.linalg.norm(right)
    around, across = np.meshgrid(*(np.arange(n) * 2 * np.pi / n for n in (segments, SIDES)), indexing="ij")
    out = np.cos(around)[..., None] * right + np.sin(around)[..., None] * np.cross(axis, right)
    normals = np.cos(across)[..., None] * out + np.sin(across)[..., None] * axis
    points = np.asarray(center, float) + radius * out + thickness * normals
    i, j = (grid.reshape(-1) for grid in np.meshgrid(range(segments), range(SIDES), indexing="ij"))
    a, b = i * SIDES, (i + 1) % segments * SIDES
    following = (j + 1) % SIDES
    triangles = np.concatenate([
        np.stack([a + j, b + j, b + following], axis=-1), np.stack([a + j, b + following, a + following], axis=-1),
    ])
    return points.reshape(-1, 3), normals.reshape(-1, 3), triangles


def ring_triangles(rings, sides):
    """Triangles between a pole, rings of vertices, and the other pole."""
    side = np.arange(sides)
    following = (side + 1) % sides
    last = 1 + (rings - 1) * sides
    faces = [np.stack([np.zeros_like(side), 1 + following, 1 + side], axis=-1)]
    for ring in range(rings - 1):
        a, b = 1 + ring * sides, 1 + (ring + 1) * sides
        faces.append(np.stack([a + side, b + following, b + side], axis=-1))
        faces.append(np.stack([a + side, a + following, b + following], axis=-1))
    faces.append(np.stack([np.full_like(side, last + sides), last + side, last + following], axis=-1))
    return np.concatenate(faces)


def mean_normals(points, triangles):
    """Normals of a smooth mesh: means over the triangles of a vertex, weighted by area."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], faces)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def mirrored(shape):
    """A mesh and its mirror image in one."""
    points, normals, triangles = shape
    flip = np.array([-1, 1, 1])
    return (
        np.concatenate([points, points * flip]), np.concatenate([normals, normals * flip]),
        np.concatenate([triangles, triangles[:, ::-1] + len(points)]),
    )
