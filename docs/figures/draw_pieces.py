"""Draws a model coloured by its convex pieces, seen from two sides; pieces of one or two triangles are red.

    pip install matplotlib numpy
    palpus prepare MODEL.obj --pieces PIECES.obj
    python docs/figures/draw_pieces.py MODEL.obj PIECES.obj docs/figures/pieces_NAME.png [--view=ELEVATION,AZIMUTH]...
"""

import argparse

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

# Tolerance relative to the model's bounding diagonal, for equal vertices and for triangles in a
# plane.
SAME = 1e-6
ON_PLANE = 1e-4
RED = (0.86, 0.1, 0.1)


def read_obj(path):
    """Returns the vertices, and the faces as (group, corner indices)."""
    vertices, faces, group = [], [], -1
    for line in open(path, encoding="utf-8", errors="replace"):
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            vertices.append([float(word) for word in words[1:4]])
        elif words[0] in ("g", "o"):
            group += 1
        elif words[0] == "f":
            faces.append((group, [int(word.split("/")[0]) - 1 for word in words[1:]]))
    return np.array(vertices), faces


def owners(vertices, triangles, piece_vertices, piece_faces, size):
    """Returns for each triangle the largest piece that has its corners and lies below its plane."""
    def key(point):
        return tuple(np.round(point / (SAME * size)).astype(int))

    corners = {}
    for piece, face in piece_faces:
        corners.setdefault(piece, set()).update(face)
    at = {}
    for piece, members in corners.items():
        for v in members:
            at.setdefault(key(piece_vertices[v]), set()).add(piece)
    answer = []
    for triangle in triangles:
        a, b, c = vertices[triangle]
        normal = np.cross(b - a, c - a)
        normal /= max(np.linalg.norm(normal), 1e-300)
        shared = set.intersection(*(at.get(key(p), set()) for p in (a, b, c)))
        below = [
            piece
            for piece in shared
            if max((piece_vertices[v] - a) @ normal for v in corners[piece]) <= ON_PLANE * size
        ]
        answer.append(max(below, key=lambda piece: (len(corners[piece]), -piece), default=-1))
    return np.array(answer)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("pieces")
    parser.add_argument("out")
    parser.add_argument("--view", action="append", help="elevation,azimuth in degrees; one picture each")
    parser.add_argument("--zoom", type=float, default=1.4)
    parser.add_argument("--dpi", type=float, default=100)
    options = parser.parse_args()

    vertices, faces = read_obj(options.model)
    triangles = np.array([[face[0], face[k], face[k + 1]] for _, face in faces for k in range(1, len(face) - 1)])
    piece_vertices, piece_faces = read_obj(options.pieces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    owner = owners(vertices, triangles, piece_vertices, piece_faces, np.linalg.norm(high - low))
    count = {piece: int((owner == piece).sum()) for piece in set(owner.tolist())}
    random = np.random.default_rng(1).uniform(0.0, 1.0, size=(max(count) + 2, 1))
    palette = np.hstack([0.35 + 0.3 * random, 0.55 + 0.35 * random[::-1], 0.75 + 0.2 * random])

    normals = np.cross(vertices[triangles[:, 1]] - vertices[triangles[:, 0]], vertices[triangles[:, 2]] - vertices[triangles[:, 0]])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    views = [tuple(float(x) for x in view.split(",")) for view in options.view or ["35,-60", "-35,-60"]]
    figure = plt.figure(figsize=(4.2 * len(views), 3.6))
    for k, (elevation, azimuth) in enumerate(views):
        axes = figure.add_subplot(1, len(views), k + 1, projection="3d")
        e, a = np.radians([elevation, azimuth])
        eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        front = np.flatnonzero(normals @ eye > 0)
        shade = 0.65 + 0.35 * (normals[front] @ eye)
        base = np.array([RED if count[owner[t]] <= 2 else palette[owner[t]] for t in front])
        axes.add_collection3d(
            Poly3DCollection(vertices[triangles[front]], facecolors=base * shade[:, None], edgecolors="#20202060", linewidths=0.25)
        )
        for axis, name in enumerate("xyz"):
            getattr(axes, f"set_{name}lim")(low[axis], high[axis])
        axes.set_box_aspect(high - low, zoom=options.zoom)
        axes.view_init(elevation, azimuth)
        axes.set_axis_off()
    small = sum(1 for n in count.values() if n <= 2)
    figure.text(0.5, 0.02, f"{len({piece for piece, _ in piece_faces})} pieces, {small} of one or two triangles (red)", ha="center", fontsize=9)
    figure.subplots_adjust(left=0, right=1, bottom=0.04, top=1, wspace=0)
    figure.savefig(options.out, dpi=options.dpi)


if __name__ == "__main__":
    main()
