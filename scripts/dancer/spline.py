"""Smooth curves: through points in space, and through values at times."""
import numpy as np


def through(points, parts):
    """Rows of a curve through points (n, k), each span in some parts (E. Catmull and R. Rom, 1974)."""
    points = np.asarray(points, float)
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    rows = []
    for i in range(len(points) - 1):
        a, b, c, d = padded[i:i + 4]
        for t in np.arange(parts) / parts:
            rows.append(b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))))
    return np.array([*rows, points[-1]])


def slopes(times, values):
    """Slopes at keys that never overshoot, zero at both ends (F. N. Fritsch and J. Butland, 1984)."""
    steps = np.diff(times)[:, None]
    secants = np.diff(values, axis=0) / steps
    result = np.zeros_like(values)
    before, after = secants[:-1], secants[1:]
    first, second = steps[:-1] + 2 * steps[1:], 2 * steps[:-1] + steps[1:]
    same = before * after > 0
    safe = np.where(same, 1, np.nan)
    mean = (first + second) / (second / (before * safe) + first / (after * safe))
    result[1:-1] = np.where(same, mean, 0)
    return result


def at_times(keys, moments):
    """Values (n, k) at moments of a curve through keys (time, value), which rests before and after them."""
    times = np.array([key[0] for key in keys], float)
    values = np.array([np.atleast_1d(key[1]) for key in keys], float)
    if len(keys) == 1:
        return np.repeat(values, len(moments), axis=0)
    tangents = slopes(times, values)
    moments = np.clip(moments, times[0], times[-1])
    span = np.clip(np.searchsorted(times, moments, "right") - 1, 0, len(times) - 2)
    length = (times[span + 1] - times[span])[:, None]
    t = (moments - times[span])[:, None] / length
    # Cubic Hermite polynomial.
    return (
        (1 + 2 * t) * (1 - t) ** 2 * values[span] + t * t * (3 - 2 * t) * values[span + 1]
        + t * (1 - t) ** 2 * length * tangents[span] + t * t * (t - 1) * length * tangents[span + 1]
    )
