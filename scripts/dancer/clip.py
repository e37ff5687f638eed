"""Turns the keys of a dance move into a clip: rotations of all joints and places of the hips, frame by frame.

Time is in beats. The first and the last frame are alike: the pose at rest, with the one exception of a full turn's
sign.
"""
from typing import NamedTuple

import numpy as np

from dancer import hair_swing
from dancer.pose import REST, Pose
from dancer.rotation import quaternions
from dancer.skin_weights import smooth_step
from dancer.spline import at_times

FRAMES_PER_BEAT = 24
# The ponytail starts to swing and comes to rest over these beats.
SWING_IN, SWING_OUT = 0.15, 0.25


class Clip(NamedTuple):
    name: str
    times: np.ndarray
    # Of the hips, in millimeters.
    places: np.ndarray
    # By joint, quaternions (n, 4).
    rotations: dict
    pose: Pose


def channels(move, beats, times):
    """Values of all channels at times; a channel without keys rests."""
    result = {}
    for name, rest in REST.items():
        keys = move.get(name, [])
        if keys and keys[0][0] > 0:
            keys = [(0, rest), *keys]
        if keys and keys[-1][0] < beats:
            keys = [*keys, (beats, rest)]
        result[name] = at_times(keys or [(0, rest)], times)
    return result


def clip(name, beats, move, swings_on=False):
    """Clip of some beats. `swings_on` lets the hair swing through the loop's ends."""
    times = np.arange(beats * FRAMES_PER_BEAT + 1) / FRAMES_PER_BEAT
    pose = Pose(channels(move, beats, times))
    window = smooth_step(0, SWING_IN, times) * (1 - smooth_step(beats - SWING_OUT, beats, times))
    window = np.ones_like(times) if swings_on else window
    local = pose.local()
    local["ponytail"], local["ponytail_tip"] = hair_swing.links(
        pose.rotation["head"], pose.position["head"], FRAMES_PER_BEAT, window
    )
    return Clip(name, times, pose.hips(), {joint: quaternions(turns) for joint, turns in local.items()}, pose)
