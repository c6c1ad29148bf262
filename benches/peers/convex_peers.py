#!/usr/bin/env python3
"""Compares depth and distance of convex pairs: palpus, parry, Coal and MuJoCo, on the same shapes and poses.

usage: convex_peers.py [--markdown FILE] [--only TEXT]      (needs numpy, coal and mujoco from PyPI; run in the repository)

Runs `cargo bench -p palpus --bench convex` twice: once for its shapes and poses, and once for the times of palpus and parry.
Then Coal and MuJoCo take turns along the same stretches of poses. The fastest of several rounds counts for each pose. The cost of
an empty Python call is measured with the same functions (two spheres for Coal, two geoms that are far apart for
MuJoCo) and subtracted. Coal: `distance` with signed distance; within a coherent stretch it starts
from the result of the previous pose. MuJoCo: `mj_geomDistance` with enough iterations to converge;
MuJoCo's vertices are f32. Prints microseconds, p50/p99 over poses, and ratios of p50.
"""
import csv
import pathlib
import subprocess
import sys
import tempfile
import time

import coal
import mujoco
import numpy as np

ROUNDS = 3
OVERLAPPING = ["sliding", "rolling", "deep", "cold"]
APART = ["apart", "apart cold"]
COHERENT = {"sliding", "rolling", "deep", "apart"}
EMPTY_CALLS = 20001
FAR = 1e3
# With its default of 35 iterations, MuJoCo's depth does not converge for large hulls: with 500 vertices at 24 % of the deep poses, with
# 2000 at 62 %.
MUJOCO_ITERATIONS = 1000


def bench(*arguments):
    subprocess.run(["cargo", "bench", "-q", "-p", "palpus", "--bench", "convex", "--", *arguments], check=True, stdout=subprocess.DEVNULL)


def table(path, kind=float):
    return np.array([[kind(x) for x in row] for row in list(csv.reader(open(path)))[1:]])


def rotation_matrix(q):
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


class Coal:
    name = "coal"

    def __init__(self, bodies):
        self.a, self.b = [self.convex(*body) for body in bodies]
        self.identity = coal.Transform3s.Identity()
        self.result = coal.DistanceResult()
        self.forget()
        ball = coal.Sphere(1.0)
        places = [coal.Transform3s(np.eye(3), np.array([3.0, 0.0, 0.0]))] * EMPTY_CALLS
        self.empty = np.median([self.timed(ball, ball, place)[0] for place in places])

    @staticmethod
    def convex(vertices, faces):
        points = coal.StdVec_Vec3s()
        for v in vertices:
            points.append(v)
        triangles = coal.StdVec_Triangle()
        for i, j, k in faces:
            triangles.append(coal.Triangle(int(i), int(j), int(k)))
        return coal.Convex(points, triangles)

    def forget(self):
        self.request = coal.DistanceRequest()
        self.request.enable_signed_distance = True
        self.request.gjk_initial_guess = coal.GJKInitialGuess.CachedGuess
        self.result.clear()

    def place(self, pose):
        return coal.Transform3s(rotation_matrix(pose[3:]), pose[:3])

    def timed(self, a, b, place):
        self.result.clear()
        begin = time.perf_counter_ns()
        distance = coal.distance(a, place, b, self.identity, self.request, self.result)
        return time.perf_counter_ns() - begin, distance

    def query(self, place):
        cost, distance = self.timed(self.a, self.b, place)
        self.request.updateGuess(self.result)
        return (cost - self.empty) / 1000, distance


class MuJoCo:
    name = "mujoco"

    def __init__(self, bodies):
        spec = mujoco.MjSpec()
        for name, (vertices, faces) in zip("ab", bodies):
            mesh = spec.add_mesh(name=name)
            mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
            body = spec.worldbody.add_body(name=name)
            body.add_freejoint()
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
        spec.option.ccd_iterations = MUJOCO_ITERATIONS
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.segment = np.zeros(6)
        mujoco.mj_forward(self.model, self.data)
        # MuJoCo stores a mesh relative to its centre; this is the position of the centre in the body.
        self.offsets = []
        for mesh in range(2):
            matrix = np.zeros(9)
            mujoco.mju_quat2Mat(matrix, self.model.mesh_quat[mesh])
            self.offsets.append((self.model.mesh_pos[mesh].copy(), matrix.reshape(3, 3)))
        self.set(0, np.full(3, FAR), np.eye(3))
        self.set(1, np.zeros(3), np.eye(3))
        self.empty = np.median([self.timed(1.0)[0] for _ in range(EMPTY_CALLS)])

    def set(self, geom, translation, matrix):
        shift, turn = self.offsets[geom]
        self.data.geom_xpos[geom] = translation + matrix @ shift
        self.data.geom_xmat[geom] = (matrix @ turn).ravel()

    def forget(self):
        pass

    def place(self, pose):
        return pose[:3], rotation_matrix(pose[3:])

    def timed(self, limit):
        begin = time.perf_counter_ns()
        distance = mujoco.mj_geomDistance(self.model, self.data, 0, 1, limit, self.segment)
        return time.perf_counter_ns() - begin, distance

    def query(self, place):
        self.set(0, *place)
        cost, distance = self.timed(FAR)
        return (cost - self.empty) / 1000, distance


def run(peers, poses, coherent):
    """Returns microseconds and separations at each pose for each library."""
    costs, answers = [[None] * len(poses) for _ in peers], [[None] * len(poses) for _ in peers]
    stretches = [np.flatnonzero(poses[:, 0] == s) for s in np.unique(poses[:, 0])]
    for _ in range(ROUNDS):
        for indices in stretches:
            for peer, cost, answer in zip(peers, costs, answers):
                places = [peer.place(poses[k, 1:]) for k in indices]
                peer.forget()
                for n, (k, place) in enumerate(zip(indices, places)):
                    if not coherent:
                        peer.forget()
                    spent, answer[k] = peer.query(place)
                    if not coherent or n > 0:
                        cost[k] = spent if cost[k] is None else min(cost[k], spent)
    return [(np.array([c for c in cost if c is not None]), np.array(answer)) for cost, answer in zip(costs, answers)]


def main():
    arguments, markdown, only = sys.argv[1:], None, ""
    if "--markdown" in arguments:
        markdown = arguments[arguments.index("--markdown") + 1]
    if "--only" in arguments:
        only = arguments[arguments.index("--only") + 1]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        bench("--dump", str(folder / "cases"))
        bench("--out", str(folder / "palpus.csv"), *(["--only", only] if only else []))
        figures, order = {}, []
        for row in csv.DictReader(open(folder / "palpus.csv")):
            key = row["shape"], row["motion"]
            order += [key] if key not in figures else []
            figures.setdefault(key, {})[row["contender"]] = float(row["p50_ns"]) / 1000, float(row["p99_ns"]) / 1000
        loaded = {}
        for shape, motion in order:
            stem = shape.replace(" ", "_")
            if shape not in loaded:
                bodies = [(table(folder / f"cases/{stem}.{x}.csv"), table(folder / f"cases/{stem}.{x}.faces.csv", int)) for x in "ab"]
                loaded[shape] = [Coal(bodies), MuJoCo(bodies)]
            peers = loaded[shape]
            poses = table(folder / f"cases/{stem}.{motion.replace(' ', '_')}.csv")
            results = run(peers, poses, motion in COHERENT)
            for peer, (cost, _) in zip(peers, results):
                figures[shape, motion][peer.name] = np.median(cost), np.percentile(cost, 99)
            coals, mujocos = results[0][1], results[1][1]
            differ = np.mean(np.abs(coals - mujocos) > 1e-4 * (1 + np.abs(coals)))
            if differ > 0:
                print(f"note: {shape}, {motion}: Coal and MuJoCo differ at {differ:.1%} of the poses", file=sys.stderr)
    lines = []
    for title, motions, ours in [
        ("Depth of overlapping pairs", OVERLAPPING, ["palpus local", "palpus proven"]),
        ("Distance of pairs apart", APART, ["palpus march"]),
    ]:
        theirs = ["parry epa" if motions is OVERLAPPING else "parry gjk", "coal", "mujoco"]
        header = ["shape", "motion", *ours, *theirs, *[f"{x.split()[1]} / fastest peer" for x in ours]]
        rows = []
        for shape, motion in order:
            if motion in motions:
                f = figures[shape, motion]
                fastest = min(f[x][0] for x in theirs)
                cells = [f"{f[x][0]:.2f} / {f[x][1]:.2f}" for x in [*ours, *theirs]]
                rows.append([shape, motion, *cells, *[f"{f[x][0] / fastest:.3f}" for x in ours]])
        if rows:
            lines += [f"{title} (µs, p50 / p99)", ""]
            widths = [max(len(r[k]) for r in [header, *rows]) for k in range(len(header))]
            lines.append("| " + " | ".join(c.ljust(w) for c, w in zip(header, widths)) + " |")
            lines.append("|" + "|".join("-" * (w + 2) for w in widths) + "|")
            lines += ["| " + " | ".join(c.ljust(w) for c, w in zip(r, widths)) + " |" for r in rows]
            lines.append("")
    print("\n".join(lines))
    if markdown:
        pathlib.Path(markdown).write_text("\n".join(lines))


if __name__ == "__main__":
    main()
