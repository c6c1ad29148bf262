#!/usr/bin/env python3
"""A god-object with contacts from Coal, as an engine of the open benchmark (docs/open-benchmark.md).

usage: coal_open.py OPEN --out ANSWERS [--scene NAME]...      (needs coal, numpy and scipy from PyPI)

OPEN is the folder of `palpus bench open --scenes-only --out OPEN`. The proxy follows Ortega, Redon and
Coquillart (2007). Coal finds the contacts; this script computes the rest:

1. Coal collides the two triangle meshes at the proxy's pose, with a security margin of MARGIN; each
   pair of triangles within the margin gives a plane that the proxy must not cross.
2. The proxy moves to the pose that is nearest to the hand's pose, measured by the energy of the
   spring between them, and crosses no plane (least distance programming, solved with non-negative
   least squares).
3. If the proxy then intersects the part, the step is halved until it does not. Steps 1 to 3 run
   twice in each tick.
4. The wrench is the wrench of the spring. Its stiffness at the grip is the scene's; its angular
   stiffness is the scene's times the square of the probe's radius of gyration.

There is no friction. The proxy never enters the part unless the motion begins inside. Afterwards
run

    palpus bench open --out OPEN --engine coal-god-object=ANSWERS
"""
import argparse
import csv
import json
import pathlib
import time

import coal
import numpy as np
from coal_scale import read_obj, tree
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

COLUMNS = ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "step_us"]
MARGIN = 5e-4       # m: nearer pairs of triangles are contacts; a plane is valid within this distance
SKIN = 1e-5         # m: gap between proxy and part, so that Coal's normals are defined
ROUNDS = 2          # number of times that planes are computed in a tick
HALVINGS = 6
MOST = 200          # number of contacts for the solver; the nearest are used


class Proxy:
    def __init__(self, scene):
        parameters = json.loads((scene / "parameters.json").read_text())
        self.grip, self.stiffness = np.array(parameters["grip"]), parameters["stiffness"]
        self.probe, self.part = tree(scene / "probe.obj", 1.0), tree(scene / "environment.obj", 1.0)
        vertices, _ = read_obj(scene / "probe.obj")
        gyration = np.sqrt(((vertices - vertices.mean(0)) ** 2).sum(1).mean())
        # A displacement is multiplied by this vector. Then its squared length times the stiffness
        # is twice the energy of the spring.
        self.scale = np.array([1.0] * 3 + [gyration] * 3)
        self.place, self.turn = None, None
        self.identity = coal.Transform3s.Identity()

    def collide(self, place, turn, margin):
        """Returns normals (from probe to part), points and distances of the triangles within the margin."""
        matrix = turn.as_matrix()
        request, result = coal.CollisionRequest(), coal.CollisionResult()
        request.enable_contact, request.num_max_contacts, request.security_margin = True, 5000 if margin else 1, margin
        pose = coal.Transform3s(matrix, place - matrix @ self.grip)
        coal.collide(self.probe, pose, self.part, self.identity, request, result)
        if not margin:
            return result.isCollision()
        contacts = result.getContacts()
        if len(contacts) == 0:
            return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
        normals = np.array([c.normal for c in contacts])
        points = np.array([c.pos for c in contacts])
        gaps = np.array([c.penetration_depth for c in contacts])
        nearest = np.argsort(gaps)[:MOST]
        return normals[nearest], points[nearest], gaps[nearest]

    def step(self, place, turn):
        """Returns the wrench on the hand, whose grip is at `place`."""
        if self.place is None:
            self.place, self.turn = place, turn
        for _ in range(ROUNDS):
            wanted = np.concatenate([place - self.place, (turn * self.turn.inv()).as_rotvec()]) * self.scale
            size = np.abs(wanted).max()
            if size == 0.0:
                break
            normals, points, gaps = self.collide(self.place, self.turn, MARGIN)
            move = wanted
            if len(gaps):
                # Each row gives the change of a gap when the proxy moves. The gap may shrink to
                # SKIN.
                rows = -np.hstack([normals, np.cross(points - self.place, normals)]) / self.scale
                move = wanted + least(rows, SKIN - gaps - rows @ wanted)
            # Planes are only valid within the margin.
            share = min(1.0, MARGIN / max(np.abs(move).max(), 1e-12)) if len(gaps) else 1.0
            for _ in range(HALVINGS):
                step = share * move / self.scale
                moved = self.place + step[:3], Rotation.from_rotvec(step[3:]) * self.turn
                if not self.collide(*moved, 0.0):
                    self.place, self.turn = moved
                    break
                share /= 2.0
        spring = np.concatenate([self.place - place, (self.turn * turn.inv()).as_rotvec()])
        return self.stiffness * spring * self.scale ** 2


def least(rows, bounds):
    """Returns the shortest x with rows x ≥ bounds [Lawson, Hanson 1974, 23], or zero without a
    solution."""
    if (bounds <= 0.0).all():
        return np.zeros(6)
    unit = max(np.abs(bounds).max(), 1e-9)
    table = np.vstack([rows.T, bounds[None] / unit])
    goal = np.zeros(7)
    goal[6] = 1.0
    try:
        weights, _ = nnls(table, goal)
    except RuntimeError:    # its limit of iterations was reached
        return np.zeros(6)
    rest = table @ weights - goal
    return -rest[:6] / rest[6] * unit if rest[6] < -1e-12 else np.zeros(6)


def answer(scene):
    proxy = Proxy(scene)
    answers = []
    for row in csv.DictReader(open(scene / "motion.csv")):
        turn = Rotation.from_quat([float(row[c]) for c in ("qx", "qy", "qz", "qw")])
        place = np.array([float(row[c]) for c in ("tx", "ty", "tz")]) + turn.apply(proxy.grip)
        begin = time.perf_counter()
        wrench = proxy.step(place, turn)
        answers.append([*wrench, 1e6 * (time.perf_counter() - begin)])
    return answers


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("open", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--scene", action="append")
    wanted = parser.parse_args()
    wanted.out.mkdir(parents=True, exist_ok=True)
    for scene in sorted(path for path in (wanted.open / "scenes").iterdir() if path.is_dir()):
        if wanted.scene and scene.name not in wanted.scene:
            continue
        rows = answer(scene)
        with open(wanted.out / f"{scene.name}.csv", "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            writer.writerows([[f"{x:.9g}" for x in row] for row in rows])
        print(f"{scene.name}: {len(rows)} poses", flush=True)


if __name__ == "__main__":
    main()
