#!/usr/bin/env python3
"""Converts a teapot from Collada to assets/models/teapot.glb: smooth and round, 16 cm wide, upright, with its foot at the origin.

usage: scripts/make_teapot.py teapots.DAE [assets/models/teapot.glb]

The source is `test/models/Collada/teapots.DAE` of assimp (BSD-3-Clause, in Debian's package assimp-testmodels). Its 992 triangles show
as corners along the outline of a toon, so that each becomes 9 of a curved PN triangle (Vlachos et al. 2001). Needs nothing but
Python 3.
"""
import math
import re
import sys

from make_desk_scene import Scene

GEOMETRY = "Teapot03-lib"
# From spout to handle, in meters.
WIDTH = 0.16
# Each edge of a triangle becomes this many.
PARTS = 3
# Alpha is the gloss map of `ClassicModel::GlossMap`: 1 is matte, 0 a mirror. All other styles ignore it.
COLOR, GLOSS = (0.09, 0.33, 0.36), 0.55


def add(*vectors):
    return tuple(map(sum, zip(*vectors)))


def scaled(vector, factor):
    return tuple(factor * x for x in vector)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(vector):
    return scaled(vector, 1 / math.sqrt(dot(vector, vector)))


def read_numbers(text, name, kind):
    """Numbers between the tag that has a name and the next one, with commas for points as the exporter wrote them."""
    found = re.search(rf'id="{re.escape(name)}"[^>]*>([^<]*)<', text)
    if not found:
        sys.exit(f"make_teapot: the file has no array {name}; take teapots.DAE of assimp")
    return [kind(number) for number in found.group(1).replace(",", ".").split()]


def read(path):
    """Positions and normals (+Y up), and triangles as triples of (position, normal)."""
    try:
        with open(path, encoding="utf-8") as file:
            text = file.read()
    except OSError as error:
        sys.exit(f"make_teapot: cannot read {path}: {error.strerror}; give the path of assimp's teapots.DAE")

    def vectors(name):
        numbers = read_numbers(text, f"{GEOMETRY}-{name}-array", float)
        # from +Z up to +Y up
        return [(x, z, -y) for x, y, z in zip(numbers[::3], numbers[1::3], numbers[2::3])]

    positions, normals = vectors("Position"), [unit(normal) for normal in vectors("Normal0")]
    start = text.index(f'<geometry id="{GEOMETRY}"')
    part = text[start:text.index("</geometry>", start)]
    polygons = [list(map(int, found.split())) for found in re.findall(r"<p>([^<]*)</p>", part)]
    return positions, normals, [list(zip(p[::2], p[1::2])) for p in polygons]


def curved(corners, normals):
    """Positions and normals at the lattice points of a PN triangle, by barycentric coordinates in parts."""

    def edge(i, j):
        """Control point of the edge, a third of the way from corner i to j."""
        along = add(corners[j], scaled(corners[i], -1))
        bent = scaled(normals[i], -dot(along, normals[i]))
        return scaled(add(scaled(corners[i], 2), corners[j], bent), 1 / 3)

    def middle(i, j):
        """Control normal of the edge."""
        along = add(corners[j], scaled(corners[i], -1))
        length = dot(along, along)
        both = add(normals[i], normals[j])
        return unit(add(both, scaled(along, -2 * dot(along, both) / length))) if length > 0 else normals[i]

    edges = {(i, j): edge(i, j) for i in range(3) for j in range(3) if i != j}
    mean_edge = scaled(add(*edges.values()), 1 / 6)
    center = add(scaled(mean_edge, 1.5), scaled(add(*corners), -1 / 6))
    middles = {(i, j): middle(i, j) for i, j in ((0, 1), (1, 2), (2, 0))}
    lattice = {}
    for a in range(PARTS + 1):
        for b in range(PARTS + 1 - a):
            w = (a / PARTS, b / PARTS, (PARTS - a - b) / PARTS)
            terms = [scaled(corners[i], w[i] ** 3) for i in range(3)]
            terms += [scaled(point, 3 * w[i] ** 2 * w[j]) for (i, j), point in edges.items()]
            turns = [scaled(normals[i], w[i] ** 2) for i in range(3)]
            turns += [scaled(normal, w[i] * w[j]) for (i, j), normal in middles.items()]
            position = add(*terms, scaled(center, 6 * w[0] * w[1] * w[2]))
            lattice[a, b] = position, unit(add(*turns))
    return lattice


def refine(positions, normals, triangles):
    """The curved surface as a mesh in which neighbors have their vertices in common."""
    vertices, indices = {}, []

    def vertex(position, normal):
        key = tuple(round(x, 4) for x in position) + tuple(round(x, 2) for x in normal)
        return vertices.setdefault(key, (len(vertices), position, normal))[0]

    for triangle in triangles:
        lattice = curved([positions[p] for p, _ in triangle], [normals[n] for _, n in triangle])
        number = {at: vertex(*point) for at, point in lattice.items()}
        for a in range(PARTS):
            for b in range(PARTS - a):
                faces = [((a, b), (a + 1, b), (a, b + 1))]
                if a + b < PARTS - 1:
                    faces.append(((a + 1, b), (a + 1, b + 1), (a, b + 1)))
                for face in faces:
                    corners = [number[at] for at in face]
                    # at the poles of lid and bottom
                    if len(set(corners)) == 3:
                        indices += corners
    ordered = sorted(vertices.values())
    return [position for _, position, _ in ordered], [normal for _, _, normal in ordered], indices


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    out = sys.argv[2] if len(sys.argv) > 2 else "assets/models/teapot.glb"
    positions, normals, indices = refine(*read(sys.argv[1]))
    low, high = (tuple(pick(p[i] for p in positions) for i in range(3)) for pick in (min, max))
    scale = WIDTH / (high[0] - low[0])
    # The body stands over the origin; it is as deep as the teapot.
    shift = (0.0, -low[1], -(low[2] + high[2]) / 2)
    shape = [scaled(add(position, shift), scale) for position in positions], normals, indices
    scene = Scene()
    scene.json["asset"] = {
        "version": "2.0", "generator": "bevy_mirrorball scripts/make_teapot.py",
        "copyright": "BSD-3-Clause, assimp Development Team: teapots.DAE of assimp's test models, refined",
    }
    material = scene.material("glazed teapot", COLOR, 0, 0.2)
    scene.json["materials"][material]["pbrMetallicRoughness"]["baseColorFactor"][3] = GLOSS
    scene.node("teapot", shape, material)
    scene.write(out)
    print(f"make_teapot: {out} has {len(positions)} vertices and {len(indices) // 3} triangles")


if __name__ == "__main__":
    main()
