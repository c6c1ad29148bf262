#!/usr/bin/env python3
"""Compares flush faces, play and machine parts in MuJoCo and palpus, on the same hand motion.

usage: mujoco_feel.py PALPUS [--out DIR] [--scene NAME]...      (needs mujoco and numpy from PyPI)

1. `palpus run SCENE --record` runs the closed loop; the recording has the device's pose and the
   felt wrench.
2. MuJoCo replays that device motion open loop at 1 kHz: a mocap body follows it, and a weld
   constraint (MuJoCo's default solref) connects the tool to it. The felt wrench is the wrench of the
   weld. Gravity is off.
3. Non-convex parts are divided into convex ones: boxes where all faces are axis-aligned, otherwise
   palpus's own pieces.
4. Both wrenches are measured in the same way: hum above 10 Hz in the last second at rest, the
   largest net work on the hand along the recorded motion, the true overlap of the meshes (winding
   number of samples of both surfaces), and the time of a step.

Hum, energy along this motion and overlap can be compared, with these limits. MuJoCo's hand cannot
yield to the force, because the motion was recorded with palpus's force. The solver decides whether
the weld is softer or stiffer than palpus's coupling. Contacts of both have their default softness.
palpus's overlap comes from `palpus bench feel` (normal hand, without the safety chain).
"""
import argparse
import csv
import json
import pathlib
import subprocess
import tempfile
import time

import mujoco
import numpy as np

# Scenes, and the time at which the last second at rest ends (s).
SCENES = {"slot": 3.8, "drawer": 3.8, "key": 3.8, "square-peg": 3.8, "box-slide": 4.4, "screwdriver": 5.4,
          "ball-joint": 2.6, "gears": 3.4, "rollers": 3.4}
DENSITY = 1000.0    # kg/m³, the density of palpus's tool
WINDOW = 101        # ticks of the moving average that is subtracted; frequencies above 10 Hz remain
SPACING = 0.5e-3    # m between samples along an edge
FEW_TRIANGLES = 200
MM = 1e-3


def read_obj(path):
    """Returns the groups of an OBJ file as (vertices, triangles)."""
    vertices, groups = [], []
    for line in open(path):
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(x) for x in words[1:4]])
        elif words[:1] in (["g"], ["o"]):
            groups.append([])
        elif words[:1] == ["f"]:
            if not groups:
                groups.append([])
            corner = [int(w.split("/")[0]) - 1 for w in words[1:]]
            groups[-1] += [[corner[0], corner[k], corner[k + 1]] for k in range(1, len(corner) - 1)]
    vertices = np.array(vertices) * MM
    return [(vertices, np.array(group)) for group in groups if group]


def compact(vertices, triangles):
    used, index = np.unique(triangles, return_inverse=True)
    return vertices[used], index.reshape(-1, 3)


class Solid:
    """A closed surface: inside test, distance, samples."""

    def __init__(self, vertices, triangles):
        self.vertices, self.triangles = compact(vertices, triangles)
        self.corners = self.vertices[self.triangles]
        self.low, self.high = self.vertices.min(0), self.vertices.max(0)
        edges = {tuple(sorted((t[k], t[(k + 1) % 3]))) for t in self.triangles.tolist() for k in range(3)}
        samples = [self.vertices, self.corners.mean(1)]
        for a, b in edges:
            a, b = self.vertices[a], self.vertices[b]
            count = int(np.ceil(np.linalg.norm(b - a) / SPACING))
            samples.append(a + np.linspace(0, 1, count + 1)[1:-1, None] * (b - a))
        self.samples = np.concatenate(samples)

    def winding(self, points):
        total = np.zeros(len(points))
        for chunk in np.array_split(np.arange(len(self.corners)), max(1, len(self.corners) // 256)):
            a, b, c = (self.corners[chunk][None, :, k] - points[:, None] for k in range(3))
            la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
            triple = (a * np.cross(b, c)).sum(2)
            total += 2 * np.arctan2(triple, la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb).sum(1)
        return total / (4 * np.pi)

    def distance(self, points):
        best = np.full(len(points), np.inf)
        for a, b, c in self.corners:
            normal = np.cross(b - a, c - a)
            normal /= np.linalg.norm(normal)
            height = (points - a) @ normal
            foot = points - height[:, None] * normal
            within = np.all([(np.cross(q - p, foot - p) @ normal) >= 0 for p, q in ((a, b), (b, c), (c, a))], axis=0)
            far = np.full(len(points), np.inf)
            for p, q in ((a, b), (b, c), (c, a)):
                part = np.clip((points - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
                far = np.minimum(far, np.linalg.norm(points - p - part[:, None] * (q - p), axis=1))
            best = np.minimum(best, np.where(within, abs(height), far))
        return best

    def depth(self, points):
        points = points[np.all((points > self.low) & (points < self.high), axis=1)]
        if len(points):
            points = points[self.winding(points) > 0.5]
        return float(self.distance(points).max()) if len(points) else 0.0

    def boxes(self):
        """The solid as boxes, if all faces are axis-aligned; `None` otherwise."""
        normals = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        if (abs(normals).max(1) < 1 - 1e-9).any():
            return None
        cuts = [np.unique(self.vertices[:, k].round(9)) for k in range(3)]
        shape = [len(c) - 1 for c in cuts]
        middles = np.stack(np.meshgrid(*[(c[1:] + c[:-1]) / 2 for c in cuts], indexing="ij"), -1).reshape(-1, 3)
        full = (self.winding(middles) > 0.5).reshape(shape)
        boxes = []
        while full.any():
            low = np.argwhere(full)[0]
            high = low + 1
            for axis in range(3):    # grow the box as long as it is full
                while high[axis] < shape[axis]:
                    grown = high.copy()
                    grown[axis] += 1
                    if not full[tuple(slice(l, h) for l, h in zip(low, grown))].all():
                        break
                    high = grown
            full[tuple(slice(l, h) for l, h in zip(low, high))] = False
            boxes.append(([cuts[k][low[k]] for k in range(3)], [cuts[k][high[k]] for k in range(3)]))
        return boxes


def matrix(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def geoms(name, solid, pieces_file, palpus, friction):
    """Returns MuJoCo assets, geoms and a description of how the part was divided."""
    common = f'friction="{friction} 0.0001 0.0001" condim="3" density="{DENSITY}"'
    boxes = solid.boxes()
    if boxes:
        body = "".join(
            '<geom type="box" pos="{} {} {}" size="{} {} {}" {}/>'.format(
                *(np.add(low, high) / 2), *(np.subtract(high, low) / 2), common) for low, high in boxes)
        return "", body, f"{len(boxes)} boxes"
    edge_heights = [((solid.vertices - c[0]) @ np.cross(c[1] - c[0], c[2] - c[0])).max() for c in solid.corners]
    if max(edge_heights) < 1e-12:
        parts = [(solid.vertices, solid.triangles)]
    else:
        subprocess.run([palpus, "prepare", pieces_file, "--pieces", f"{pieces_file}.pieces.obj"], check=True,
                       capture_output=True)
        parts = [compact(*group) for group in read_obj(f"{pieces_file}.pieces.obj")]
        parts = [p for p in parts if np.linalg.matrix_rank(p[0] - p[0][0], tol=1e-7) == 3]
    assets, body = "", ""
    for k, (vertices, _) in enumerate(parts):
        points = " ".join(f"{x:.9g}" for x in vertices.ravel())
        assets += f'<mesh name="{name}{k}" vertex="{points}" inertia="convex"/>'
        body += f'<geom type="mesh" mesh="{name}{k}" {common}/>'
    return assets, body, f"{len(parts)} hulls"


def scene_model(folder, tool, part, palpus, friction, start):
    tool_assets, tool_geoms, tool_cut = geoms("tool", tool, folder / "tool.obj", palpus, friction)
    part_assets, part_geoms, part_cut = geoms("part", part, folder / "part.obj", palpus, friction)
    place = 'pos="{} {} {}" quat="{} {} {} {}"'.format(*start)
    # The tool has the inertia of the solid. Pieces overlap, so the sum of their inertias would be wrong.
    spread = (tool.high - tool.low)
    signed = np.einsum("ij,ij->i", tool.corners[:, 0], np.cross(tool.corners[:, 1], tool.corners[:, 2])) / 6
    mass = DENSITY * signed.sum()
    center = (signed[:, None] * tool.corners.sum(1) / 4).sum(0) / signed.sum()
    moments = mass / 12 * ((spread ** 2).sum() - spread ** 2)
    xml = f"""<mujoco><compiler angle="radian"/><option timestep="0.001" gravity="0 0 0" jacobian="dense" cone="elliptic"/>
    <size memory="512M"/><asset>{tool_assets}{part_assets}</asset><worldbody>
    <body name="hand" mocap="true" {place}/>
    <body name="tool" {place}><freejoint/>
    <inertial pos="{center[0]} {center[1]} {center[2]}" mass="{mass}" diaginertia="{moments[0]} {moments[1]} {moments[2]}"/>
    {tool_geoms}</body>{part_geoms}</worldbody>
    <equality><weld body1="hand" body2="tool" relpose="0 0 0 1 0 0 0"/></equality></mujoco>"""
    return mujoco.MjModel.from_xml_string(xml), f"{tool_cut}, {part_cut}"


def replay(model, poses, data=None):
    """Returns the felt wrench (on the hand, about the tool's origin), tool poses and seconds per step; changes the state in `data`."""
    data = data or mujoco.MjData(model)
    wrenches, tools, seconds = np.zeros((len(poses), 6)), np.zeros((len(poses), 7)), np.zeros(len(poses))
    for k, pose in enumerate(poses):
        data.mocap_pos[0], data.mocap_quat[0] = pose[:3], pose[3:]
        begin = time.perf_counter()
        mujoco.mj_step(model, data)
        seconds[k] = time.perf_counter() - begin
        rows = data.efc_J.reshape(-1, model.nv)[: data.ne]
        generalized = rows.T @ data.efc_force[: data.ne]
        # The wrench on the hand is the opposite. A free joint's torque is in the body's frame.
        wrenches[k, :3] = -generalized[:3]
        wrenches[k, 3:] = -matrix(data.qpos[3:7]) @ generalized[3:6]
        tools[k] = data.qpos[:7]
    return wrenches, tools, seconds


def hum(values, times, end):
    x = values[(times >= end - 1) & (times < end)]
    if len(x) < WINDOW:
        return float("nan")
    mean = np.stack([np.convolve(x[:, k], np.ones(WINDOW) / WINDOW, "valid") for k in range(3)], 1)
    return float(np.sqrt(((x[WINDOW // 2: -(WINDOW // 2)] - mean) ** 2).sum(1).mean()))


def energy(wrenches, poses):
    moved = np.diff(poses[:, :3], axis=0)
    a, b = poses[:-1, 3:], poses[1:, 3:]
    turned = 2 * (a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(b[:, 1:], a[:, 1:]))
    turned *= np.sign((a * b).sum(1))[:, None]
    work = (wrenches[:-1, :3] * moved).sum(1) + (wrenches[:-1, 3:] * turned).sum(1)
    return float(max(0.0, work.cumsum().max()))


def overlap(tool, part, tools):
    step = 20 if len(tool.triangles) + len(part.triangles) < FEW_TRIANGLES else 200
    most = 0.0
    for pose in tools[::step]:
        turn, place = matrix(pose[3:]), pose[:3]
        most = max(most, part.depth(tool.samples @ turn.T + place), tool.depth((part.samples - place) @ turn))
    return most


def measure(name, palpus, folder):
    export = folder / name
    subprocess.run([palpus, "export", name, export], check=True, capture_output=True)
    (tool,), (part,) = ([Solid(*g) for g in read_obj(export / f)] for f in ("tool.obj", "part.obj"))
    run = subprocess.run([palpus, "run", name, "--headless", "--fast", "--json", "--duration", "5.4", "--record",
                          export / "run.csv"], check=True, capture_output=True, text=True)
    summary = json.loads(run.stdout)
    rows = list(csv.DictReader(l for l in open(export / "run.csv") if not l.startswith("#")))
    column = lambda *names: np.array([[float(row[n]) for n in names] for row in rows])
    times = column("time_ns")[:, 0] * 1e-9
    poses = column(*(f"device_{c}" for c in ("tx", "ty", "tz", "qw", "qx", "qy", "qz")))
    felt = column("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
    bench = subprocess.run([palpus, "bench", "feel", "--quick", "--scene", name, "--method", "coupled-smooth", "--out",
                            export / "feel"], capture_output=True, text=True)
    figures = json.loads((export / "feel/feel.json").read_text())["rows"] if bench.returncode == 0 else []
    true_overlap = next((r["value"] for r in figures if r["measure"] == "true overlap"), float("nan"))
    friction = 0.3 if "friction" in (export / "scene.toml").read_text() else 0.0
    end = SCENES[name]
    result = [dict(scene=name, engine="palpus", cut="", hum_mn=1e3 * hum(felt[:, :3], times, end),
                   hum_mnm=1e3 * hum(felt[:, 3:], times, end), energy_uj=1e6 * energy(felt, poses),
                   overlap_um=1e6 * true_overlap, step_us=summary["step_us"]["p50"], step_p999_us=summary["step_us"]["p999"])]
    model, cut = scene_model(export, tool, part, palpus, max(friction, 1e-5), poses[0])
    wrenches, tools, steps = replay(model, poses)
    result.append(dict(scene=name, engine=f"MuJoCo {mujoco.__version__}", cut=cut,
                       hum_mn=1e3 * hum(wrenches[:, :3], times, end), hum_mnm=1e3 * hum(wrenches[:, 3:], times, end),
                       energy_uj=1e6 * energy(wrenches, poses), overlap_um=1e6 * overlap(tool, part, tools),
                       step_us=1e6 * np.median(steps), step_p999_us=1e6 * np.quantile(steps, 0.999)))
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpus")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("palpus-out/mujoco"))
    parser.add_argument("--scene", action="append", choices=list(SCENES))
    wanted = parser.parse_args()
    palpus = str(pathlib.Path(wanted.palpus).resolve())
    wanted.out.mkdir(parents=True, exist_ok=True)
    head = ["scene", "engine", "cut", "hum_mn", "hum_mnm", "energy_uj", "overlap_um", "step_us", "step_p999_us"]
    titles = ["scene", "engine", "tool, part", "hum at rest (mN)", "hum at rest (mN·m)", "energy given (µJ)",
              "true overlap (µm)", "step p50 (µs)", "p99.9 (µs)"]
    lines = [f"| {' | '.join(titles)} |", "|---|---|---|" + "---:|" * 6]
    print("\n".join(lines))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in wanted.scene or SCENES:
            for row in measure(name, palpus, pathlib.Path(folder)):
                rows.append(row)
                cells = [row[h] if isinstance(row[h], str) else f"{row[h]:.3g}" for h in head]
                lines.append(f"| {' | '.join(cells)} |")
                print(lines[-1], flush=True)
    (wanted.out / "mujoco_feel.md").write_text("\n".join(lines) + "\n")
    with open(wanted.out / "mujoco_feel.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, head)
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
