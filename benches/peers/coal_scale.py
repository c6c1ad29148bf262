#!/usr/bin/env python3
"""Compares the engine step of palpus with Coal's tolerance query on the same poses, in one run.

usage: coal_scale.py PALPUS MODELS_FOLDER [--out DIR] [--ticks N] [--coal-ticks N] [--only NAME]
       (needs numpy and coal from PyPI)

Both find all contacts within the pair's tolerance along the coherent motion of `palpus bench scale`.
Coal: OBB tree, security margin, all contacts enabled; the cost of an empty Python call is subtracted.
palpus: query, depth and force. Coal uses a part of palpus's poses, evenly spread (--coal-ticks, 2000).
Prints medians and percentiles in microseconds and their ratio, and writes a Markdown table to DIR/coal_scale.md.
"""
import argparse
import csv
import gzip
import json
import pathlib
import subprocess
import time

import coal
import numpy as np

PAIRS = ["spoon-cup", "armadillo-intestine", "nut-bolt", "gears", "drill-blade", "lucy-embryo"]


def read_obj(path):
    vertices, triangles = [], []
    for line in (gzip.open if path.suffix == ".gz" else open)(path, "rt"):
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            corner = [int(w.split("/")[0]) - 1 for w in words[1:]]
            triangles += [[corner[0], corner[k], corner[k + 1]] for k in range(1, len(corner) - 1)]
    return np.array(vertices), np.array(triangles)


def tree(path, scale, model=None):
    vertices, triangles = read_obj(pathlib.Path(path))
    model = model or coal.BVHModelOBB()
    model.beginModel(len(triangles), len(vertices))
    model.addVertices(vertices * scale)
    model.addTriangles(triangles)
    model.endModel()
    return model


def transform(row):
    t, (x, y, z, w) = row[:3], row[3:] / np.linalg.norm(row[3:])
    matrix = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    return coal.Transform3s(matrix, t)


def time_coal(a, b, poses, tolerance):
    identity, request = coal.Transform3s.Identity(), coal.CollisionRequest()
    request.enable_contact = True
    request.num_max_contacts = 1000000
    request.security_margin = tolerance
    far = transform(np.array([1e6, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]))
    empty = []
    for _ in range(2000):  # With bodies far apart, the call only tests the boxes of the roots, and shows the cost of Python.
        result = coal.CollisionResult()
        t0 = time.perf_counter_ns()
        coal.collide(a, far, b, identity, request, result)
        empty.append(time.perf_counter_ns() - t0)
    empty = np.median(empty)
    cost, contacts = [], []
    for row in poses:
        place, least = transform(row), np.inf
        for _ in range(3):  # The smallest of three times, as for palpus.
            result = coal.CollisionResult()
            t0 = time.perf_counter_ns()
            coal.collide(a, place, b, identity, request, result)
            least = min(least, time.perf_counter_ns() - t0 - empty)
        cost.append(least / 1000)
        contacts.append(result.numContacts())
    return np.array(cost), np.array(contacts)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("palpus")
    parser.add_argument("models")
    parser.add_argument("--out", default="palpus-out/scale", type=pathlib.Path)
    parser.add_argument("--ticks", default=20000, type=int)
    parser.add_argument("--coal-ticks", default=2000, type=int)
    parser.add_argument("--only", choices=PAIRS)
    options = parser.parse_args()
    lines = ["| pair | triangles | ticks | contacts | palpus p50 | p99 | p99.9 | max | Coal's contacts | Coal p50 | Coal p99 | ratio |",
             "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"]
    print("\n".join(lines), flush=True)
    for name in [options.only] if options.only else PAIRS:
        folder = options.out / name
        subprocess.run([options.palpus, "bench", "scale", "--models", options.models, "--out", folder,
                        "--ticks", str(options.ticks), "--only", name], check=True, stdout=subprocess.DEVNULL)
        [row] = json.load(open(folder / "pairs.json"))
        repeat = row["repeat"]
        rows = list(csv.reader(open(repeat["poses"])))[1:]
        starts = set(repeat["stretch_starts"])
        poses = np.array([[float(x) for x in r] for k, r in enumerate(rows) if k not in starts])
        poses = poses[:: max(1, len(poses) // options.coal_ticks)]
        a, b = tree(repeat["a"], repeat["scale_a"]), tree(repeat["b"], repeat["scale_b"])
        cost, contacts = time_coal(a, b, poses, row["tolerance"])
        lines.append(
            f"| {name} | {row['triangles_a']} / {row['triangles_b']} | {row['ticks']} | {row['contacts']:.1f} | {row['p50']:.1f} | {row['p99']:.1f} "
            f"| {row['p999']:.1f} | {row['max']:.1f} | {contacts.mean():.1f} | {np.median(cost):.1f} | {np.percentile(cost, 99):.1f} "
            f"| {row['p50'] / np.median(cost):.3f} |")
        print(lines[-1], flush=True)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "coal_scale.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
