"""Worlds: the wrenches of tools, and the motion of objects."""

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import palpus

COUPLED = palpus.Settings.coupled(force=8.5, torque=0.19, tolerance=2e-4)


def at(x: float, y: float, z: float) -> list[float]:
    return [x, y, z, 0, 0, 0, 1]


def block(x: float, y: float, z: float) -> palpus.Body:
    corners = np.array(list(itertools.product((-x / 2, x / 2), (-y / 2, y / 2), (-z / 2, z / 2))))
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return palpus.Body.from_arrays(corners, faces)


def pressed(steps: int) -> npt.NDArray[np.float64]:
    """Returns the wrenches while a tool moves down, at the end 2 mm into a plate."""
    world = palpus.World(COUPLED)
    world.add_fixed(block(0.1, 0.1, 0.1), at(0, 0, 0))
    world.add_tool(block(0.02, 0.02, 0.02), COUPLED)
    return np.concatenate([world.step(at(0, 0, max(0.07 - 1e-4 * k, 0.058))) for k in range(steps)])


def test_plate_pushes_the_tool() -> None:
    wrenches = pressed(500)
    assert wrenches.shape == (500, 6)
    assert np.abs(wrenches[:90]).max() < 1e-12, "there must be no force before contact"
    assert wrenches[-1, 2] > 1 and np.abs(np.delete(wrenches[-1], 2)).max() < 1e-6
    assert wrenches.tobytes() == pressed(500).tobytes()


def test_direct_rendering_gives_the_penalty_force() -> None:
    direct = palpus.Settings.direct(tolerance=1e-3, stiffness=500, damping=0)
    world = palpus.World(direct)
    plate = world.add_fixed(block(0.1, 0.1, 0.02), at(0, 0, -0.01))
    tool = world.add_tool(block(0.02, 0.02, 0.02), direct)
    wrench = world.step(at(0, 0, 0.0104))
    # The tool is 0.6 mm inside the tolerance.
    np.testing.assert_allclose(wrench, [[0, 0, 500 * 0.6e-3, 0, 0, 0]], atol=1e-9)
    np.testing.assert_array_equal(world.wrench(tool), wrench[0])
    contacts = world.contacts(tool, plate)
    np.testing.assert_allclose(contacts["separation"], 0.4e-3, atol=1e-9)
    np.testing.assert_allclose(contacts["normal"], np.tile([0, 0, 1], (len(contacts), 1)), atol=1e-9)
    assert np.allclose(world.contacts(plate, tool)["normal"][:, 2], -1)


def test_tolerance_suits_the_bodies() -> None:
    peg, plate = block(0.02, 0.02, 0.05), block(0.1, 0.1, 0.02)
    assert palpus.contact_tolerance(peg, plate, at(0, 0, 0.5)) == pytest.approx(0.01 * peg.size)
    # A sleeve around the peg has a clearance of 0.1 mm on each side.
    rings = [(0.0101, -0.01), (0.0101, 0.01), (0.015, 0.01), (0.015, -0.01)]
    corners = [(r * x, r * y, z) for r, z in rings for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    sides = [[4 * ring + side for side in (k, (k + 1) % 4)] for ring in range(4) for k in range(4)]
    faces = [[i, j, *reversed([(k + 4) % 16 for k in (i, j)])] for i, j in sides]
    sleeve = palpus.Body.from_arrays(corners, faces)
    assert palpus.contact_tolerance(peg, sleeve, at(5e-5, 0, 0)) == pytest.approx(1e-4, rel=0.05)
    with pytest.raises(palpus.Error, match="pose"):
        palpus.contact_tolerance(peg, plate, [0, 0, 0])


def test_objects_fall_rest_and_move_with_a_belt() -> None:
    settings = palpus.Settings.coupled(force=8.5, torque=0.19, tolerance=4e-4, friction=(0.4, 0.3))
    world = palpus.World(settings, gravity=(0, 0, -9.81))
    world.add_fixed(block(0.6, 0.3, 0.02), at(0, 0, -0.01))
    belt = world.add_driven(block(2, 0.06, 0.02), at(0, 0.4, -0.01))
    rests = world.add_free(block(0.04, 0.04, 0.04), at(0, 0, 0.021), density=700)
    rides = world.add_free(block(0.04, 0.04, 0.04), at(-0.5, 0.4, 0.0202), mass=0.045)
    for tick in range(1000):
        if tick % 17 == 0:
            world.drive(belt, at(1e-4 * tick, 0.4, -0.01), [0.1, 0, 0, 0, 0, 0])
        assert world.step(np.empty((0, 7))).shape == (0, 6)
    np.testing.assert_allclose(world.pose(rests), at(0, 0, 0.02), atol=3e-4)
    assert world.pose(rides)[0] == pytest.approx(-0.4, abs=0.02)
    assert world.twist(rides)[0] == pytest.approx(0.1, abs=1e-3)
    world.put(rests, at(0, 0, 0.1))
    world.throw(rests, [0, 0, 1, 0, 0, 0])
    for _ in range(50):
        world.step([])
    assert world.pose(rests)[2] > 0.12


def test_two_tools_push_each_other() -> None:
    world = palpus.World(COUPLED)
    for _ in range(2):
        world.add_tool(block(0.02, 0.02, 0.02), COUPLED)
    for k in range(300):
        apart = max(0.02 - 1e-4 * k, 0.009)
        left, right = world.step([at(-apart, 0, 0), at(apart, 0, 0)], twists=np.zeros((2, 6)))
    assert left[0] < -1
    np.testing.assert_allclose(left + right, 0, atol=1e-6)


def test_bad_input_gives_clear_errors() -> None:
    world = palpus.World(COUPLED)
    body = block(0.02, 0.02, 0.02)
    fixed = world.add_fixed(body, at(0, 0, 0))
    tool = world.add_tool(body, COUPLED)
    free = world.add_free(body, at(0, 0, 1), mass=1)

    def refuses(text: str, call: Any, *arguments: Any, **named: Any) -> None:
        with pytest.raises(palpus.Error, match=text):
            call(*arguments, **named)

    refuses("poses has 2 rows, but the world has 1 tools", world.step, [at(0, 0, 0)] * 2)
    refuses("twists has 2 rows", world.step, at(0, 0, 0), twists=np.zeros((2, 6)))
    refuses("dt is 0", world.step, at(0, 0, 0), 0.0)
    refuses("tx is NaN", world.step, at(np.nan, 0, 0))
    refuses("only tools have", world.wrench, fixed)
    refuses("no body 3; the world has 3", world.pose, 3)
    refuses("body 2 is not driven", world.drive, free, at(0, 0, 0))
    refuses("body 0 is not free", world.throw, fixed, [0] * 6)
    refuses("its device moves it", world.put, tool, at(0, 0, 0))
    refuses("pose has 2 rows", world.put, fixed, [at(0, 0, 0)] * 2)
    refuses("either a density or a mass", world.add_free, body, at(0, 0, 0))
    refuses("`mass` is -1", world.add_free, body, at(0, 0, 0), mass=-1)
    refuses("`limits.force` is -1", palpus.Settings.coupled, force=-1, torque=1, tolerance=1e-3)
    refuses("`contact_tolerance` is 0", palpus.Settings.direct, tolerance=0)
    refuses("grip must be three finite numbers", palpus.Settings.direct, grip=[0, 0, np.inf])
    refuses("gravity must be three", palpus.World, COUPLED, gravity=[1, np.nan, 0])
    assert COUPLED.is_coupled and COUPLED.limits == (8.5, 0.19) and COUPLED.tolerance == 2e-4
