#!/usr/bin/env python3
"""Engine step of palpus beside Coal's tolerance query on the same poses, in one run.

usage: coal_tolerance.py PALPUS MODELS_FOLDER [--ticks N] [--only NAME]      (needs numpy and coal from PyPI)

Both answer "all contacts within 1 % of the smaller model's bounding diagonal" along a coherent path that slides the
probe in and out of contact. Coal: OBB tree, security margin, contacts enabled, as many as there are; the cost of an
empty Python call is subtracted. palpus: `palpus bench step` (query, depth and force). Medians in microseconds and their ratio.
"""
import csv
import pathlib
import subprocess
import sys
import tempfile
import time

import coal
import numpy as np

SEED = 20021
PAIRS = [
    ("spoon-cup", "teaspoon_336.obj", "teacup_500.obj"),
    ("armadillo-intestine", "armadillo_31240.obj", "intestine_colon_male_24846.obj"),
]
TICKS_PER_STRETCH = 200


def read_obj(path):
    vertices, triangles = [], []
    for line in open(path):
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(x) for x in words[1:4]])
        elif words[:1] == ["f"]:
            corner = [int(w.split("/")[0]) - 1 for w in words[1:]]
            triangles += [[corner[0], corner[k], corner[k + 1]] for k in range(1, len(corner) - 1)]
    return np.array(vertices), np.array(triangles)


def tree(vertices, triangles):
    model = coal.BVHModelOBB()
    model.beginModel(len(triangles), len(vertices))
    model.addVertices(vertices)
    model.addTriangles(triangles)
    model.endModel()
    return model


def rotation(axis_angle):
    angle = np.linalg.norm(axis_angle)
    if angle < 1e-12:
        return np.array([0.0, 0.0, 0.0, 1.0])
    return np.append(axis_angle / angle * np.sin(angle / 2), np.cos(angle / 2))


def times(p, q):
    (px, py, pz, pw), (qx, qy, qz, qw) = p, q
    return np.array([
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    ])


def transform(t, q):
    x, y, z, w = q / np.linalg.norm(q)
    matrix = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    return coal.Transform3s(matrix, t)


def path(a, b, size_a, size_b, center_a, center_b, ticks, random):
    """Stretches of coherent motion, each starting where a random approach first touches."""
    identity, poses = coal.Transform3s.Identity(), []

    def apart(t, q):
        return coal.distance(a, transform(t, q), b, identity, coal.DistanceRequest(), coal.DistanceResult())

    while len(poses) < ticks:
        q = rotation(random.normal(size=3) * 2.0)
        d = random.normal(size=3)
        d /= np.linalg.norm(d)
        turned = transform(np.zeros(3), q).getRotation() @ center_a
        far, near = size_a + size_b, 0.0
        for _ in range(40):  # The last position along d, from outside, at which the surfaces are apart.
            middle = (far + near) / 2
            if apart(center_b - turned + d * middle, q) > 0:
                far = middle
            else:
                near = middle
        start, amplitude = center_b - turned + d * far, 0.01 * min(size_a, size_b)
        side = np.cross(d, random.normal(size=3))
        side /= np.linalg.norm(side)
        spin = random.normal(size=3)
        for k in range(TICKS_PER_STRETCH):
            phase = 2 * np.pi * k / TICKS_PER_STRETCH
            t = start + d * amplitude * np.cos(phase) + side * amplitude * np.sin(phase)
            poses.append((t, times(rotation(spin * 0.02 * np.sin(phase)), q)))
    return poses[:ticks]


def time_coal(a, b, poses, tolerance):
    identity, request = coal.Transform3s.Identity(), coal.CollisionRequest()
    request.enable_contact = True
    request.num_max_contacts = 100000
    request.security_margin = tolerance
    far = transform(np.array([1e6, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
    empty = []
    for _ in range(2000):  # Far apart, the call is the root's box test and the way through Python.
        result = coal.CollisionResult()
        t0 = time.perf_counter_ns()
        coal.collide(a, far, b, identity, request, result)
        empty.append(time.perf_counter_ns() - t0)
    empty = np.median(empty)
    cost, contacts = [], []
    for t, q in poses:
        place, result = transform(t, q), coal.CollisionResult()
        t0 = time.perf_counter_ns()
        coal.collide(a, place, b, identity, request, result)
        cost.append((time.perf_counter_ns() - t0 - empty) / 1000)
        contacts.append(result.numContacts())
    return np.array(cost), np.array(contacts)


def time_palpus(palpus, a, b, poses, tolerance):
    with tempfile.TemporaryDirectory() as folder:
        with open(f"{folder}/poses.csv", "w") as file:
            file.write("tx,ty,tz,qx,qy,qz,qw\n")
            for t, q in poses:
                file.write(",".join(repr(float(x)) for x in (*t, *q)) + "\n")
        subprocess.run(
            [palpus, "bench", "step", a, b, "--poses", f"{folder}/poses.csv", "--out", f"{folder}/step.csv", "--tolerance", repr(float(tolerance))],
            check=True,
        )
        rows = list(csv.DictReader(open(f"{folder}/step.csv")))
    return np.array([float(r["total_us"]) for r in rows]), np.array([int(r["contacts"]) for r in rows])


def main():
    arguments, ticks, only = sys.argv[1:], 4000, None
    if "--ticks" in arguments:
        k = arguments.index("--ticks")
        ticks = int(arguments[k + 1])
        del arguments[k:k + 2]
    if "--only" in arguments:
        k = arguments.index("--only")
        only = arguments[k + 1]
        del arguments[k:k + 2]
    palpus, folder = arguments[0], pathlib.Path(arguments[1])
    files = {p.name: p for p in folder.rglob("*.obj")}
    print(f"{'pair':22} {'':8} {'p50 us':>9} {'p99 us':>9} {'contacts':>9}")
    for name, file_a, file_b in PAIRS:
        if only and only != name:
            continue
        va, ta = read_obj(files[file_a])
        vb, tb = read_obj(files[file_b])
        size_a, size_b = np.linalg.norm(np.ptp(va, 0)), np.linalg.norm(np.ptp(vb, 0))
        a, b = tree(va, ta), tree(vb, tb)
        center_a, center_b = (va.min(0) + va.max(0)) / 2, (vb.min(0) + vb.max(0)) / 2
        poses = path(a, b, size_a, size_b, center_a, center_b, ticks, np.random.default_rng(SEED))
        tolerance = 0.01 * min(size_a, size_b)
        theirs, their_contacts = time_coal(a, b, poses, tolerance)
        ours, our_contacts = time_palpus(palpus, files[file_a], files[file_b], poses, tolerance)
        print(f"{name:22} {'coal':8} {np.median(theirs):9.1f} {np.percentile(theirs, 99):9.1f} {their_contacts.mean():9.1f}")
        print(f"{name:22} {'palpus':8} {np.median(ours):9.1f} {np.percentile(ours, 99):9.1f} {our_contacts.mean():9.1f}")
        print(f"{name:22} median ratio palpus / coal: {np.median(ours) / np.median(theirs):.3f}  (seed {SEED}, {len(poses)} poses)")


if __name__ == "__main__":
    main()
