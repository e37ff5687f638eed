"""Head of the dancer in millimeters: face, hair with a ponytail, headphones. She faces −Z."""
import numpy as np

from dancer import skin_weights
from dancer.distance_field import (
    ball, beyond, cut, ellipsoid, intersection, limb, on_both_sides, strand, union,
)
from dancer.parametric_mesh import mirrored, patch, torus, tube, tube_on
from dancer.part import Part, solid

FACE = union(
    5,
    ellipsoid((0, 123, 0), (20, 19, 18.5)),
    on_both_sides(ball((8.5, 114.5, -7.5), 9.3)),
    ellipsoid((0, 108.5, -9.5), (6, 4.5, 6)),
)


def skin():
    nose = ball((0, 117, -17.6), 1.5)
    ears = on_both_sides(ellipsoid((19.6, 119.5, 1), (2.2, 4, 3)))
    neck = limb((0, 94, 1.5), (0, 108, 1), 5.4, 4.8)
    # The hair hides the back.
    return intersection(2, union(2, FACE, nose, ears, neck), beyond((0, 0, 8), (0, 0, -1)))


def hair():
    cap = ellipsoid((0, 126, 2), (22, 21, 21.5))
    face = ellipsoid((0, 112.5, -23), (20, 19.5, 17.5))
    below = beyond((0, 107, 6), (0, -1, 0.5))
    crown = cut(3, cap, face, below)
    # Bangs are combed from a parting on her right to both sides.
    bangs = [
        strand([(7, 144, -9), (-5, 142, -14.5), (-15, 134.5, -14.5), (-20.3, 122, -9)], [4, 5.2, 4.6, 1.3]),
        strand([(7, 144, -9), (1, 141.5, -16.2), (-7, 136, -18.6), (-14, 130.5, -16.2)], [4, 4.6, 3.8, 1.3]),
        strand([(8, 144, -8), (14, 140, -11.5), (18, 132.5, -11.5), (20.3, 122, -8.5)], [4, 4.6, 4, 1.3]),
    ]
    # A lock in front of each ear.
    locks = on_both_sides(strand([(20, 128, -6), (20.8, 118, -7.5), (19, 107.5, -10)], [3.4, 2.9, 1.1]))
    root = ball((0, 138.5, 17), 5)
    return union(2.5, union(2.5, crown, locks, root), union(2, *bangs))


def ponytail():
    curve = [(0, 139, 18), (0, 142, 25), (0, 137, 33.5), (0, 126, 38), (0, 115, 37), (0, 105, 41)]
    lobe = strand(curve, [3.6, 6, 8, 7.6, 5.2, 1.1])
    side = on_both_sides(strand([(1, 128, 35), (4.5, 117, 34.5), (7.5, 105.5, 39.5)], [6, 4.2, 1.1]))
    return union(2, lobe, side)


def headband():
    angles = np.radians(np.linspace(0, 180, 33))
    points = np.array([0, 122, 1]) + 24.8 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    return tube(points, np.tile((0.0, 0.0, 1.0), (len(points), 1)), np.full(len(points), 1.7))


def ear_cups():
    return on_both_sides(intersection(2, ellipsoid((22.5, 121, 1), (5.5, 8, 8)), beyond((21, 0, 0), (1, 0, 0))))


def features():
    """Name, material, and shape of what lies on the right half of the face."""
    smile = np.radians(np.linspace(0, 60, 5))
    mouth = np.column_stack([5 * np.sin(smile), 115.0 - 3.8 * np.cos(smile)])
    # From mirror to mirror, so that it is one tube.
    mouth = np.concatenate([mouth[:0:-1] * (-1, 1), mouth])
    eye, glint = (8.2, 120.4), (7.0, 122.6)
    return [
        ("eyes", "eyes", mirrored(patch(FACE, eye, (3.3, 4.7), 0.45))),
        ("irises", "shoes", mirrored(patch(FACE, (eye[0], eye[1] - 1.5), (2.2, 2.4), 0.25, 0.35))),
        ("glints", "white", mirrored(patch(FACE, glint, (1.15, 1.4), 0.25, 0.5))),
        ("low glints", "white", mirrored(patch(FACE, (9.5, 118.1), (0.65, 0.75), 0.25, 0.55))),
        ("cheeks", "lips", mirrored(patch(FACE, (12.4, 114.6), (2.5, 1.5), 0.2, tilt=8))),
        ("mouth", "lips", tube_on(FACE, mouth, [0.35, 0.5, 0.65, 0.75, 0.8, 0.75, 0.65, 0.5, 0.35], 0.1)),
        ("lashes", "eyes", mirrored(tube_on(
            FACE, [(4.6, 123.0), (6.2, 124.9), (8.4, 125.6), (10.8, 124.7), (12.2, 123.2), (13.6, 124.0)],
            [0.25, 0.6, 0.8, 0.85, 0.7, 0.2], 0.3,
        ))),
        ("brows", "hair", mirrored(tube_on(FACE, [(4.8, 127.7), (8.0, 128.2), (11.4, 126.9)], [0.5, 0.65, 0.3], 0.15))),
    ]


def parts():
    carried = skin_weights.with_one("head")
    tie = torus((0, 140.3, 20.5), (0, 0.3, 1), 3.9, 1.7, 16)
    cushions = mirrored(torus((21.2, 121, 1), (1, 0, 0), 5.2, 2.1, 16))
    return [
        solid("face", "skin", skin(), 2.5, skin_weights.head),
        *(Part(name, material, shape, carried) for name, material, shape in features()),
        solid("hair", "hair", hair(), 2.55, carried),
        solid("ponytail", "hair", ponytail(), 2.5, skin_weights.ponytail),
        Part("hair tie", "trim", tie, carried),
        Part("headband", "trim", headband(), carried),
        solid("ear cups", "trim", ear_cups(), 2.1, carried),
        Part("cushions", "white", cushions, carried),
    ]
