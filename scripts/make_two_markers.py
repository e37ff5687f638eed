#!/usr/bin/env python3
"""Writes assets/desk/two_markers.jpg: the photograph of the desk with a second sheet on it, marker number 1, as wide as the first.

usage: scripts/make_two_markers.py FOLDER_OF_EXAMPLES FOLDER_FOR_SCRATCH

The sheet lies where PLACE and TURN say, in the frame of the first marker, and has the colors of its paper and ink. The examples
track_marker and marker_sheet, compiled, say where the first one is and what the second one looks like. Needs Python 3 and ffmpeg.
"""
import json
import math
import re
import subprocess
import sys

PHOTO, OUT = "assets/desk/photo.jpg", "assets/desk/two_markers.jpg"
WIDTH, HEIGHT, FOCAL = 640, 480, 601.83
# Middle of the second sheet in meters, to the right of and below the first, and its turn in degrees, counterclockwise from above.
PLACE, TURN = (-0.04, -0.19), 20.0
# Width of a cell in meters, and cells from edge to edge of a sheet.
CELL, CELLS = 0.0125, 10
# Samples per pixel along each axis.
SAMPLES = 6


def linear(byte):
    value = byte / 255
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def encoded(value):
    value = min(max(value, 0.0), 1.0)
    return round(255 * (12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055))


def black_cells(svg):
    """Cells of the print that are black, as (column, row) from the upper left of the white margin."""
    lines = [tuple(map(float, found)) for found in re.findall(r"M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)", svg)]
    squares = [(x, y) for x, y, right, level in lines if y == level and abs(right - x - 1000 * CELL) < 0.1]
    left, top = min(x for x, _ in squares) - 1000 * CELL, min(y for _, y in squares) - 1000 * CELL
    return {(round((x - left) / (1000 * CELL)), round((y - top) / (1000 * CELL))) for x, y in squares}


def main():
    examples, scratch = sys.argv[1:]
    run = lambda *command: subprocess.run(command, check=True, capture_output=True).stdout
    said = run(f"{examples}/track_marker", "--image", PHOTO, "--intrinsics", f"{FOCAL},{FOCAL},{WIDTH / 2},{HEIGHT / 2}", "--json")
    pose = next(marker for marker in json.loads(said)["markers"] if marker["id"] == 0)["camera_from_marker"]
    right, up, down, origin = (pose[4 * column:4 * column + 3] for column in range(4))
    run(f"{examples}/marker_sheet", "--kind", "marker", "--id", "1", "--out", f"{scratch}/sheet.svg")
    with open(f"{scratch}/sheet.svg") as file:
        black = black_cells(file.read())
    raw = run("ffmpeg", "-loglevel", "error", "-i", PHOTO, "-f", "rawvideo", "-pix_fmt", "rgb24", "-")
    photo = [[linear(byte) for byte in raw[3 * i:3 * i + 3]] for i in range(WIDTH * HEIGHT)]

    def pixel(x, z):
        """Where the camera sees a point of the desk."""
        seen = [origin[axis] + x * right[axis] + z * down[axis] for axis in range(3)]
        return WIDTH / 2 - FOCAL * seen[0] / seen[2], HEIGHT / 2 + FOCAL * seen[1] / seen[2]

    def on_desk(column, row):
        """The point of the desk that the camera sees there."""
        ray = ((column - WIDTH / 2) / FOCAL, (HEIGHT / 2 - row) / FOCAL, -1.0)
        dot = lambda a, b: sum(a[axis] * b[axis] for axis in range(3))
        reach = dot(origin, up) / dot(ray, up)
        point = [reach * ray[axis] - origin[axis] for axis in range(3)]
        return dot(point, right), dot(point, down)

    def mean(places):
        colors = [photo[int(row) * WIDTH + int(column)] for column, row in (pixel(x, z) for x, z in places)]
        return [sum(color[c] for color in colors) / len(colors) for c in range(3)]

    ring = lambda distance: [(a * distance, b * distance) for k in range(-9, 10)
                             for a, b in ((k / 10, 1), (k / 10, -1), (1, k / 10), (-1, k / 10))]
    paper, ink = mean(ring(4.5 * CELL)), mean(ring(3.5 * CELL))

    half = CELLS * CELL / 2
    cos, sin = math.cos(math.radians(TURN)), math.sin(math.radians(TURN))
    corners = [pixel(PLACE[0] + a * cos + b * sin, PLACE[1] - a * sin + b * cos) for a in (-half, half) for b in (-half, half)]
    columns, rows = zip(*corners)
    out = bytearray(raw)
    for row in range(math.floor(min(rows)), math.ceil(max(rows)) + 1):
        for column in range(math.floor(min(columns)), math.ceil(max(columns)) + 1):
            i = row * WIDTH + column
            total = [0.0, 0.0, 0.0]
            for sample in range(SAMPLES * SAMPLES):
                x, z = on_desk(column + (sample % SAMPLES + 0.5) / SAMPLES, row + (sample // SAMPLES + 0.5) / SAMPLES)
                x, z = x - PLACE[0], z - PLACE[1]
                x, z = x * cos - z * sin, x * sin + z * cos
                color = photo[i]
                if max(abs(x), abs(z)) < half:
                    cell = (math.floor((x + half) / CELL), math.floor((z + half) / CELL))
                    color = ink if cell in black else paper
                total = [total[c] + color[c] for c in range(3)]
            out[3 * i:3 * i + 3] = bytes(encoded(value / SAMPLES ** 2) for value in total)
    subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{WIDTH}x{HEIGHT}", "-i", "-",
                    "-bitexact", "-map_metadata", "-1", "-q:v", "3", OUT], input=bytes(out), check=True)


if __name__ == "__main__":
    main()
