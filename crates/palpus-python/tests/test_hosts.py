"""Tests the examples of host programs that use palpus."""

import importlib.util
import pathlib
from types import ModuleType

import numpy as np
import pytest

EXAMPLES = pathlib.Path(__file__).parents[3] / "examples" / "python"


def example(name: str) -> ModuleType:
    specification = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_mujoco_robot_slides_around_the_ring(tmp_path: pathlib.Path) -> None:
    # The example is not imported here, because it chooses MuJoCo's renderer before it imports
    # MuJoCo.
    if importlib.util.find_spec("mujoco") is None:
        pytest.skip("MuJoCo is not installed")
    robot = example("mujoco_robot")
    felt = robot.run(tmp_path)
    time, force, place = felt["time"], felt["force"], felt["place"]
    assert not force[time < 1.0].any(), "the peg must go down without contact"
    round_, room = (time > 1.5) & (time < 3.5), robot.HOLE - robot.PEG[0]
    far = np.hypot(place[:, 0], place[:, 1])[round_]
    # The wall yields by the force divided by its stiffness, minus the tolerance below which it
    # pushes. This sum is about zero.
    assert (np.abs(far - room) < 2e-4).all()
    pull = robot.Robot.STIFFNESS[0] * (robot.CIRCLE - room)
    np.testing.assert_allclose(np.linalg.norm(force[round_], axis=1), pull, rtol=0.15)
    inwards = -(force * place).sum(axis=1)[round_] / far
    assert (inwards > 0.97 * np.linalg.norm(force[round_], axis=1)).all()
    assert np.abs(force[time > 4.3]).max() < 1e-9, "the peg must go up without contact"
    for name in ("robot.png", "forces.png"):
        assert (tmp_path / name).stat().st_size > 10_000
