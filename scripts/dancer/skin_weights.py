"""Weights with which the joints carry a vertex: linear blend skinning, four joints at most, sums of one.

Weight runs from a part's first joint outward: at each further joint, a smooth fraction passes on. The fraction grows
from 0 to 1 over a width along a direction through the joint, and, for a limb beside the trunk, falls to 0 away from
the limb's axis.
"""
import numpy as np

from dancer.skeleton import NAMES, POSITIONS, SIDES, sided

MAX_JOINTS = 4


def smooth_step(low, high, x):
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def passed_on(points, joint, towards, width, reach=None):
    """Fraction of the weight that passes a joint on its way along a direction."""
    offset = points - POSITIONS[NAMES.index(joint)]
    direction = np.asarray(towards, float) / np.linalg.norm(towards)
    along = offset @ direction
    fraction = smooth_step(-width, width, along)
    if reach is not None:
        aside = np.linalg.norm(offset - along[:, None] * direction, axis=1)
        fraction = fraction * (1 - smooth_step(reach, 1.8 * reach, aside))
    return fraction


class Flow:
    """Weights of all joints at some points, at first all with one joint."""

    def __init__(self, points, joint):
        self.points = points
        self.weights = np.zeros((len(points), len(NAMES)))
        self.weights[:, NAMES.index(joint)] = 1

    def on(self, parent, joint, towards, width, reach=None, within=1):
        """Lets a fraction of the parent's weight pass, less where `within` is below 1."""
        fraction = within * passed_on(self.points, joint, towards, width, reach)
        moved = self.weights[:, NAMES.index(parent)] * fraction
        self.weights[:, NAMES.index(joint)] += moved
        self.weights[:, NAMES.index(parent)] -= moved
        return self


def direction(start, end):
    return POSITIONS[NAMES.index(end)] - POSITIONS[NAMES.index(start)]


def with_one(joint):
    return lambda points: Flow(points, joint).weights


def head(points):
    flow = Flow(points, "chest").on("chest", "neck", (0, 1, 0), 4)
    return flow.on("neck", "head", (0, 1, -0.3), 5).weights


def shirt(points):
    flow = Flow(points, "hips").on("hips", "spine", (0, 1, 0), 6).on("spine", "chest", (0, 1, 0), 7)
    flow.on("chest", "neck", (0, 1, 0), 5)
    for side in SIDES:
        shoulder, upper = sided("shoulder", side), sided("upper_arm", side)
        flow.on("chest", shoulder, direction(shoulder, upper) * (1, 0, 0), 5, reach=6)
        outward = direction(upper, sided("forearm", side))
        for source in ("chest", shoulder):
            flow.on(source, upper, outward, 6.5, reach=7)
    return flow.weights


def arm(side):
    upper, lower, hand = (sided(name, side) for name in ("upper_arm", "forearm", "hand"))

    def weights(points):
        along = direction(upper, lower)
        return Flow(points, upper).on(upper, lower, along, 5).on(lower, hand, along, 3).weights

    return weights


def arms(points):
    return np.where(points[:, :1] < 0, arm("left")(points), arm("right")(points))


def trousers(points):
    flow = Flow(points, "hips")
    for side, sign in SIDES.items():
        thigh, shin, foot = (sided(name, side) for name in ("thigh", "shin", "foot"))
        # Each thigh carries its own half.
        flow.on("hips", thigh, (0, -1, 0), 7, within=smooth_step(-2.5, 2.5, sign * points[:, 0]))
        flow.on(thigh, shin, direction(thigh, foot), 6).on(shin, foot, direction(shin, foot), 3)
    return flow.weights


def shoe(side):
    foot, toes = sided("foot", side), sided("toes", side)
    return lambda points: Flow(points, foot).on(foot, toes, (0, 0, -1), 3).weights


def ponytail(points):
    flow = Flow(points, "head").on("head", "ponytail", (0, 0, 1), 2.5)
    return flow.on("ponytail", "ponytail_tip", (0, -1, 0), 8).weights


def strongest(weights):
    """Joint numbers and weights (n, 4) of the strongest joints, the sums back to one."""
    numbers = np.argsort(-weights, axis=1, kind="stable")[:, :MAX_JOINTS]
    kept = np.take_along_axis(weights, numbers, axis=1)
    kept[kept < 1e-3] = 0
    numbers[kept == 0] = 0
    return numbers, kept / kept.sum(axis=1, keepdims=True)
