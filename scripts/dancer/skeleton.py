"""Joints of the dancer in the pose in which she is modeled: upright, arms 40° below the horizontal, facing −Z.

Positions are in millimeters from the ground between the feet, +Y up; left is her own left, −X. In this pose no joint is
turned, so that the rotation of a joint in the figure's frame is the rotation of all that hangs on it.
"""
import math

import numpy as np

ARM_ANGLE = math.radians(40)
UPPER_ARM, FOREARM = 20.5, 19.0

# Name: parent, position. Parents come first.
CENTRAL = {
    "hips": (None, (0, 62, 0)),
    "spine": ("hips", (0, 70, 0)),
    "chest": ("spine", (0, 80, 0)),
    "neck": ("chest", (0, 99, 1)),
    "head": ("neck", (0, 106, 1)),
    "ponytail": ("head", (0, 139, 18)),
    "ponytail_tip": ("ponytail", (0, 128, 33)),
}
SHOULDER = np.array([14.5, 94, 0.5])
ALONG_ARM = np.array([math.cos(ARM_ANGLE), -math.sin(ARM_ANGLE), 0])
RIGHT = {
    "shoulder": ("chest", (5, 95, 0.5)),
    "upper_arm": ("shoulder", SHOULDER),
    "forearm": ("upper_arm", SHOULDER + UPPER_ARM * ALONG_ARM),
    "hand": ("forearm", SHOULDER + (UPPER_ARM + FOREARM) * ALONG_ARM),
    "thigh": ("hips", (7.5, 59, 0)),
    "shin": ("thigh", (8.3, 34.5, -0.6)),
    "foot": ("shin", (9, 10, 1.5)),
    "toes": ("foot", (9.5, 3, -7)),
}
SIDES = {"left": -1, "right": 1}


def sided(name, side):
    return f"{name}_{side}" if name in RIGHT else name


def joints():
    """Name → (parent, position) of all joints, parents first."""
    result = {name: (parent, np.array(at, float)) for name, (parent, at) in CENTRAL.items()}
    for side, sign in SIDES.items():
        for name, (parent, at) in RIGHT.items():
            result[sided(name, side)] = (sided(parent, side), np.array(at, float) * (sign, 1, 1))
    return result


JOINTS = joints()
NAMES = list(JOINTS)
PARENTS = [NAMES.index(parent) if parent else -1 for parent, _ in JOINTS.values()]
POSITIONS = np.array([at for _, at in JOINTS.values()])


def offsets():
    """Position of each joint relative to its parent."""
    return np.array([at - (POSITIONS[parent] if parent >= 0 else 0) for at, parent in zip(POSITIONS, PARENTS)])
