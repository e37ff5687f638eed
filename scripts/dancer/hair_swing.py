"""How the ponytail swings: a damped pendulum of two links that the moving head drags along.

Rotations (n, 3, 3) and positions (n, 3) of the head enter, frames being evenly spaced in time; angles of both links
leave.
"""
import numpy as np

from dancer.rotation import about, applied

# Of the pendulum: swings for each beat, damping (1 is critical), and degrees for an acceleration of the head by one
# millimeter in the square of a 24th beat.
FREQUENCY, DAMPING, DRIVE = 1.8, 0.35, 22.0
MAX_ANGLE = 34
# The tip swings later and farther than the root.
TIP_LAG, TIP_GAIN = 2, 1.2
# Each averages neighboring frames.
SOFTENINGS = 2
# The pendulum runs this often through a clip, so that it has no beginning.
ROUNDS = 4
# Where it is felt, relative to the head's joint, in millimeters.
HANGS_AT = np.array([0, 15, 32])


def swing(rotation, position, frames_per_beat):
    """Angles back (about X) and right (about Z) in degrees (n, 2), alike in the first and the last frame."""
    path = position + applied(rotation, HANGS_AT)
    path = path[:-1]
    acceleration = np.roll(path, -1, axis=0) - 2 * path + np.roll(path, 1, axis=0)
    # As the head feels it.
    felt = applied(rotation[:-1].transpose(0, 2, 1), acceleration) * (frames_per_beat / 24) ** 2
    # The strands give way first, so that a jerk comes through softly.
    for _ in range(SOFTENINGS):
        felt = (np.roll(felt, 1, axis=0) + 2 * felt + np.roll(felt, -1, axis=0)) / 4
    stiffness, step = (2 * np.pi * FREQUENCY) ** 2, 1 / frames_per_beat
    angle, speed = np.zeros(2), np.zeros(2)
    angles = np.zeros((len(felt), 2))
    for _ in range(ROUNDS):
        for frame, (x, y, z) in enumerate(felt):
            # Upward acceleration presses it down, sideward acceleration leaves it behind.
            force = DRIVE * np.array([z - 0.6 * y, -x])
            speed = speed + step * (stiffness * (force - angle) - 2 * DAMPING * np.sqrt(stiffness) * speed)
            angle = angle + step * speed
            angles[frame] = angle
    limited = MAX_ANGLE * np.tanh(angles / MAX_ANGLE)
    return np.concatenate([limited, limited[:1]])


def links(rotation, position, frames_per_beat, window):
    """Rotations of the ponytail's root and tip against their parents; a window (n,) lets them rest at the ends."""
    angles = swing(rotation, position, frames_per_beat)
    late = np.roll(angles[:-1], TIP_LAG, axis=0)
    late = TIP_GAIN * np.concatenate([late, late[:1]])
    result = []
    for link in (angles, late - 0.6 * angles):
        back, right = (link * window[:, None]).T
        result.append(about("z", right) @ about("x", -back))
    return result
