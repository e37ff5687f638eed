"""All parts of the dancer as one skinned mesh: a primitive for every material, and its colors."""
import numpy as np

from dancer import body, head
from dancer.skin_weights import strongest

MILLIMETER = 1e-3
# sRGB color, gloss map of `ClassicModel::GlossMap` (1 is matte, 0 a mirror; all other styles ignore it), and roughness.
PAINTS = {
    "skin": ((0.98, 0.76, 0.62), 1.0, 0.6),
    "lips": ((0.93, 0.46, 0.42), 1.0, 0.5),
    "eyes": ((0.13, 0.09, 0.10), 0.6, 0.15),
    "white": ((0.97, 0.96, 0.92), 1.0, 0.4),
    "hair": ((0.36, 0.17, 0.12), 0.85, 0.45),
    "shirt": ((0.90, 0.24, 0.27), 1.0, 0.8),
    "trousers": ((0.17, 0.33, 0.62), 1.0, 0.8),
    "shoes": ((0.16, 0.62, 0.62), 0.85, 0.35),
    "trim": ((1.00, 0.76, 0.20), 0.8, 0.35),
}


def linear(color):
    """Linear components of an sRGB color (IEC 61966-2-1)."""
    return [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in color]


def shapes():
    """By material: positions in millimeters, normals, joints, weights, and triangles."""
    found = {material: [] for material in PAINTS}
    for part in body.parts() + head.parts():
        positions, normals, triangles = part.shape
        found[part.material].append((positions, normals, *strongest(part.weights(positions)), triangles))
    result = {}
    for material, pieces in found.items():
        starts = np.cumsum([0] + [len(piece[0]) for piece in pieces])
        triangles = [piece[4] + start for piece, start in zip(pieces, starts)]
        vertices = [np.concatenate(rows) for rows in list(zip(*pieces))[:4]]
        result[material] = (*vertices, np.concatenate(triangles))
    return result


def add_materials(glb):
    """Number of each material in the file."""
    return {
        name: glb.material(name, [*(round(x, 4) for x in linear(color)), gloss], roughness)
        for name, (color, gloss, roughness) in PAINTS.items()
    }


def add_figure(glb):
    """Number of a skinned mesh in the file, and how many triangles it has."""
    materials, primitives, count = add_materials(glb), [], 0
    for name, (positions, normals, joints, weights, triangles) in shapes().items():
        primitives.append(
            glb.primitive(positions * MILLIMETER, normals, joints, weights, triangles, materials[name])
        )
        count += len(triangles)
    return glb.add("meshes", {"name": "dancer", "primitives": primitives}), count
