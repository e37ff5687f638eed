"""A sky with broken clouds and a low sun, as an equirectangular image in a Radiance file (`.hdr`, Ward 1991).

Enters: direction to the sun. Leaves: linear radiance, in which a bright cloud is about 1, twice as wide as high;
column ÷ width is the azimuth from −Z towards +X, rows run from +Y down, as in the crate's environment maps. Below the
horizon haze goes over into the mean color of grass.
"""
import numpy as np

from scenes.noise import fractal_noise, smoothstep

ZENITH, HORIZON, AWAY = (0.026, 0.050, 0.125), (0.60, 0.34, 0.19), (0.085, 0.095, 0.155)
GLOW, SUN_COLOR = (1.5, 0.62, 0.17), (1.0, 0.62, 0.32)
CLOUD_SHADE, CLOUD_LIGHT = (0.034, 0.035, 0.052), (1.25, 0.56, 0.25)
GRASS, HAZE = (0.045, 0.05, 0.022), (0.21, 0.16, 0.13)
# Irradiance that the sun gives to a surface that faces it, and the radius of its bell-shaped disc, large enough for the
# image to show it.
SUN_IRRADIANCE, SUN_RADIUS = 8.0, np.radians(0.5)


def mixed(start, end, weight):
    return start + (np.asarray(end) - start) * np.asarray(weight)[..., None]


def directions(width):
    """Unit vectors to the centers of the pixels, row by row."""
    height = width // 2
    azimuth = (np.arange(width) + 0.5) / width * 2 * np.pi
    polar = (np.arange(height) + 0.5)[:, None] / height * np.pi
    ring = np.sin(polar)
    upward = np.cos(polar) + 0 * azimuth
    return np.stack([ring * np.sin(azimuth), upward, -ring * np.cos(azimuth)], -1).reshape(-1, 3)


def cloud_cover(points, seed):
    """0 between clouds, 1 inside, for places on the layer of clouds."""
    bent = points + 0.35 * np.stack([fractal_noise(points * 1.3, seed + i, 3) for i in (1, 2, 3)], 1)
    return smoothstep(-0.2, 0.4, fractal_noise(bent * (0.75, 1.0, 1.15), seed, 6) + 0.06)


def sky_radiance(view, to_sun, seed=5):
    """Linear radiance of the sky in all viewing directions."""
    to_sun = np.asarray(to_sun, float) / np.linalg.norm(to_sun)
    upward, toward_sun = view[:, 1], view @ to_sun
    level = np.hypot(view[:, 0], view[:, 2])
    beside = (view[:, [0, 2]] @ to_sun[[0, 2]]) / np.maximum(level, 1e-6) / np.linalg.norm(to_sun[[0, 2]])
    sunward = (0.5 + 0.5 * beside) ** 2
    low = np.exp(-np.maximum(upward, 0) / 0.16)
    air = mixed(np.tile(ZENITH, (len(view), 1)), mixed(np.tile(AWAY, (len(view), 1)), HORIZON, sunward), low)
    halo = np.exp((toward_sun - 1) / 0.012) + 0.30 * np.exp((toward_sun - 1) / 0.12)
    air += np.outer(halo, GLOW)
    # a layer of clouds, seen from below, that comes down to the horizon far away
    above = np.maximum(upward, 0.0) + 0.10
    points = np.stack([view[:, 0] / above, np.zeros(len(view)), view[:, 2] / above], 1) * 1.15
    cover = cloud_cover(points, seed) * smoothstep(-0.01, 0.06, upward)
    # a cloud is bright where the layer is thinner towards the sun
    beside_it = cloud_cover(points + 0.16 * np.array([to_sun[0], 0, to_sun[2]]), seed)
    lit = np.clip(0.18 + 1.25 * (cover - beside_it), 0, 1) * (0.25 + 0.75 * sunward)
    lining = 1.2 * (1 - cover) * np.exp((toward_sun - 1) / 0.10)
    lining += 0.3 * (1 - 0.6 * low) * np.exp((toward_sun - 1) / 0.45)
    cloud = mixed(np.tile(CLOUD_SHADE, (len(view), 1)), CLOUD_LIGHT, np.clip(0.75 * lit + 0.5 * lining, 0, 1.3))
    cloud = mixed(cloud, HORIZON, 0.3 * low * sunward)
    sky = mixed(air, cloud, 0.94 * cover ** 0.8)
    disc = np.exp(-2 * (1 - toward_sun) / SUN_RADIUS ** 2)
    sky += np.outer(disc * SUN_IRRADIANCE / (np.pi * SUN_RADIUS ** 2), SUN_COLOR)
    below = mixed(np.tile(HAZE, (len(view), 1)), GRASS, smoothstep(0.0, -0.14, upward))
    return np.where(upward[:, None] < 0, below, sky)


def run_lengths(row):
    """One channel of a row, run-length encoded as Radiance files have it."""
    out, start = bytearray(), 0
    while start < len(row):
        end = start
        while end < len(row) and row[end] == row[start] and end - start < 127:
            end += 1
        if end - start > 2:
            out += bytes((128 + end - start, row[start]))
        else:
            end = start + 1
            while end < len(row) and end - start < 128 and len(set(row[end:end + 3])) > 1:
                end += 1
            out += bytes((end - start,)) + row[start:end]
        start = end
    return out


def write_sky(path, width, to_sun):
    """Writes the file; returns the mean radiance of the upper half."""
    view = directions(width)
    radiance = sky_radiance(view, to_sun)
    exponent = np.ceil(np.log2(radiance.max(1)))
    mantissas = np.clip(radiance * np.exp2(8 - exponent)[:, None], 0, 255)
    pixels = np.hstack([mantissas, exponent[:, None] + 128]).astype(np.uint8).reshape(width // 2, width, 4)
    with open(path, "wb") as file:
        file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {width // 2} +X {width}\n".encode())
        for row in pixels:
            file.write(bytes((2, 2, width >> 8, width & 255)))
            for channel in range(4):
                file.write(run_lengths(row[:, channel].tobytes()))
    up = view[:, 1] > 0
    return radiance[up].mean(0)
