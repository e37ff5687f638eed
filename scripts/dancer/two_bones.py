"""Inverse kinematics of two bones, an arm or a leg: how both turn so that the end reaches a target.

All vectors are (n, 3) for n frames, lengths in millimeters. The triangle of both bones and the span follows from the
law of cosines.
"""
import numpy as np

# Of both lengths: a limb never stretches out straight, where its hinge would flip.
LONGEST = 0.996


def unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def frames(along, hinge):
    """Rotations whose columns are the bone's direction, its hinge, and the third axis."""
    along = unit(along)
    hinge = unit(hinge - (hinge * along).sum(axis=-1, keepdims=True) * along)
    return np.stack([along, hinge, np.cross(along, hinge)], axis=-1)


def solve(start, target, bones, middle_towards):
    """Directions of both bones, and how far the end stays from the target."""
    upper, lower = (np.linalg.norm(bone) for bone in bones)
    span = target - start
    wanted = np.linalg.norm(span, axis=1, keepdims=True)
    distance = np.clip(wanted, abs(upper - lower) + 0.5, LONGEST * (upper + lower))
    along = span / np.maximum(wanted, 1e-9)
    aside = unit(middle_towards - (middle_towards * along).sum(axis=1, keepdims=True) * along)
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    first = upper * (cosine * along + np.sqrt(1 - cosine**2) * aside)
    return first, distance * along - first, np.abs(wanted - distance)[:, 0]


def rotations(start, target, bones, hinge, middle_towards):
    """Rotations of both bones in the frame of start and target, and the miss.

    `bones` and `hinge` are the bones and the axis of flexion of the modeled pose.
    """
    first, second, miss = solve(start, target, bones, middle_towards)
    flexion = np.cross(first, second)
    modeled = [frames(np.asarray(bone, float), np.asarray(hinge, float)) for bone in bones]
    return frames(first, flexion) @ modeled[0].T, frames(second, flexion) @ modeled[1].T, miss
