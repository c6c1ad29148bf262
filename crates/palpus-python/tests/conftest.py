"""Meshes and poses that several tests use, and the program whose results they compare."""

import os
import pathlib
import subprocess
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

import palpus
from models import MESHES

SEED = 20


@pytest.fixture(scope="session")
def peg() -> palpus.Body:
    return palpus.Body.load(MESHES / "peg.obj", cache=False)


@pytest.fixture(scope="session")
def bracket() -> palpus.Body:
    return palpus.Body.load(MESHES / "bracket.obj", cache=False)


@pytest.fixture(scope="session")
def poses() -> npt.NDArray[np.float64]:
    """Returns a smooth motion of the peg through the bracket, in millimetres."""
    random = np.random.default_rng(SEED)
    phases, time = random.uniform(0, 2 * np.pi, (7, 3)), np.linspace(0, 6, 700)
    waves = np.array([sum(np.sin(f * time + p) for f, p in zip((1, 2, 5), phase)) for phase in phases])
    rotations = waves[3:].T + (0, 0, 0, 2)
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    return np.hstack([(15, 10, 10) + 8 * waves[:3].T, rotations])


@pytest.fixture
def program(tmp_path: pathlib.Path) -> Callable[..., None]:
    """Returns a function that runs the program in a temporary folder."""
    name = os.environ.get("PALPUS")
    if name is None:
        pytest.skip("set PALPUS to the path of the program to compare with")

    def run(*arguments: str) -> None:
        command = [str(pathlib.Path(name).resolve()), "--no-cache", *arguments]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)

    return run
