#!/usr/bin/env python3
"""Computes MuJoCo's answers to the motions of the open benchmark (docs/open-benchmark.md).

usage: mujoco_open.py PALPUS OPEN --out ANSWERS [--scene NAME]...      (needs mujoco and numpy from PyPI)
       mujoco_open.py --check

OPEN is the folder of `palpus bench open --scenes-only --out OPEN`. For each scene a mocap body
follows the motion, and a weld connects the tool to it. The answer is the weld's wrench about the
grip. The weld is a spring of the scene's stiffness with 0.7 of critical damping, and contacts are as
stiff as the step allows (`spring`). Parts are divided into convex ones as in mujoco_feel.py.
--check presses a flat box on a table, straight and tilted. The weld's force must equal stiffness
times depth, and its wrench must equal the wrench of the contacts, within CLOSE. Afterwards run

    palpus bench open --out OPEN --engine mujoco=ANSWERS
"""
import argparse
import csv
import json
import pathlib
import tempfile

import mujoco
import numpy as np
from mujoco_feel import MM, Solid, matrix, read_obj, replay, scene_model

CLOSE = 2e-3        # largest allowed difference, relative to the force; for torques, to the force times the box's size
DAMPING = 0.7       # fraction of critical damping
IMPEDANCE = 0.5     # impedance of the weld; a constant, so that the stiffness does not depend on the stretch

COLUMNS = ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "step_us"]


def spring(model, stiffness):
    """Makes the weld a spring of this stiffness (N/m), and contacts as stiff as steps of 1 ms allow.

    At rest MuJoCo's constraint pushes by K r m / (1 - d), where d is its impedance, -K its solref,
    r the stretch and 1/m the body's inverse weight.
    """
    weight = model.body_invweight0[model.eq_obj2id[0], 0]
    share = weight * (1 - IMPEDANCE)
    model.eq_solimp[0, :3] = [IMPEDANCE, IMPEDANCE, 1e-3]
    model.eq_solref[0, :2] = [-stiffness * share, -2 * DAMPING * np.sqrt(stiffness / weight) * share]
    model.geom_solref[:] = [0.004, 1.0]
    model.geom_solimp[:, :3] = [0.99, 0.999, 1e-4]


def check():
    """Presses a flat box; returns the largest difference from the analytic result, relative to the force."""
    size, height, stiffness, worst = np.array([0.02, 0.015, 0.01]), 0.0101, 1000.0, 0.0
    for depth, tilt in ((1e-4, 0.0), (5e-4, 0.0), (1e-3, 0.0), (1e-3, 0.02)):
        model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="0.001" gravity="0 0 0" cone="elliptic"/><worldbody>
        <geom type="box" size=".1 .1 .05" pos="0 0 -.05"/><body name="hand" mocap="true" pos="0 0 {height}"/>
        <body name="tool" pos="0 0 {height}"><freejoint/><geom type="box" size="{size[0]} {size[1]} {size[2]}" mass="0.05"/></body>
        </worldbody><equality><weld body1="hand" body2="tool" relpose="0 0 0 1 0 0 0"/></equality></mujoco>""")
        spring(model, stiffness)
        poses = np.tile([0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0], (2500, 1))
        ramp = np.clip(np.arange(2500) / 500, 0, 1)
        poses[:, 2] -= ramp * (depth + height - size[2])
        half = tilt / 2 * np.clip(np.arange(2500) / 500 - 1.4, 0, 1)
        poses[:, 3], poses[:, 5] = np.cos(half), np.sin(half)
        data = mujoco.MjData(model)
        felt = replay(model, poses, data)[0][-1]
        contacts = np.zeros(6)
        for k in range(data.ncon):
            contact, local = data.contact[k], np.zeros(6)
            mujoco.mj_contactForce(model, data, k, local)
            force = contact.frame.reshape(3, 3).T @ local[:3]
            force *= 1 if model.geom_bodyid[contact.geom2] == 2 else -1
            contacts += np.concatenate([force, np.cross(contact.pos - data.qpos[:3], force)])
        wrong = max(np.abs(felt[:3] - [0, 0, stiffness * depth]).max(), np.abs(felt[:3] - contacts[:3]).max(),
                    np.abs(felt[3:] - contacts[3:]).max() / size[0]) / (stiffness * depth)
        print(f"box pressed {1e3 * depth:.1f} mm, tilted {tilt:.2f} rad: {felt[2]:.5f} N of {stiffness * depth:.5f} N, "
              f"{1e3 * felt[4]:.4f} mN·m of {1e3 * contacts[4]:.4f} mN·m; off by {100 * wrong:.3f} %")
        worst = max(worst, wrong)
    return worst


def answer(scene, palpus, folder):
    """Returns the rows of the answer file."""
    solids = []
    # palpus prepares pieces from these copies. The benchmark's meshes are in metres, mujoco_feel's in millimetres.
    for name, copy in (("probe.obj", "tool.obj"), ("environment.obj", "part.obj")):
        (folder / copy).write_text("".join(
            "v {:.17g} {:.17g} {:.17g}\n".format(*(float(x) / MM for x in line.split()[1:4])) if line.startswith("v ") else line
            for line in open(scene / name)))
        (group,) = read_obj(folder / copy)
        solids.append(Solid(*group))
    parameters = json.loads((scene / "parameters.json").read_text())
    rows = list(csv.DictReader(open(scene / "motion.csv")))
    poses = np.array([[float(row[c]) for c in ("tx", "ty", "tz", "qw", "qx", "qy", "qz")] for row in rows])
    friction = (parameters["friction"] or [1e-5])[0]
    model, cut = scene_model(folder, *solids, palpus, friction, poses[0])
    spring(model, parameters["stiffness"])
    wrenches, _, seconds = replay(model, poses)
    # The weld's torque is about the origin of the tool's mesh.
    levers = np.array([matrix(pose[3:]) @ parameters["grip"] for pose in poses])
    wrenches[:, 3:] -= np.cross(levers, wrenches[:, :3])
    return cut, np.column_stack([wrenches, 1e6 * seconds])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpus", nargs="?")
    parser.add_argument("open", type=pathlib.Path, nargs="?")
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--scene", action="append")
    wanted = parser.parse_args()
    if wanted.check:
        raise SystemExit(0 if check() <= CLOSE else f"the weld is off by more than {100 * CLOSE} %")
    if not (wanted.palpus and wanted.open and wanted.out):
        parser.error("PALPUS, OPEN and --out are needed")
    palpus = str(pathlib.Path(wanted.palpus).resolve())
    wanted.out.mkdir(parents=True, exist_ok=True)
    scenes = sorted(path for path in (wanted.open / "scenes").iterdir() if path.is_dir())
    for scene in scenes:
        if wanted.scene and scene.name not in wanted.scene:
            continue
        with tempfile.TemporaryDirectory() as folder:
            cut, rows = answer(scene, palpus, pathlib.Path(folder))
        with open(wanted.out / f"{scene.name}.csv", "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            writer.writerows([[f"{x:.9g}" for x in row] for row in rows])
        print(f"{scene.name}: {len(rows)} poses, {cut}", flush=True)


if __name__ == "__main__":
    main()
