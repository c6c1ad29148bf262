#!/usr/bin/env python3
"""Compares palpus, Coal, MuJoCo, Newton and Drake on close-fitting contact, on the same poses in one run.

usage: conformal_peers.py PALPUS MODELS [--out DIR] [--only NAME]... [--quick]
       (needs numpy, coal, mujoco, newton, drake and tetgen from PyPI; an engine that is missing has no figures)

For each case of docs/peers.md:

1. `palpus bench conformal --traces` renders the motion, and writes pairs of consecutive poses with
   palpus's answer and the truth.
2. Each engine processes these poses, one engine after the other, each in a process of its own. If an
   engine is slow, it gets a part of the poses, evenly spread. An engine that needs more than 60 s of processor
   time (15 s with --quick) or MEMORY bytes to prepare the bodies has no figures; the table states the reason.
3. Coal's test of all pairs of triangles, an exact test, decides whether the bodies overlap and whether they
   are nearer than the tolerance.

All times are processor time of one thread in microseconds, without the cost of an empty Python call.
docs/peers.md states what is timed. Writes conformal_peers.md and conformal_peers.json to DIR.
"""
import argparse
import csv
import gc
import importlib.metadata
import importlib.util
import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import time

import numpy as np

from coal_scale import read_obj, transform

# Cases with the same bodies, so that the bodies are prepared once.
GROUPS = [["nut-0.2%", "nut-1%", "nut-5%", "nut-bolt"], ["gears"], ["drill-blade"], ["lucy-embryo"],
          ["armadillo-intestine"], ["spoon-cup"], ["peg-hole"]]
SLOW = {"gears", "drill-blade", "lucy-embryo"}      # left out with --quick, unless named with --only
MEMORY = 12 << 30           # bytes of address space
# Ticks, pairs of poses, s for one engine and case, s for the preparation of an engine.
FULL, QUICK = (2000, 16, 3.0, 60), (600, 6, 1.0, 15)
EMPTY_CALLS = 200


def clock():
    return time.thread_time_ns() / 1000


class Coal:
    """All contacts within the tolerance: OBB trees, security margin. Timed: `coal.collide`."""

    package = "coal"

    def __init__(self, probe, part):
        from coal_scale import coal, tree
        self.coal = coal
        self.bodies = [tree(body, 1.0) for body in (probe, part)]
        self.identity = coal.Transform3s.Identity()

    def collide(self, row, margin, most):
        request, result = self.coal.CollisionRequest(), self.coal.CollisionResult()
        request.enable_contact, request.num_max_contacts, request.security_margin = True, most, margin
        place = transform(row)
        begin = clock()
        self.coal.collide(self.bodies[0], place, self.bodies[1], self.identity, request, result)
        return clock() - begin, result

    def query(self, row, tolerance):
        spent, result = self.collide(row, tolerance, 1000000)
        contacts = result.getContacts()
        # Coal's normals point from the first body to the second.
        normals = np.array([-contact.normal for contact in contacts]).reshape(-1, 3)
        return spent, normals, np.array([contact.penetration_depth for contact in contacts])

    def judge(self, row, tolerance):
        """Returns whether triangles of the two bodies intersect, and whether some are within the tolerance."""
        return [self.collide(row, margin, 1)[1].isCollision() for margin in (0.0, tolerance)]


class MuJoCo:
    """Mesh SDFs of both bodies (octrees), default settings. Timed: `mj_collision`.

    The separation of a contact is the larger of two signed distances, at a point between the surfaces. So its depth may be the whole
    overlap or half of it; `figures` uses the reading that is nearer to the truth.
    """

    package = "mujoco"
    octree_depth, iterations, points = 6, 10, 40

    def __init__(self, probe, part):
        import mujoco
        self.mujoco = mujoco
        bodies = [read_obj(body) for body in (probe, part)]
        # MuJoCo's descent takes steps of a fraction of a unit, so the smaller body gets the size 1.
        self.scale = 1 / min(np.linalg.norm(np.ptp(vertices, axis=0)) for vertices, _ in bodies)
        spec = mujoco.MjSpec()
        spec.option.sdf_iterations, spec.option.sdf_initpoints = self.iterations, self.points
        spec.memory = 1 << 30
        for name, (vertices, triangles) in zip("ab", bodies):
            mesh = spec.add_mesh(name=name)
            mesh.uservert, mesh.userface = (vertices * self.scale).ravel(), triangles.ravel()
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            mesh.needsdf, mesh.octree_maxdepth = True, self.octree_depth
            body = spec.worldbody.add_body(name=name)
            body.add_freejoint()
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_SDF, meshname=name)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.data.qpos[7:] = [0, 0, 0, 1, 0, 0, 0]

    def query(self, row, tolerance):
        model, data = self.model, self.data
        model.geom_margin[:] = tolerance * self.scale
        data.qpos[:7] = [*row[:3] * self.scale, row[6], *row[3:6]]
        self.mujoco.mj_kinematics(model, data)
        self.mujoco.mj_comPos(model, data)
        begin = clock()
        self.mujoco.mj_collision(model, data)
        spent = clock() - begin
        signs = np.where(data.contact.geom[:, :1] == 0, -1.0, 1.0)      # frames point from the first geom to the second
        return spent, signs * data.contact.frame[:, :3], data.contact.dist / self.scale


class MuJoCoGenerous(MuJoCo):
    """As MuJoCo, with a finer octree, ten times the points and five times the iterations."""

    octree_depth, iterations, points = 7, 50, 400


class Newton:
    """Mesh contacts on the CPU, through the trees of the meshes. Timed: `CollisionPipeline.collide`."""

    package = "newton"

    def __init__(self, probe, part):
        import newton
        import warp
        self.newton = newton
        warp.set_device("cpu")
        builder = newton.ModelBuilder()
        for body in (probe, part):
            vertices, triangles = read_obj(body)
            mesh = newton.Mesh(vertices.astype(np.float32), triangles.astype(np.int32).ravel(), compute_inertia=False)
            builder.add_shape_mesh(builder.add_body(), mesh=mesh, cfg=newton.ModelBuilder.ShapeConfig(gap=0.0))
        self.model = builder.finalize(device="cpu")
        self.pipeline = newton.CollisionPipeline(self.model, broad_phase="nxn", rigid_contact_max=50000)
        self.contacts, self.state = self.pipeline.contacts(), self.model.state()

    @staticmethod
    def warm_up(folder):
        """Compiles Newton's kernels, which takes a minute the first time."""
        file = folder / "tetrahedron.obj"
        file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        Newton(file, file).query(np.array([0.1, 0.1, 0.1, 0, 0, 0, 1.0]), 0.01)

    def query(self, row, tolerance):
        self.model.shape_gap.fill_(tolerance / 2)       # the gaps of both shapes are added
        self.state.body_q.assign(np.array([row, [0, 0, 0, 0, 0, 0, 1]], dtype=np.float32))
        begin = clock()
        self.pipeline.collide(self.state, self.contacts)
        spent = clock() - begin
        count = self.contacts.rigid_contact_count.numpy()[0]
        shapes = self.contacts.rigid_contact_shape0.numpy()[:count]
        # Contact points are in the frames of their bodies; normals point from the first shape to the second.
        pose = transform(row)
        matrix, place = np.array(pose.getRotation()), np.array(pose.getTranslation())
        points = [self.contacts.rigid_contact_point0.numpy()[:count].astype(float),
                  self.contacts.rigid_contact_point1.numpy()[:count].astype(float)]
        of_probe = [(shapes == 0)[:, None], (shapes != 0)[:, None]]
        first, second = (np.where(moved, point @ matrix.T + place, point) for point, moved in zip(points, of_probe))
        normals = self.contacts.rigid_contact_normal.numpy()[:count].astype(float)
        separation = ((second - first) * normals).sum(1)
        near = separation < tolerance
        return spent, (np.where(shapes == 0, -1.0, 1.0)[:, None] * normals)[near], separation[near]


class Drake:
    """Hydroelastic contact: one body is compliant (tetrahedra from TetGen), the other one rigid. Timed: `ComputeContactSurfaces`."""

    package = "drake"
    MODULUS = 1e7
    UNIT = 1e-3         # m. In metres, Drake rejects the smallest triangles as degenerate.

    def __init__(self, probe, part):
        from pydrake import geometry
        from pydrake.math import RigidTransform, RotationMatrix
        from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
        from pydrake.multibody.tree import SpatialInertia
        from pydrake.systems.framework import DiagramBuilder
        self.geometry, self.RigidTransform, self.RotationMatrix = geometry, RigidTransform, RotationMatrix
        problems = []
        for self.compliant in (0, 1):
            try:
                volume = self.volume((probe, part)[self.compliant], pathlib.Path("volume.vtk"))
                break
            except RuntimeError as error:
                problems.append(str(error).strip().splitlines()[-1])
        else:
            raise RuntimeError(f"TetGen cannot divide either body into tetrahedra: {'; '.join(sorted(set(problems)))}")
        soft, rigid = geometry.ProximityProperties(), geometry.ProximityProperties()
        geometry.AddCompliantHydroelasticProperties(1.0, self.MODULUS, soft)
        geometry.AddRigidHydroelasticProperties(1.0, rigid)
        builder = DiagramBuilder()
        self.plant, self.scene = AddMultibodyPlantSceneGraph(builder, 0.0)
        self.body = self.plant.AddRigidBody("probe", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        for index, (body, file) in enumerate([(self.body, probe), (self.plant.world_body(), part)]):
            compliant = index == self.compliant
            properties = soft if compliant else rigid
            geometry.AddContactMaterial(friction=CoulombFriction(0.0, 0.0), properties=properties)
            mesh = geometry.Mesh(str(volume.resolve())) if compliant else geometry.Mesh(str(file), 1 / self.UNIT)
            self.plant.RegisterCollisionGeometry(body, RigidTransform(), mesh, str(index), properties)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.frame = self.plant.GetBodyFrameIdOrThrow(self.body.index())
        inspector = self.scene.model_inspector()
        self.soft = next(one for one in inspector.GetAllGeometryIds()
                         if inspector.GetName(one).endswith(str(self.compliant)))

    def volume(self, file, out):
        """Writes the solid's tetrahedra as VTK, refined as Drake's pressure field needs it; sets `extent`, the largest depth in the solid."""
        import tetgen
        from coal_scale import coal, tree
        vertices, triangles = read_obj(file)
        vertices, index = np.unique(vertices, axis=0, return_inverse=True)
        unit = np.ptp(vertices)
        nodes, cells = tetgen.TetGen(vertices / unit, index.ravel()[triangles]).tetrahedralize(plc=True, quality=False, nobisect=True)[:2]
        mesh = self.geometry.VolumeMesh([self.geometry.VolumeElement(*map(int, cell[:4])) for cell in cells], list(nodes * (unit / self.UNIT)))
        mesh = self.geometry.RefineVolumeMesh(mesh)
        nodes = np.array(mesh.vertices())
        cells = [[element.vertex(k) for k in range(4)] for element in mesh.tetrahedra()]
        out.write_text("# vtk DataFile Version 3.0\nsolid\nASCII\nDATASET UNSTRUCTURED_GRID\n"
                       f"POINTS {len(nodes)} double\n" + "".join("{:.17g} {:.17g} {:.17g}\n".format(*node) for node in nodes)
                       + f"CELLS {len(cells)} {5 * len(cells)}\n" + "".join("4 {} {} {} {}\n".format(*cell) for cell in cells)
                       + f"CELL_TYPES {len(cells)}\n" + "10\n" * len(cells))
        # The first nodes are the vertices of the surface.
        surface, point = tree(file, 1 / self.UNIT, coal.BVHModelOBBRSS()), coal.Sphere(1e-9)
        self.extent = max(coal.distance(point, coal.Transform3s(np.eye(3), node), surface, coal.Transform3s.Identity(),
                                        coal.DistanceRequest(), coal.DistanceResult()) for node in nodes[len(vertices):])
        return out

    def query(self, row, tolerance):
        """Each face of the contact surface is a contact. Its weight is the force (pressure times area)."""
        matrix = np.array(transform(row).getRotation())
        plant_context = self.plant.GetMyMutableContextFromRoot(self.context)
        self.plant.SetFreeBodyPose(plant_context, self.body, self.RigidTransform(self.RotationMatrix.ProjectToRotationMatrix(matrix), row[:3] / self.UNIT))
        query = self.scene.get_query_output_port().Eval(self.scene.GetMyContextFromRoot(self.context))
        query.GetPoseInWorld(self.frame)    # updates the poses, so that this is not timed
        begin = clock()
        surfaces = query.ComputeContactSurfaces(self.geometry.HydroelasticContactRepresentation.kPolygon)
        spent = clock() - begin
        forces, depths = [], []
        for surface in surfaces:
            # Normals point out of N, into M.
            sign = 1.0 if (surface.id_M() == self.soft) == (self.compliant == 0) else -1.0
            mesh, field = surface.poly_mesh_W(), surface.poly_e_MN()
            for face in range(surface.num_faces()):
                pressure = field.EvaluateCartesian(face, surface.centroid(face))
                forces.append(sign * pressure * surface.area(face) * surface.face_normal(face))
                depths.append(-pressure / self.MODULUS * self.extent * self.UNIT)
        return spent, np.array(forces).reshape(-1, 3), np.array(depths)


ENGINES = {"Coal": Coal, "MuJoCo SDF": MuJoCo, "MuJoCo SDF, generous": MuJoCoGenerous, "Newton": Newton, "Drake": Drake}


def spread(count):
    """Returns the numbers below `count` in an order whose beginnings are evenly spread."""
    bits = max(1, (count - 1).bit_length())
    return [k for k in (int(f"{k:0{bits}b}"[::-1], 2) for k in range(1 << bits)) if k < count]


def rows_of(folder):
    rows = list(csv.DictReader(open(folder / "trace.csv")))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def poses_of(trace):
    return np.column_stack([trace[name] for name in ("tx", "ty", "tz", "qx", "qy", "qz", "qw")])


def work(engine, folder, seconds, prepare, cases, out):
    """Runs an engine on the cases of a group, in its own process; writes a line of JSON for each case."""
    kind = ENGINES[engine]
    os.chdir(folder)        # TetGen and Drake need files
    if hasattr(kind, "warm_up"):
        kind.warm_up(out.parent)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    resource.setrlimit(resource.RLIMIT_CPU, (int(used) + prepare, resource.RLIM_INFINITY))     # ends the process
    solver = kind(folder / cases[0][0] / "probe.obj", folder / cases[0][0] / "environment.obj")
    resource.setrlimit(resource.RLIMIT_CPU, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    gc.disable()
    with open(out, "w") as file:
        for name, tolerance in cases:
            poses = poses_of(rows_of(folder / name))
            far = np.array([1e3, 0, 0, 0, 0, 0, 1.0])
            empty = np.median([solver.query(far, tolerance)[0] for _ in range(EMPTY_CALLS)])
            solver.query(poses[0], tolerance)
            result = {"case": name, "answers": {}}
            if engine == "Coal":
                result["judge"] = [solver.judge(pose, tolerance) for pose in poses]
            begin = clock()
            for pair in spread(len(poses) // 2):
                for k in (2 * pair, 2 * pair + 1):
                    spent, normals, separations = solver.query(poses[k], tolerance)
                    force = normals.sum(0) if engine == "Drake" else (normals * (tolerance - separations)[:, None]).sum(0)
                    deepest = separations.min() if len(separations) else None
                    result["answers"][k] = [max(0.0, spent - empty), len(separations), deepest, *force]
                if clock() - begin > 1e6 * seconds:
                    break
            file.write(json.dumps(result) + "\n")
            file.flush()


def run(engine, folder, seconds, prepare, cases):
    """Returns a result or the reason of its absence for each case."""
    out = folder / f"{cases[0][0]}-{engine}.json".replace(" ", "-")
    out.unlink(missing_ok=True)
    try:
        importlib.metadata.version(ENGINES[engine].package)
    except importlib.metadata.PackageNotFoundError:
        return {name: f"{ENGINES[engine].package} is not installed" for name, _ in cases}
    command = [sys.executable, str(pathlib.Path(__file__).resolve()), "--engine", engine, "--cases", json.dumps(cases), "--seconds", str(seconds),
               "--prepare", str(prepare), "--out", str(folder), "--answers", str(out)]
    environment = os.environ | {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    child = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment)
    lines = [json.loads(line) for line in open(out)] if out.exists() else []
    if child.returncode == -signal.SIGXCPU:
        reason = f"the preparation takes more than {prepare} s"
    else:
        reason = (child.stderr.strip().splitlines() or [f"ended with {child.returncode}"])[-1]
    return {name: next((line for line in lines if line["case"] == name), reason) for name, _ in cases}


def turns(forces):
    """Returns the angles in degrees between consecutive forces, for pairs that both have a force."""
    first, second = forces[0::2], forces[1::2]
    sizes = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    here = sizes > 0
    crossed = np.linalg.norm(np.cross(first[here], second[here]), axis=1)
    return np.degrees(np.arctan2(crossed, (first[here] * second[here]).sum(1)))


def figures(trace, judge, answers, halves=False):
    """Returns the figures of one engine; an answer has time, contacts, separation, force. `halves`: depths may be half of the overlap."""
    order = sorted(answers)
    count = np.array([answers[k][1] for k in order])
    separation = np.array([np.nan if answers[k][2] is None else answers[k][2] for k in order])
    overlap, near = judge[order].T
    depth = -trace["true_separation"][order]
    felt = overlap & (count > 0) & (depth > 0)
    readings = [np.abs(-part * separation[felt] - depth[felt]) / depth[felt] for part in ((1, 2) if halves else (1,))]
    error = min(readings, key=lambda values: np.median(values) if len(values) else 0.0)
    turn = turns(np.array([answers[k][3:] for k in order]))
    middle = lambda values, share: float(np.quantile(values, share)) if len(values) else None
    times = [answers[k][0] for k in order]
    return {"poses": len(order), "p50": middle(times, 0.5), "p99": middle(times, 0.99), "contacts": float(count.mean()),
            "missed": [int((overlap & (count == 0)).sum()), int(overlap.sum())],
            "ghosts": [int((~near & (count > 0)).sum()), int((~near).sum())],
            "depth_error": [middle(error, 0.5), middle(error, 1.0)], "turn": [middle(turn, 0.5), middle(turn, 1.0)]}


def of_palpus(trace, row):
    columns = np.column_stack([trace[name] for name in ("step_us", "contacts", "separation", "force_x", "force_y", "force_z")])
    answers = {k: [*values[:2], None if np.isinf(values[2]) else values[2], *values[3:]] for k, values in enumerate(columns.tolist())}
    truth = turns(np.column_stack([trace[f"true_force_{axis}"] for axis in "xyz"]))
    return answers, [float(np.median(truth)), float(truth.max())] if len(truth) else [None, None]


HEAD = ["case", "engine", "poses", "p50 (µs)", "p99 (µs)", "p50 over palpus's", "contacts", "missed", "ghosts",
        "depth error, median / largest (%)", "turn of the force, median / largest (°)"]


def line(name, engine, found, palpus):
    if isinstance(found, str):
        return f"| {name} | {engine} | no figures: {found.replace('|', '/')} |" + " |" * (len(HEAD) - 3)
    digits = lambda value: "-" if value is None else f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    both = lambda values, by: " / ".join("-" if value is None else f"{by * value:.2g}" if by * value < 100 else f"{by * value:.0f}" for value in values)
    ratio = digits(found["p50"] / palpus["p50"]) if palpus["p50"] else "-"
    cells = [name, engine, str(found["poses"]), digits(found["p50"]), digits(found["p99"]), ratio, digits(found["contacts"]),
             "{} of {}".format(*found["missed"]), "{} of {}".format(*found["ghosts"]), both(found["depth_error"], 100),
             both(found["turn"], 1)]
    return f"| {' | '.join(cells)} |"


def losses(name, rows):
    """Returns sentences about engines that are faster, more exact or smoother than palpus."""
    palpus, answer = rows["palpus"], []
    for engine, found in rows.items():
        if engine == "palpus" or isinstance(found, str):
            continue
        for which in ("p50", "p99"):
            if found[which] < palpus[which]:
                answer.append(f"{name}: {engine}'s {which} is smaller ({found[which]:.0f} µs, palpus {palpus[which]:.0f} µs)")
        for which, theirs, ours in zip(("median", "largest"), found["depth_error"], palpus["depth_error"]):
            if theirs is not None and ours is not None and theirs < ours:
                answer.append(f"{name}: {engine}'s {which} depth error is smaller ({100 * theirs:.2g} %, palpus {100 * ours:.2g} %)")
        if found["turn"][0] is not None and found["turn"][0] < palpus["turn"][0]:
            answer.append(f"{name}: {engine}'s net force turns less ({found['turn'][0]:.2g}°, palpus {palpus['turn'][0]:.2g}°)")
    return answer


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpus", nargs="?")
    parser.add_argument("models", nargs="?")
    parser.add_argument("--out", default="palpus-out/peers", type=pathlib.Path)
    names = [name for group in GROUPS for name in group]
    parser.add_argument("--only", action="append", choices=names)
    parser.add_argument("--quick", action="store_true", help="fewer poses, without the largest bodies, in less than three minutes")
    for hidden in ("--engine", "--cases", "--seconds", "--prepare", "--answers"):
        parser.add_argument(hidden, help=argparse.SUPPRESS)
    options = parser.parse_args()
    options.out = options.out.resolve()
    if options.engine:
        return work(options.engine, options.out, float(options.seconds), int(options.prepare), json.loads(options.cases), pathlib.Path(options.answers))
    if not (options.palpus and options.models):
        parser.error("PALPUS and MODELS are needed")
    ticks, pairs, seconds, prepare = QUICK if options.quick else FULL
    options.out.mkdir(parents=True, exist_ok=True)
    lines = [f"| {' | '.join(HEAD)} |", "|---|---|" + "---:|" * (len(HEAD) - 2)]
    print("\n".join(lines), flush=True)
    everything, lost = {}, []
    for group in GROUPS:
        wanted = [name for name in group if name in (options.only or names) and (options.only or not options.quick or name not in SLOW)]
        if not wanted:
            continue
        cases, steps = [], {}
        for name in wanted:
            folder = options.out / name
            subprocess.run([options.palpus, "bench", "conformal", "--models", options.models, "--out", options.out, "--only", name,
                            "--ticks", str(ticks), "--truths", str(pairs), "--traces"], check=True, stdout=subprocess.DEVNULL)
            [steps[name]] = json.load(open(options.out / "conformal.json"))
            cases.append((name, steps[name]["tolerance"]))
        found = {engine: run(engine, options.out, seconds, prepare, cases) for engine in ENGINES}
        for name in wanted:
            trace = rows_of(options.out / name)
            if isinstance(found["Coal"][name], str):
                sys.exit(f"{name}: Coal judges overlaps, but has no answer: {found['Coal'][name]}")
            judge = np.array(found["Coal"][name]["judge"])
            answers, truth = of_palpus(trace, steps[name])
            rows = {"palpus": figures(trace, judge, answers)}
            # The times of palpus are those of all ticks, not only those of the compared poses.
            rows["palpus"] |= {"p50": steps[name]["p50"], "p99": steps[name]["p99"], "true_turn": truth}
            for engine in ENGINES:
                result = found[engine][name]
                rows[engine] = result if isinstance(result, str) else figures(
                    trace, judge, {int(k): values for k, values in result["answers"].items()}, issubclass(ENGINES[engine], MuJoCo))
            everything[name] = rows
            lost += losses(name, rows)
            new = [line(name, engine, row, rows["palpus"]) for engine, row in rows.items()]
            new.append(f"| {name} | truth |" + " |" * (len(HEAD) - 3) + f" {truth[0]:.2g} / {truth[1]:.2g} |")
            lines += new
            print("\n".join(new), flush=True)
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in sorted({kind.package for kind in ENGINES.values()})
                         if importlib.util.find_spec(name if name != "drake" else "pydrake"))
    notes = [f"{versions}; load average {os.getloadavg()[0]:.1f} at the end.", *lost]
    print("\n".join(["", *notes]))
    (options.out / "conformal_peers.md").write_text("\n".join([*lines, "", *[f"- {note}" for note in notes]]) + "\n")
    (options.out / "conformal_peers.json").write_text(json.dumps(everything, indent=1))


if __name__ == "__main__":
    main()
