"""The device loop: its forces, its status and commands while it runs, and how it ends."""

import time

import numpy as np
import pytest

import palpus
from test_world import COUPLED, at, block


def touch() -> palpus.World:
    world = palpus.World(COUPLED)
    world.add_fixed(block(0.1, 0.1, 0.1), at(0, 0, 0))
    world.add_tool(block(0.02, 0.02, 0.02), COUPLED)
    return world


def test_led_tool_presses_on_the_plate() -> None:
    world = touch()
    # The loop does not run in real time, because a busy machine would be late.
    with palpus.Loop(world, at(0, 0, 0.065), real_time=False) as loop:
        assert loop.is_running
        loop.lead(at(0, 0, 0.05))
        until = time.monotonic() + 20
        while not (loop.wrench[2] > 0.5 and loop.status()["phase"] == "engaged") and time.monotonic() < until:
            time.sleep(0.01)
        status = loop.status()
        assert status["wrench"][2] > 0.5 and status["contacts"] >= 1 and status["phase"] == "engaged"
        assert 0.055 < status["tool"][2] < 0.0605, "the tool must stay on the plate"
        assert status["running"] and status["tick"] > 0
        with pytest.raises(palpus.Error, match="a loop is running this world"):
            world.step(at(0, 0, 1))
        with pytest.raises(palpus.Error, match="already running"):
            loop.start()
    assert not loop.is_running and not loop.status()["running"]
    summary = loop.summary()
    assert summary["end"] == "it was stopped" and summary["faults"] == 0 and summary["allocations"] == 0
    assert summary["force_max"] > 0.5
    assert world.step(at(0, 0, 0.07)).shape == (1, 6), "the world must be usable again"


def test_simulated_time_gives_the_same_bits() -> None:
    def run() -> tuple[float, bytes]:
        loop = palpus.Loop(touch(), at(0, 0, 0.0602), hand="firm", duration=0.5, real_time=False)
        loop.start()
        summary = loop.wait()
        assert summary["ticks"] == 500 and summary["end"] == "ended after the set duration" and summary["allocations"] == 0
        return summary["force_max"], loop.status()["tool"].tobytes()

    assert run() == run()


def test_running_loop_takes_settings_and_drives() -> None:
    world = palpus.World(COUPLED)
    plate = world.add_driven(block(0.1, 0.1, 0.02), at(0, 0, 0))
    fixed = world.add_fixed(block(0.1, 0.1, 0.02), at(1, 0, 0))
    world.add_tool(block(0.02, 0.02, 0.02), COUPLED)
    with palpus.Loop(world, at(0, 0, 0.05), real_time=False) as loop:
        loop.set_settings(palpus.Settings.coupled(force=4, torque=0.1, tolerance=2e-4))
        loop.drive(plate, at(0, 0, 0.001))
        with pytest.raises(palpus.Error, match=f"body {fixed} is not driven"):
            loop.drive(fixed, at(0, 0, 0))
        with pytest.raises(palpus.Error, match="grip cannot move"):
            loop.set_settings(palpus.Settings.coupled(force=4, torque=0.1, tolerance=2e-4, grip=[0, 0, 1]))
        before = loop.status()["tick"]
        until = time.monotonic() + 20
        while loop.status()["tick"] < before + 200 and time.monotonic() < until:
            time.sleep(0.01)
    np.testing.assert_allclose(world.pose(plate), at(0, 0, 0.001), atol=1e-6)


def test_bad_input_gives_clear_errors() -> None:
    world = touch()
    with pytest.raises(palpus.Error, match='no device "phantom"'):
        palpus.Loop(world, at(0, 0, 1), device="phantom").start()
    with pytest.raises(palpus.Error, match="the device `bridge:/nowhere.sock` cannot be used"):
        palpus.Loop(world, at(0, 0, 1), device="bridge:/nowhere.sock").start()
    with pytest.raises(palpus.Error, match="keeps its own time"):
        palpus.Loop(world, at(0, 0, 1), device="haply", real_time=False)
    with pytest.raises(palpus.Error, match='no hand "iron"'):
        palpus.Loop(world, at(0, 0, 1), hand="iron").start()
    with pytest.raises(palpus.Error, match="the rate must be between"):
        palpus.Loop(world, at(0, 0, 1), rate=0)
    with pytest.raises(palpus.Error, match="the world has no tool"):
        palpus.Loop(palpus.World(COUPLED), at(0, 0, 1)).start()
    loop = palpus.Loop(world, at(0, 0, 1))
    for call in (loop.status, loop.summary, lambda: loop.lead(at(0, 0, 0))):
        with pytest.raises(palpus.Error, match="not|no run"):
            call()
    world.add_tool(block(0.02, 0.02, 0.02), COUPLED)
    with pytest.raises(palpus.Error, match="the world has 2 tools"):
        loop.start()
