#!/usr/bin/env python3
"""Writes campus.glb: the court of a modern university, of our own design, in flat colors for toon shading.

usage: scripts/make_campus.py [FOLDER]

All lengths in meters, true to scale: the dancer, 1.7 m tall, stands at the origin on the round stage and faces −Z; +Y
is up. In the manner of German campuses of the 1990s: slabs with bands of windows, a colonnade, stairs, a clock. The
node `sun` is turned like a directional light. Needs Python 3 and numpy.
"""
import os
import sys

import numpy as np

from scenes.campus_court import add_court
from scenes.campus_halls import add_halls
from scenes.campus_trees import add_trees
from scenes.shared_scene import SharedScene, looking

# Towards the light that the design counts on.
TO_SUN = np.array([0.62, 0.62, -0.48])


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else "assets/scenes"
    os.makedirs(folder, exist_ok=True)
    scene = SharedScene("scripts/make_campus.py", "MIT OR Apache-2.0, the authors of bevy_mirrorball")
    paint = scene.material("paint", (1, 1, 1), 0, 0.9)
    glass = scene.material("glass", (0.13, 0.30, 0.42), 0, 0.2)
    add_court(scene, paint)
    add_halls(scene, paint, glass)
    add_trees(scene, paint)
    scene.place("sun", at=60 * TO_SUN, turn=looking(TO_SUN, (0, 0, 0)))
    scene.camera("camera_wide", (3.6, 1.75, -9.0), (-0.75, 2.75, 3), 47)
    scene.camera("camera_close", (1.2, 1.5, -5.2), (0, 1.25, 0), 40)
    path = f"{folder}/campus.glb"
    scene.write(path)
    print(f"make_campus: {path}: {scene.summary()}; {os.path.getsize(path)} bytes")


if __name__ == "__main__":
    main()
