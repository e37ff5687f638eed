"""The plan of Stonehenge as it stands today: which stone is where, how large, and which way it fell.

Leaves: rows of `Stone`, in meters, in the scene's frame: the origin is the monument's center, +Y up, +Z to the
south-east (`VIEW`). Stones have the numbers that Petrie (1880) gave them, clockwise from the axis, which points to
the north-east (his rules: stonesofstonehenge.org.uk). Seventeen of the thirty uprights stand, one of them a stump, and
six lintels are in place.

Measures, rounded, as they are commonly published: sarsen circle 33 m across outside and 29.7 m inside, its uprights
4.1 m high, 2.1 m wide and 1.1 m thick, lintels 3.2 × 1.1 × 0.8 m; trilithons 6.0, 6.5 and 7.3 m high with their
lintels, in a horseshoe 13.7 m across; bluestones in a circle of 24 m and a horseshoe 12 m across; heel stone 77 m from
the center, 4.7 m high. Leans, the turns of fallen stones and the sizes and places of single bluestones are invented;
none stands between the dancer and the default camera.
"""
import math
from dataclasses import dataclass

# Direction from the center, clockwise from the axis, that becomes +Z: towards the best preserved side.
VIEW = 86.0
SARSEN_RADIUS, UPRIGHT, LINTEL = 15.4, (2.1, 4.1, 1.1), (3.3, 0.8, 1.05)
STANDING = (1, 2, 3, 4, 5, 6, 7, 10, 16, 21, 22, 23, 27, 28, 29, 30)
# Each lintel by the first of the two uprights that it lies on: 130, 101, 102, 105, 107 and 122.
LINTELS_FROM = (29, 30, 1, 4, 6, 21)
# Fallen uprights: distance of the middle from the circle, in meters, and the turn from the radius.
FALLEN = {
    8: (-1.6, 12), 9: (1.9, -8), 12: (-2.2, 20), 14: (-2.0, -6), 15: (2.2, 15), 19: (1.7, -30),
    25: (1.6, 25), 26: (2.4, 5),
}
# Trilithons: name, direction of the middle, distance, turn of the face from the radius, heights of uprights and lintel.
TRILITHONS = (
    ("51-52", 62.0, 7.2, -20.0, 5.0, 1.0), ("53-54", 110.0, 6.7, 4.0, 5.5, 1.05),
    ("55-56", 180.0, 7.0, 0.0, 6.3, 1.0),
    ("57-58", 250.0, 6.7, -4.0, 5.5, 1.05), ("59-60", 298.0, 7.2, 20.0, 5.0, 1.0),
)
TRILITHON_WIDTH, TRILITHON_DEPTH, TRILITHON_GAP = 2.2, 1.2, 0.42
# Those of 49 evenly spaced places on the circle of bluestones that have a stone.
BLUESTONE_RADIUS = 11.9
BLUESTONES = (1, 3, 4, 6, 8, 9, 11, 12, 15, 18, 20, 23, 24, 26, 31, 32, 33, 34, 37, 39, 40, 46, 47, 49)
# Stones of the inner horseshoe: direction, distance and height.
INNER = (
    (118, 5.4, 2.1), (134, 5.3, 2.4), (150, 5.3, 2.5),
    (213, 5.3, 2.6), (229, 5.3, 2.3), (247, 5.4, 2.0), (266, 5.6, 1.8),
)
# The three parts of stone 59: direction, distance, turn from the radius and length.
PARTS_OF_59 = ((300, 5.7, 65, 2.4), (312, 4.6, 80, 1.7), (324, 5.4, 40, 1.5))


@dataclass
class Stone:
    """A stone: kind, name, place, turn about +Y (0: its width lies along x), size in meters, lean; in degrees."""

    kind: str
    name: str
    at: tuple
    turn: float
    size: tuple
    lean: float = 0.0


def place(direction, distance, height=0.0):
    """Place by the direction clockwise from the axis, in degrees, and the distance from the center."""
    angle = math.radians(direction - VIEW)
    return (-distance * math.sin(angle), height, distance * math.cos(angle))


def facing(direction):
    """Turn about +Y of a stone that shows its broad side to the center."""
    return VIEW - direction


def sarsen_circle():
    def direction(number):
        return 12 * (number - 0.5)

    for number in STANDING:
        at, lean = place(direction(number), SARSEN_RADIUS), 4.0 * math.sin(5.0 * number)
        yield Stone("upright", f"sarsen {number}", at, facing(direction(number)), UPRIGHT, lean)
    # The eleventh is a stump, half as wide as the others.
    at = place(direction(11), SARSEN_RADIUS)
    yield Stone("bluestone", "sarsen 11", at, facing(direction(11)), (1.2, 2.6, 0.8))
    for number in LINTELS_FROM:
        middle = direction(number) + 6
        at = place(middle, SARSEN_RADIUS * math.cos(math.radians(6)), UPRIGHT[1] - 0.1)
        yield Stone("lintel", f"lintel on sarsen {number}", at, facing(middle), LINTEL)
    for number, (outwards, turn) in FALLEN.items():
        at, turn = place(direction(number), SARSEN_RADIUS + outwards), facing(direction(number)) + 90 + turn
        yield Stone("fallen", f"fallen sarsen {number}", at, turn, (3.9, 0.9, 2.0))


def trilithons():
    for name, direction, distance, skew, height, lintel in TRILITHONS:
        turn = facing(direction) + skew
        x, _, z = place(direction, distance)
        along = math.cos(math.radians(turn)), -math.sin(math.radians(turn))
        first, second = name.split("-")
        for number, side in ((first, 1), (second, -1)):
            shift = side * (TRILITHON_WIDTH + TRILITHON_GAP) / 2
            at = (x + shift * along[0], 0.0, z + shift * along[1])
            size = (TRILITHON_WIDTH, height, TRILITHON_DEPTH)
            if number not in ("55", "59"):
                lean = 2.5 if number == "56" else 0.0
                yield Stone("trilithon", f"trilithon stone {number}", at, turn, size, lean)
        if "55" not in name and "59" not in name:
            size = (2 * TRILITHON_WIDTH + TRILITHON_GAP + 0.1, lintel, TRILITHON_DEPTH + 0.1)
            yield Stone("trilithon lintel", f"trilithon lintel {name}", (x, height - 0.12, z), turn, size)
    # Stone 55 broke in two over the altar stone, 59 in three; the lintel 156 lies before them.
    yield Stone("fallen", "fallen trilithon stone 55, lower part", place(171, 5.4), facing(171) + 78, (3.6, 1.0, 2.2))
    yield Stone("fallen", "fallen trilithon stone 55, upper part", place(150, 3.9), facing(150) + 60, (2.8, 0.9, 2.1))
    yield Stone("fallen", "fallen lintel 156", place(196, 4.5), facing(196) + 25, (4.3, 0.95, 1.2))
    yield Stone("fallen", "altar stone", place(176, 3.9), facing(180) + 8, (4.6, 0.45, 1.0))
    for part, (direction, distance, turn, length) in enumerate(PARTS_OF_59, 1):
        at, turn = place(direction, distance), facing(direction) + turn
        yield Stone("fallen", f"fallen trilithon stone 59, part {part}", at, turn, (length, 0.8, 1.7))


def bluestones():
    for order, number in enumerate(BLUESTONES):
        direction = 7.35 * number
        wide, high = 0.75 + 0.3 * math.sin(7.0 * number), 1.25 + 0.75 * math.sin(3.3 * number)
        at = place(direction, BLUESTONE_RADIUS + 0.3 * math.sin(2.0 * number))
        if order % 4 == 3:
            yield Stone("fallen", f"fallen bluestone {number}", at, 40.0 * number, (high + 0.7, 0.5, wide))
        else:
            lean = 14 * math.sin(number)
            yield Stone("bluestone", f"bluestone {number}", at, facing(direction), (wide, high, 0.55), lean)
    for order, (direction, distance, height) in enumerate(INNER):
        at = place(direction, distance)
        size, lean = (0.68, height, 0.6), 3 * math.sin(order)
        yield Stone("bluestone", f"bluestone {order + 61}", at, facing(direction), size, lean)


def outliers():
    yield Stone("trilithon", "heel stone", place(0, 77), 15.0, (2.5, 4.7, 2.1), 24.0)
    yield Stone("fallen", "slaughter stone", place(8, 40), facing(8) + 60, (6.3, 0.7, 2.0))
    for number, direction in ((91, 65), (93, 245)):
        at = place(direction, 43)
        yield Stone("bluestone", f"station stone {number}", at, facing(direction), (1.4, 1.6, 1.0), 20.0)


def all_stones():
    return [*sarsen_circle(), *trilithons(), *bluestones(), *outliers()]
