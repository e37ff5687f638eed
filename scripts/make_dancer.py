#!/usr/bin/env python3
"""Makes the dancer of examples/dance_stage: a skinned figure, 15 cm tall, with the moves of a dance game.

usage: scripts/make_dancer.py [assets/models/dancer.glb]

She faces −Z with her feet at the origin. The clips' time is in beats, one second each: play them at (beats per
minute) / 60. Each begins and ends in the pose at rest, and the music's beat is at 0.5 (and 1.5), where the foot lands.
Left is her own left, −X; up is forward, −Z. Needs Python 3.10 and numpy 1.24 or later.
"""
import sys

import numpy as np

from dancer import shows, skeleton, steps
from dancer.clip import clip
from dancer.figure import MILLIMETER, add_figure
from dancer.glb import FLOAT, Glb

# In millimeters. No hand or foot may be farther from its keys.
MAX_MISS = 0.1


def clips():
    left = steps.step_left()
    return [
        clip("idle", 2, steps.idle(), swings_on=True),
        clip("step_left", 1, left),
        clip("step_down", 1, steps.step_down()),
        clip("step_up", 1, steps.step_up()),
        clip("step_right", 1, steps.mirrored(left)),
        clip("jump", 1, steps.jump()),
        clip("spin", 2, shows.spin()),
        clip("cheer", 2, shows.cheer()),
        clip("stumble", 1, shows.stumble()),
    ]


def add_skeleton(glb, rest):
    """Number of the skin in the file. The joints are its first nodes, and rest in the first pose of a clip."""
    for name, offset in zip(skeleton.NAMES, skeleton.offsets() * MILLIMETER):
        rotation = [round(x, 7) for x in rest.rotations[name][0]]
        glb.add("nodes", {"name": name, "translation": [round(x, 7) for x in offset], "rotation": rotation})
    glb.json["nodes"][0]["translation"] = [round(x, 7) for x in rest.places[0] * MILLIMETER]
    for number, parent in enumerate(skeleton.PARENTS):
        if parent >= 0:
            glb.json["nodes"][parent].setdefault("children", []).append(number)
    # A matrix is stored column by column.
    inverse_bind = np.tile(np.eye(4), (len(skeleton.NAMES), 1, 1))
    inverse_bind[:, 3, :3] = -skeleton.POSITIONS * MILLIMETER
    matrices = glb.accessor(inverse_bind.reshape(-1, 16), FLOAT)
    joints = list(range(len(skeleton.NAMES)))
    return glb.add("skins", {"name": "dancer", "joints": joints, "skeleton": 0, "inverseBindMatrices": matrices})


def main():
    if len(sys.argv) > 2 or sys.argv[1:2] in (["-h"], ["--help"]):
        sys.exit(__doc__)
    out = sys.argv[1] if len(sys.argv) > 1 else "assets/models/dancer.glb"
    glb = Glb({"generator": "bevy_mirrorball scripts/make_dancer.py"})
    made = clips()
    for each in made:
        for joint, miss in each.pose.miss.items():
            if miss.max() > MAX_MISS:
                sys.exit(f"make_dancer: {joint} of {each.name} is {miss.max():.1f} mm off; bring its keys closer")
    # At rest the ponytail hangs still, as it doesn't in the first clip, the idle one.
    skin = add_skeleton(glb, made[1])
    mesh, triangles = add_figure(glb)
    body = glb.add("nodes", {"name": "body", "mesh": mesh, "skin": skin})
    figure = glb.add("nodes", {"name": "dancer", "children": [0]})
    glb.json["scenes"][0]["nodes"] = [figure, body]
    for each in made:
        rotations = {skeleton.NAMES.index(joint): keys for joint, keys in each.rotations.items()}
        glb.animation(each.name, each.times, {0: each.places * MILLIMETER}, rotations)
    try:
        glb.write(out)
    except OSError as error:
        sys.exit(f"make_dancer: cannot write {out}: {error.strerror}; give a path in a folder that exists")
    print(f"make_dancer: {out} has {triangles} triangles, {len(skeleton.NAMES)} joints, and {len(made)} clips")


if __name__ == "__main__":
    main()
