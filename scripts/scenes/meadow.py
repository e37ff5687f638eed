"""A meadow: a disc of short grass with gentle relief, worn around stones and paths, and tufts to be put on it.

Enter: places and radii of stones in meters, x and z. Leave: positions, triangles, normals and linear colors. The
meadow is level with y = 0 where the dancer stands.
"""
import numpy as np

from scenes.noise import fractal_noise, smoothstep
from scenes.rocks import smooth_normals

# Linear colors.
GREEN, DRY, EARTH = (0.062, 0.085, 0.022), (0.145, 0.132, 0.046), (0.105, 0.078, 0.048)
SHADE = (0.018, 0.022, 0.010)
# Radii in meters: the dancer's level ground, the end of its slope, the henge's ditch and bank, the edge of the disc.
STAGE, SLOPE, DITCH, BANK, EDGE = 3.2, 9.0, 53.0, 48.0, 170.0
# Distance up to which the grain of a texture has its true size.
FINE = 9.0
SECTORS, RINGS = 132, 80


def ground_height(x, z):
    """Height of the meadow in meters."""
    x, z = np.broadcast_arrays(np.asarray(x, float), np.asarray(z, float))
    shape, radius = x.shape, np.hypot(x, z).ravel()
    places = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], 1)
    gentle = 0.22 * fractal_noise(places / 9.0, 70, 3) * smoothstep(STAGE, SLOPE, radius)
    henge = 0.5 * np.exp(-((radius - BANK) / 2.5) ** 2) - 0.8 * np.exp(-((radius - DITCH) / 2.5) ** 2)
    far = 6.0 * (0.3 + fractal_noise(places / 90.0, 71, 3)) * smoothstep(60.0, EDGE, radius)
    return (gentle + henge + far).reshape(shape)


def wear_at(x, z):
    """0…1: how bare the ground is where people walk: the stage and a path around it."""
    radius = np.hypot(x, z)
    places = np.stack([x, 0 * x, z], 1)
    uneven = 0.6 * fractal_noise(places / 1.1, 72, 4)
    stage = 0.8 * smoothstep(2.9, 1.2, radius + 1.4 * uneven)
    path = 0.75 * smoothstep(1.0, 0.2, np.abs(radius - 10.3 + uneven))
    return np.clip(np.maximum(stage, path), 0, 1)


def meadow(stones):
    """The disc, with texture coordinates in meters; `stones` are rows of x, z and radius of what is on it."""
    step = 2 * np.pi / SECTORS
    radii = 0.5 * (EDGE / 0.5) ** (np.arange(RINGS) / (RINGS - 1.0))
    angle, radius = np.meshgrid(np.arange(SECTORS) * step, radii)
    angle = angle + step / 2 * (np.arange(RINGS) % 2)[:, None]
    x = np.append(radius * np.sin(angle), 0.0)
    z = np.append(radius * np.cos(angle), 0.0)
    points = np.stack([x, ground_height(x, z), z], 1)
    ring, sector = (grid.ravel() for grid in np.mgrid[0:RINGS - 1, 0:SECTORS])
    following = (sector + 1) % SECTORS
    a, b = ring * SECTORS + sector, ring * SECTORS + following
    c, d = a + SECTORS, b + SECTORS
    odd = (ring % 2 == 1)[:, None]
    first = np.where(odd, np.stack([a, c, d], 1), np.stack([a, c, b], 1))
    second = np.where(odd, np.stack([a, d, b], 1), np.stack([b, c, d], 1))
    inner = np.arange(SECTORS)
    middle = np.stack([np.full(SECTORS, len(points) - 1), inner, (inner + 1) % SECTORS], 1)
    triangles = np.concatenate([first, second, middle])
    normals = smooth_normals(points, triangles)
    # The grain of a texture becomes coarser far away, as texels would flicker there.
    far = np.maximum(np.hypot(x, z) / FINE, 1.0)
    shrink = (1 + np.log(far)) / far
    return points, triangles, normals, meadow_colors(points, stones), points[:, [0, 2]] * shrink[:, None]


def meadow_colors(points, stones):
    """Green and dry grass in patches, earth where it is worn, dark where a stone keeps the light away."""

    def mixed(colors, target, weight):
        return colors + (np.asarray(target) - colors) * np.clip(weight, 0, 1)[:, None]

    flat = points * (1, 0, 1)
    dry = 0.42 + 0.7 * fractal_noise(flat / 6.0, 73, 3) + 0.5 * fractal_noise(flat / 0.9, 74, 2)
    colors = mixed(np.tile(GREEN, (len(points), 1)), DRY, dry)
    colors = mixed(colors, EARTH, 0.85 * wear_at(points[:, 0], points[:, 2]))
    colors *= np.clip(1 + 0.5 * fractal_noise(flat / 0.45, 75, 2), 0.5, 1.5)[:, None]
    for x, z, radius in stones:
        away = np.hypot(points[:, 0] - x, points[:, 2] - z)
        colors = mixed(colors, EARTH, 0.6 * smoothstep(radius + 0.9, radius, away))
        colors = mixed(colors, SHADE, 0.75 * smoothstep(radius + 0.45, radius - 0.4, away))
    return colors


def tree_line():
    """Trees far away around the edge of the meadow: positions, triangles, normals."""
    count = 700
    angle = np.arange(count) / count * 2 * np.pi
    circle = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], 1)
    woods = smoothstep(-0.25, 0.35, fractal_noise(circle * 2.2, 76, 2))
    tall = 0.7 + woods * (3.6 + 1.6 * fractal_noise(circle * 30.0, 77, 4))
    foot = circle * (EDGE - 2)
    base = ground_height(foot[:, 0], foot[:, 2])[:, None] * (0, 1, 0)
    points = np.concatenate([foot + base - (0, 1.5, 0), foot + base + tall[:, None] * (0, 1, 0)])
    a, b = np.arange(count), (np.arange(count) + 1) % count
    triangles = np.concatenate([np.stack([a, a + count, b], 1), np.stack([b, a + count, b + count], 1)])
    normals = np.tile((0.5 * np.array([0, 1, 0]) - circle) / np.sqrt(1.25), (2, 1))
    return points, triangles, normals


def tuft(blades, spread, height, seed):
    """Blades of grass about the origin, each a triangle seen from both sides: positions, triangles, normals, colors."""
    random = np.random.default_rng(seed)
    # in bunches
    bunches = spread * random.normal(0, 0.45, (max(blades // 9, 1), 2))
    root = bunches[np.arange(blades) % len(bunches)] + random.normal(0, 0.07, (blades, 2))
    root = np.stack([root[:, 0], np.full(blades, -0.04), root[:, 1]], 1)
    facing = random.uniform(0, 2 * np.pi, blades)
    across = 0.013 * np.stack([np.cos(facing), 0 * facing, np.sin(facing)], 1)
    lean = np.stack([-np.sin(facing), 0 * facing, np.cos(facing)], 1) * random.normal(0, 0.4, blades)[:, None]
    tall = height * random.uniform(0.4, 1.2, blades)[:, None]
    up = np.array([0, 1, 0])
    points = np.concatenate([root - across, root + across, root + tall * (up + lean)])
    front = np.arange(3 * blades).reshape(3, blades).T
    triangles = np.concatenate([front, front[:, ::-1]])
    # Normals like those of the ground keep grass as bright as the meadow around it.
    normals = np.tile(up, (len(points), 1)) + 0.35 * np.tile(lean, (3, 1))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tint = np.asarray(GREEN) + (np.asarray(DRY) - GREEN) * random.uniform(0, 0.8, (blades, 1))
    bright = np.repeat([0.35, 0.35, 1.7], blades)[:, None]
    return points, triangles, normals, np.tile(tint, (3, 1)) * bright
