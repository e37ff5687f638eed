"""Body of the dancer in millimeters: shirt, trousers, shoes, arms. Sides are modeled on the right (+X) and mirrored."""
import numpy as np

from dancer.distance_field import (
    beyond, cut, ellipsoid, flattened, intersection, limb, on_both_sides, placed, ring, strand, union,
)
from dancer import parametric_mesh, skin_weights
from dancer.part import Part, solid
from dancer.skeleton import ALONG_ARM, FOREARM, SHOULDER, SIDES, UPPER_ARM

ELBOW = SHOULDER + UPPER_ARM * ALONG_ARM
SLEEVE_END = SHOULDER + 0.64 * UPPER_ARM * ALONG_ARM
WRIST = ELBOW + FOREARM * ALONG_ARM
# Across the arm, at its upper side.
ABOVE_ARM = np.array([-ALONG_ARM[1], ALONG_ARM[0], 0])
FORWARD = np.array([0, 0, -1])


def mirrored(field):
    return lambda points: field(points * (-1, 1, 1))


def torso():
    trunk = flattened(strand([(0, 69, 0), (0, 79, 0), (0, 87, 0)], [13.8, 11.8, 12.0]), (1, 1, 0.82))
    shoulders = on_both_sides(limb((4, 94, 0.5), (14, 93.4, 0.5), 5.2, 5.6))
    hem = flattened(ring((0, 62.8, 0), (0, 1, 0), 11.4, 2.2), (1, 1, 0.82))
    return union(1.2, cut(2.2, union(6, trunk, shoulders), beyond((0, 61.5, 0), (0, -1, 0))), hem)


def shirt():
    sleeve = limb(SHOULDER, ELBOW, 6.0, 6.4)
    return union(4, torso(), on_both_sides(cut(1.5, sleeve, beyond(SLEEVE_END, ALONG_ARM))))


def star():
    """Five rays on the chest."""
    (center,), (out,) = parametric_mesh.on_front(torso(), [(0, 84.5)])
    right = np.cross(out, (0, 1, 0))
    axes = np.array([right, np.cross(right, out), out])
    angles = np.radians(90 + 72 * np.arange(5))
    rays = [limb((0, 0, 0), (5.2 * np.cos(a), 5.2 * np.sin(a), -0.7), 2.1, 0.75) for a in angles]
    return placed(flattened(union(0.8, *rays), (1, 1, 0.8)), center - 0.3 * out, axes)


def arm():
    # It starts inside the sleeve, below what bends at the shoulder.
    upper = limb(SHOULDER + 0.42 * UPPER_ARM * ALONG_ARM, ELBOW, 4.2, 4.1)
    lower = strand([ELBOW, ELBOW + 0.35 * FOREARM * ALONG_ARM, WRIST], [4.1, 4.3, 3.3])
    return union(2, upper, lower)


def hand():
    wrist = limb(WRIST - 1.5 * ALONG_ARM, WRIST + 2 * ALONG_ARM, 3.2, 3.2)
    palm = placed(ellipsoid((0, 0, 0), (5.2, 3.0, 4.6)), WRIST + 4.2 * ALONG_ARM, (ALONG_ARM, ABOVE_ARM, FORWARD))
    fingers = [
        limb(
            WRIST + 6 * ALONG_ARM + across * FORWARD,
            WRIST + length * ALONG_ARM + 1.25 * across * FORWARD - 1.2 * ABOVE_ARM, 1.75, 1.5,
        )
        for across, length in ((-2.9, 10.2), (-0.95, 11.6), (1.0, 11.8), (2.9, 10.8))
    ]
    thumb = strand(
        [WRIST + length * ALONG_ARM + front * FORWARD for length, front in ((2, 2), (4.6, 5.2), (7.2, 6.2))],
        [2.2, 1.8, 1.45],
    )
    return union(1.2, wrist, palm, *fingers, thumb)


def trousers():
    seat = limb((-3.2, 62, 0), (3.2, 62, 0), 9.6, 9.6)
    course = [(7, 58, 0), (8.2, 46, -0.5), (8.3, 34.5, -0.8), (8.8, 23, 0.8), (9.1, 13, 1.5)]
    leg = cut(1.5, strand(course, [8.6, 7.5, 6.6, 6.9, 6.0]), beyond((9, 12.8, 0), (0, -1, 0)))
    leg = union(1, leg, ring((9.1, 14, 1.5), (0, 1, 0), 4.6, 1.9))
    return union(3, seat, union(1.5, leg, mirrored(leg)))


def shoe():
    instep = strand([(9.2, 7, 4.5), (9.5, 6.2, -3), (10, 5, -10)], [5.4, 5.2, 5.0])
    collar = limb((9.1, 7, 3), (9.1, 13, 2.2), 5.4, 5.2)
    toe_cap = ellipsoid((10, 5.2, -10), (6.4, 5, 5.6))
    return intersection(1, union(3, instep, collar, toe_cap), beyond((0, 2, 0), (0, 1, 0)))


def sole():
    """A slab with a round edge as wide as the shoe."""
    outline = union(3, limb((9.2, 1.9, 4.5), (9.6, 1.9, -3), 6.3, 6.2), limb((9.6, 1.9, -3), (10, 1.9, -10), 6.2, 6.9))
    bottom, top = beyond((0, 0, 0), (0, 1, 0)), beyond((0, 3.7, 0), (0, -1, 0))
    return intersection(1.6, outline, bottom, top)


def parts():
    collar = parametric_mesh.torus((0, 99.5, 0.3), (0, 1, -0.3), 6.4, 1.6, 24)
    cuff = parametric_mesh.torus(SLEEVE_END, ALONG_ARM, 5.0, 1.4, 20)
    # Covers the seam between arm and hand.
    sweatband = parametric_mesh.torus(WRIST - 1.5 * ALONG_ARM, ALONG_ARM, 3.0, 1.5, 16)
    result = [
        solid("shirt", "shirt", shirt(), 2.75, skin_weights.shirt),
        Part("collar", "white", collar, skin_weights.shirt),
        Part("sweatbands", "trim", parametric_mesh.mirrored(sweatband), skin_weights.arms),
        Part("cuffs", "white", parametric_mesh.mirrored(cuff), skin_weights.shirt),
        solid("star", "trim", star(), 1.15, skin_weights.shirt),
        solid("trousers", "trousers", trousers(), 2.85, skin_weights.trousers),
    ]
    for side, sign in SIDES.items():
        for name, material, field, cell, weights in (
            ("arm", "skin", arm(), 2.2, skin_weights.arm(side)),
            ("hand", "skin", hand(), 1.4, skin_weights.arm(side)),
            ("shoe", "shoes", shoe(), 2.35, skin_weights.shoe(side)),
            ("sole", "white", sole(), 2.4, skin_weights.shoe(side)),
        ):
            result.append(solid(f"{name} {side}", material, field if sign > 0 else mirrored(field), cell, weights))
    return result
