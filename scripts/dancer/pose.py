"""Poses of the dancer: what a dance says about hips, back, head, hands, and feet enters, rotations of all joints leave.

Lengths are in millimeters, angles in degrees. Positive numbers lead left for the trunk's angles, right for the hips'
place (+X), and outward for each hand and foot, so that a mirrored pose needs few changes of sign.
"""
import numpy as np

from dancer import two_bones
from dancer.rotation import about, applied, fraction_of, leaning
from dancer.skeleton import NAMES, PARENTS, POSITIONS, SIDES, offsets, sided
from dancer.skin_weights import smooth_step

# Channel: value at rest.
TRUNK = {
    "hips": (0, -2, 0),  # right, up, front
    "hips_turn": (0, 0, 0),  # lean, turn, tilt
    "bend": (3, 0, 0),  # lean, turn, tilt of the back against the hips
    "head": (0, 0, 0),  # lean, turn, tilt
    "turn": (0,),  # of the whole figure to the left, about the ball of the left foot
}
LIMBS = {
    "hand": (11, -25, 9),  # out, up, front of the shoulder, in the chest's frame
    "elbow": (0.8, -0.4, -0.9),  # direction that the elbow points to
    "wrist": (0,),  # flexed inward
    "foot": (0, 0, 0),  # out, up, front of where it stands at rest
    "heel": (0,),  # up, about the ball; toes up, about the heel, below zero
    "toe_out": (8,),
}
REST = TRUNK | {f"{name}_{side}": value for name, value in LIMBS.items() for side in SIDES}

# Of the chest's rotation, how much neck and head take part in: the gaze stays ahead.
NECK_FOLLOWS, HEAD_FOLLOWS = 0.7, 0.35
# A hand above the shoulder raises it, in degrees for each millimeter.
SHRUG, MAX_SHRUG = 0.7, 18
# Toes let go of the ground over this height.
TOES_FREE = 5
HEEL_PIVOT = np.array([9.2, 0, 9.5])


def outward(vectors, sign):
    """Vectors (out, up, front) of a side in the figure's frame."""
    return np.asarray(vectors) * (sign, 1, -1)


class Pose:
    """Rotations of all joints in the figure's frame, and where the joints are, in n frames."""

    def __init__(self, channels):
        self.channels = channels
        self.rotation, self.position = {}, {}
        self.offset = dict(zip(NAMES, offsets()))
        # How far each hand and foot stays from where it should be.
        self.miss = {}
        self.trunk()
        for side, sign in SIDES.items():
            self.arm(side, sign)
            self.leg(side, sign)

    def attach(self, name, rotation):
        parent = NAMES[PARENTS[NAMES.index(name)]]
        self.rotation[name] = rotation
        self.position[name] = self.position[parent] + applied(self.rotation[parent], self.offset[name])

    def trunk(self):
        hips = leaning(self.channels["hips_turn"])
        half_bend = leaning(self.channels["bend"] / 2)
        self.rotation["hips"] = hips
        self.position["hips"] = POSITIONS[0] + self.channels["hips"] * (1, 1, -1)
        self.attach("spine", hips @ half_bend)
        chest = hips @ half_bend @ half_bend
        self.attach("chest", chest)
        self.attach("neck", fraction_of(chest, NECK_FOLLOWS))
        head = fraction_of(chest, HEAD_FOLLOWS) @ leaning(self.channels["head"])
        self.attach("head", head)
        self.attach("ponytail", head)
        self.attach("ponytail_tip", head)

    def arm(self, side, sign):
        shoulder, upper, lower, hand = (sided(name, side) for name in ("shoulder", "upper_arm", "forearm", "hand"))
        chest, place = self.rotation["chest"], self.channels[f"hand_{side}"]
        shrug = np.clip(SHRUG * (place[:, 1] + 10), 0, MAX_SHRUG)
        self.attach(shoulder, chest @ about("z", sign * shrug))
        self.attach(upper, self.rotation[shoulder])
        start = self.position[upper]
        bones = self.offset[lower], self.offset[hand]
        forward = np.array([0, 0, -1])
        first, second, self.miss[hand] = two_bones.rotations(
            start, start + applied(chest, outward(place, sign)), bones, np.cross(bones[0], forward),
            applied(chest, outward(self.channels[f"elbow_{side}"], sign)),
        )
        self.attach(upper, first)
        self.attach(lower, second)
        self.attach(hand, second @ about("y", sign * self.channels[f"wrist_{side}"][:, 0]))

    def leg(self, side, sign):
        thigh, shin, foot, toes = (sided(name, side) for name in ("thigh", "shin", "foot", "toes"))
        ankle, ball = (POSITIONS[NAMES.index(name)] for name in (foot, toes))
        place = outward(self.channels[f"foot_{side}"], sign)
        heel = self.channels[f"heel_{side}"][:, 0]
        yaw = about("y", -sign * self.channels[f"toe_out_{side}"][:, 0])
        turned = yaw @ about("x", -heel)
        on_ball = ball + applied(turned, ankle - ball)
        pivot = ball + applied(yaw, HEEL_PIVOT * (sign, 1, 1) - ball)
        on_heel = pivot + applied(turned, ankle - HEEL_PIVOT * (sign, 1, 1))
        target = place + np.where(heel[:, None] > 0, on_ball, on_heel)
        self.attach(thigh, self.rotation["hips"])
        bones = self.offset[shin], self.offset[foot]
        knee = applied(yaw @ fraction_of(self.rotation["hips"], 0.5), (0.12 * sign, 0, -1))
        first, second, self.miss[foot] = two_bones.rotations(self.position[thigh], target, bones, (-1, 0, 0), knee)
        self.attach(thigh, first)
        self.attach(shin, second)
        self.attach(foot, turned)
        flat = 1 - smooth_step(0, TOES_FREE, place[:, 1])
        self.attach(toes, turned @ about("x", np.maximum(heel, 0) * flat))

    def local(self):
        """Rotation of each joint against its parent (n, 3, 3), the whole figure's turn in the first."""
        result = {}
        for name, parent in zip(NAMES, PARENTS):
            above = self.rotation[NAMES[parent]].transpose(0, 2, 1) if parent >= 0 else self.whole_turn()
            result[name] = above @ self.rotation[name]
        return result

    def whole_turn(self):
        return about("y", self.channels["turn"][:, 0])

    def hips(self):
        """Where the hips are after the turn about the ball of the left foot, in millimeters."""
        pivot = POSITIONS[NAMES.index("toes_left")] * (1, 0, 1)
        return pivot + applied(self.whole_turn(), self.position["hips"] - pivot)
