"""A robot in MuJoCo touches a ring, with contact forces from palpus: MuJoCo at 500 Hz, palpus at 1 kHz.

    pip install mujoco matplotlib, and palpus from this repository
    python examples/python/mujoco_robot.py [--out FOLDER]

MuJoCo moves the arm. It replaces each mesh by its convex hull, so the peg could not enter the ring. So MuJoCo's
contacts are switched off, and palpus, which uses the real shape of the ring, computes the contact forces. A controller
pulls the peg along a circle that is wider than the hole, so the peg slides along the wall. The script writes robot.png
and forces.png.
"""

import argparse
import os
import pathlib

os.environ.setdefault("MUJOCO_GL", "egl")  # renders without a display

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import palpus

HOST_PERIOD = 2e-3  # time step of MuJoCo, s
TOUCH_PERIOD = 1e-3  # time step of palpus, s
HOLE = 0.012  # inner radius of the ring, m
TUBE = 0.008  # radius of the ring's tube, m
PEG = (0.005, 0.04)  # radius and length of the peg, m
CENTRE = np.array([0.45, 0.0, 0.2])  # centre of the ring, m
CIRCLE = 0.011  # radius of the controller's path, m; the peg's axis has only 7 mm of clearance

ARM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{period}" integrator="implicitfast"/>
  <visual><global offwidth="960" offheight="720"/><headlight ambient=".5 .5 .5"/><map znear=".005"/></visual>
  <asset>
    <mesh name="ring" vertex="{ring_vertices}" face="{ring_faces}" inertia="shell"/>
    <mesh name="peg" vertex="{peg_vertices}" face="{peg_faces}"/>
    <texture type="skybox" builtin="gradient" rgb1="1 1 1" rgb2=".8 .85 .9" width="64" height="64"/>
  </asset>
  <default>
    <geom contype="0" conaffinity="0" rgba=".55 .6 .65 1"/>
    <joint damping="0.2" armature="0.02"/>
  </default>
  <worldbody>
    <light pos="0.3 -0.6 1.2" dir="0 .4 -1"/>
    <geom type="plane" size="1 1 .1" rgba=".9 .9 .9 1"/>
    <geom type="mesh" mesh="ring" pos="{centre}" rgba=".85 .6 .3 .6"/>
    <body pos="0 0 .1">
      <joint name="base" axis="0 0 1"/>
      <geom type="cylinder" fromto="0 0 -.1 0 0 .1" size=".05"/>
      <body pos="0 0 .1">
        <joint name="shoulder" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 .35" size=".035"/>
        <body pos="0 0 .35">
          <joint name="elbow" axis="0 1 0"/>
          <geom type="capsule" fromto="0 0 0 0 0 .32" size=".03"/>
          <body pos="0 0 .32">
            <joint name="wrist" axis="0 1 0"/>
            <geom type="capsule" fromto="0 0 0 0 0 .05" size=".022"/>
            <body pos="0 0 .05">
              <joint name="tilt" axis="1 0 0"/>
              <geom type="capsule" fromto="0 0 0 0 0 .05" size=".018"/>
              <body name="tool" pos="0 0 .05">
                <joint name="roll" axis="0 0 1"/>
                <geom type="cylinder" fromto="0 0 0 0 0 .02" size=".012"/>
                <geom type="mesh" mesh="peg" pos="0 0 .02" rgba=".2 .4 .8 1"/>
                <site name="peg" pos="0 0 .02"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def ring() -> tuple[np.ndarray, np.ndarray]:
    """Returns a torus about the z axis: vertices (m) and triangles."""
    around, across = 96, 20
    u, v = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij")
    far = HOLE + TUBE + TUBE * np.cos(v)
    vertices = np.stack([far * np.cos(u), far * np.sin(u), TUBE * np.sin(v)], axis=-1).reshape(-1, 3)
    return vertices, quads(around, across)


def quads(around: int, across: int) -> np.ndarray:
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    corner = lambda di, dj: ((i + di) % around * across + (j + dj) % across).ravel()  # noqa: E731
    a, b, c, d = corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def peg() -> tuple[np.ndarray, np.ndarray]:
    """Returns a prism of 48 sides along z, from 0 to its length: vertices (m) and triangles."""
    sides = 48
    angle = np.arange(sides) * 2 * np.pi / sides
    rim = PEG[0] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.c_[rim, np.zeros(sides)], np.c_[rim, np.full(sides, PEG[1])]])
    k, n = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = [np.stack([k, n, n + sides], 1), np.stack([k, n + sides, k + sides], 1)]
    fan = np.stack([np.zeros(sides - 2, int), k[1:-1], k[2:]], 1)
    return vertices, np.concatenate([*faces, fan[:, ::-1], fan + sides])


def path(time: float) -> np.ndarray:
    """Returns the controller's goal for the peg's site: into the hole, outwards, around, back and up (m)."""
    ease = lambda t: 0.5 - 0.5 * np.cos(np.pi * np.clip(t, 0, 1))  # noqa: E731
    depth = 0.05 * (ease(time / 0.8) - ease((time - 4.2) / 0.8))
    radius = CIRCLE * (ease((time - 0.9) / 0.4) - ease((time - 3.7) / 0.4))
    turn = 2 * np.pi * ease((time - 1.4) / 2.2)
    return CENTRE + [radius * np.cos(turn), radius * np.sin(turn), PEG[1] / 2 + 0.05 - depth]


def text(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.9g}" for number in np.ravel(numbers))


class Robot:
    """The arm, with a controller that pulls the peg along the path like a spring."""

    STIFFNESS = np.array([900.0] * 3 + [12.0] * 3)  # N/m, N·m/rad
    DAMPING = np.array([45.0] * 3 + [0.5] * 3)  # N·s/m, N·m·s/rad
    DOWN = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])  # the peg's axes in the world

    def __init__(self) -> None:
        (ring_vertices, ring_faces), (peg_vertices, peg_faces) = ring(), peg()
        self.model = mujoco.MjModel.from_xml_string(
            ARM.format(
                period=HOST_PERIOD,
                centre=text(CENTRE),
                ring_vertices=text(ring_vertices),
                ring_faces=text(ring_faces),
                peg_vertices=text(peg_vertices),
                peg_faces=text(peg_faces),
            )
        )
        self.data = mujoco.MjData(self.model)
        self.site = self.model.site("peg").id
        self.data.qpos[:] = [0.0, 0.35, 1.6, np.pi - 1.95, 0.0, 0.0]
        for _ in range(200):  # inverse kinematics to the start of the path
            mujoco.mj_forward(self.model, self.data)
            self.data.qpos += np.linalg.pinv(self.jacobian(), rcond=1e-3) @ self.error(path(0.0)) * 0.3
        mujoco.mj_forward(self.model, self.data)

    def jacobian(self) -> np.ndarray:
        linear, angular = np.zeros((2, 3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, linear, angular, self.site)
        return np.concatenate([linear, angular])

    def error(self, wanted: np.ndarray) -> np.ndarray:
        """Returns the position error (m) and orientation error (rad) to the goal, shape (6,)."""
        rotation = self.data.site_xmat[self.site].reshape(3, 3)
        turn = 0.5 * np.cross(rotation.T, self.DOWN.T).sum(axis=0)
        return np.concatenate([wanted - self.data.site_xpos[self.site], turn])

    def pose_and_twist(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns pose and velocity of the peg's frame, in the format of palpus."""
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, self.data.site_xmat[self.site])
        pose = np.concatenate([self.data.site_xpos[self.site], quaternion[1:], quaternion[:1]])
        return pose, self.jacobian() @ self.data.qvel

    def step(self, wanted: np.ndarray, wrench: np.ndarray) -> None:
        """Moves the arm by one MuJoCo step; `wrench` acts on the peg at its site (N, N·m)."""
        jacobian = self.jacobian()
        pull = self.STIFFNESS * self.error(wanted) - self.DAMPING * (jacobian @ self.data.qvel)
        self.data.qfrc_applied[:] = self.data.qfrc_bias + jacobian.T @ (pull + wrench)
        mujoco.mj_step(self.model, self.data)


def moved(pose: np.ndarray, twist: np.ndarray, time: float) -> np.ndarray:
    """Returns the pose of a frame after it has moved with `twist` for `time` (s)."""
    quaternion = pose[[6, 3, 4, 5]].copy()
    # MuJoCo expects the angular velocity in the body's own axes.
    own, inverse = np.zeros(3), np.zeros(4)
    mujoco.mju_negQuat(inverse, quaternion)
    mujoco.mju_rotVecQuat(own, twist[3:], inverse)
    mujoco.mju_quatIntegrate(quaternion, own, time)
    return np.concatenate([pose[:3] + time * twist[:3], quaternion[1:], quaternion[:1]])


def run(out: pathlib.Path) -> dict[str, np.ndarray]:
    """Runs five seconds, writes the pictures, and returns times, forces, positions and contact counts."""
    robot = Robot()
    # The robot is heavy and its pose is exact, so contacts act on it directly. For a hand-held device use `coupled`.
    settings = palpus.Settings.direct(tolerance=1e-3, stiffness=5000, damping=30, force=50, torque=5)
    world = palpus.World(settings)
    ring_body, peg_body = palpus.Body.from_arrays(*ring()), palpus.Body.from_arrays(*peg())
    fixed = world.add_fixed(ring_body, [*CENTRE, 0, 0, 0, 1])
    tool = world.add_tool(peg_body, settings)
    steps = round(HOST_PERIOD / TOUCH_PERIOD)
    times, forces, places, counts = [], [], [], []
    for tick in range(round(5.0 / HOST_PERIOD)):
        time = tick * HOST_PERIOD
        # The robot's pose is read 500 times per second. Between two reads palpus extrapolates it with the velocity.
        pose, twist = robot.pose_and_twist()
        wrenches = [
            world.step(moved(pose, twist, k * TOUCH_PERIOD), TOUCH_PERIOD, twists=twist)[0] for k in range(steps)
        ]
        wrench = np.mean(wrenches, axis=0)
        robot.step(path(time), wrench)
        times.append(time)
        forces.append(wrench[:3])
        places.append(pose[:3] - CENTRE)
        counts.append(len(world.contacts(tool, fixed)))
        if tick == round(2.2 / HOST_PERIOD):
            picture(robot, out / "robot.png")
    felt = {"time": np.array(times), "force": np.array(forces), "place": np.array(places), "contacts": np.array(counts)}
    plot(felt, out / "forces.png")
    return felt


def picture(robot: Robot, file: pathlib.Path) -> None:
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = CENTRE + [-0.06, 0, 0.06], 0.5, 125, -28
    with mujoco.Renderer(robot.model, 720, 960) as renderer:
        renderer.update_scene(robot.data, camera)
        plt.imsave(file, renderer.render())


def plot(felt: dict[str, np.ndarray], file: pathlib.Path) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained", width_ratios=(3, 2))
    for axis, name in enumerate("xyz"):
        left.plot(felt["time"], felt["force"][:, axis], label=f"force along {name}", linewidth=1)
    left.set(xlabel="time, s", ylabel="N")
    left.legend(fontsize="small")
    wanted = 1e3 * (np.array([path(time) for time in felt["time"]]) - CENTRE)
    right.plot(wanted[:, 0], wanted[:, 1], "--", color="gray", linewidth=1, label="goal of the controller")
    right.plot(*(1e3 * felt["place"][:, :2].T), color="tab:blue", label="axis of the peg")
    right.add_patch(plt.Circle((0, 0), 1e3 * (HOLE - PEG[0]), fill=False, color="tab:red", label="clearance in the hole"))
    right.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
    figure.legend(*right.get_legend_handles_labels(), fontsize="small", loc="outside upper right", ncols=3)
    figure.savefig(file, dpi=100)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", type=pathlib.Path, default=pathlib.Path("."), metavar="FOLDER")
    out: pathlib.Path = arguments.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    felt = run(out)
    strongest, widest = np.linalg.norm(felt["force"], axis=1).max(), np.hypot(*felt["place"][:, :2].T).max()
    print(f"largest force {strongest:.2f} N; the peg moved {widest * 1e3:.2f} mm off the ring's axis, with {(HOLE - PEG[0]) * 1e3:.0f} mm of clearance")
    print(f"pictures: {out / 'robot.png'}, {out / 'forces.png'}")


if __name__ == "__main__":
    main()
