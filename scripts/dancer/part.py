"""Part of the figure: a closed mesh of one material, and the weights of the joints at points."""
from typing import Callable, NamedTuple

from dancer import surface_net


class Part(NamedTuple):
    name: str
    material: str
    # Positions and normals (n, 3) in millimeters, triangles (m, 3).
    shape: tuple
    weights: Callable


def solid(name, material, field, cell, weights):
    """Part in the shape of a solid, meshed with cells of some millimeters."""
    return Part(name, material, surface_net.mesh(field, cell), weights)
