"""Contacts, distance and depth at many poses."""

import csv
import pathlib
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import palpus
from models import MESHES

Array = npt.NDArray[Any]


def of_program(path: pathlib.Path, *, but: str) -> dict[str, list[str]]:
    """Returns the columns of a file that the program wrote, without the column of times."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0] if name != but}


def columns(rows: Array) -> dict[str, Array]:
    """Returns the columns with the names that the program uses."""
    named = {}
    for name in rows.dtype.names or ():
        parts = {name: rows[name]} if rows[name].ndim == 1 else {
            f"{name}_{axis}": rows[name][:, k] for k, axis in enumerate("xyz")
        }
        named.update(parts)
    return named


def assert_same(rows: Array, file: dict[str, list[str]], names: list[str]) -> None:
    ours = columns(rows)
    for name in names:
        if ours[name].dtype == bool:
            theirs: list[Any] = [text == "true" for text in file[name]]
        else:
            # The program writes a number with enough digits to read back the same double.
            theirs = [float(text) for text in file[name]]
        assert ours[name].tolist() == theirs, name


def test_same_bits_as_the_program(
    peg: palpus.Body, bracket: palpus.Body, poses: Array, tmp_path: pathlib.Path, program: Callable[..., None]
) -> None:
    np.savetxt(tmp_path / "poses.csv", poses, fmt="%.17g", delimiter=",", header="tx,ty,tz,qx,qy,qz,qw", comments="")
    files = [str(MESHES / "peg.obj"), str(MESHES / "bracket.obj"), "--poses", "poses.csv"]
    program("query", *files, "--tolerance", "0.5", "--out", "near.csv", "--contacts", "contacts.csv")
    program("depth", *files, "--out", "depth.csv")

    nearest, contacts = palpus.query(peg, bracket, poses, 0.5)
    points = [f"{name}_{axis}" for name in ("normal", "point_a", "point_b") for axis in "xyz"]
    near = of_program(tmp_path / "near.csv", but="query_us")
    assert_same(nearest, near, ["separation", *points, "contacts", "certified", "contained"])
    file = of_program(tmp_path / "contacts.csv", but="contact")
    assert contacts["pose"].tolist() == [int(frame) for frame in file["frame"]]
    assert_same(contacts, file, ["separation", *points, "piece_a", "piece_b"])
    for side in "ab":
        features = zip(contacts[f"kind_{side}"], contacts[f"feature_{side}"])
        assert [kind.decode() + str(index) for kind, index in features] == file[f"feature_{side}"]

    depth = palpus.depth(peg, bracket, poses)
    file = of_program(tmp_path / "depth.csv", but="depth_us")
    assert_same(depth, file, ["lower", "upper", "evaluations", "certified", "contained"])
    assert depth["translation"].tolist() == [
        [float(file[name][k]) for name in ("tx", "ty", "tz")] for k in range(len(poses))
    ]
    free = ~np.isnan(depth["distance"])
    assert free.tolist() == [text != "" for text in file["distance"]]


def test_results_do_not_depend_on_workers(peg: palpus.Body, bracket: palpus.Body, poses: Array) -> None:
    def answers(workers: int | None) -> list[bytes]:
        both = palpus.query(peg, bracket, poses, 0.5, workers=workers)
        return [rows.tobytes() for rows in (*both, palpus.depth(peg, bracket, poses[:120], workers=workers))]

    alone = answers(1)
    assert all(answers(workers) == alone for workers in (2, 5, None))
    nearest, contacts = palpus.query(peg, bracket, poses, 0.5)
    assert palpus.contacts(peg, bracket, poses, 0.5).tobytes() == contacts.tobytes()
    assert palpus.distance(peg, bracket, poses, 0.5).tobytes() == nearest.tobytes()


def test_results_are_consistent(peg: palpus.Body, bracket: palpus.Body, poses: Array) -> None:
    nearest, contacts = palpus.query(peg, bracket, poses, 0.5)
    depth = palpus.depth(peg, bracket, poses)
    assert nearest.shape == depth.shape == (len(poses),)
    assert nearest["contacts"].sum() == len(contacts) > 0
    np.testing.assert_array_equal(np.bincount(contacts["pose"].astype(int), minlength=len(poses)), nearest["contacts"])
    for rows in (nearest, contacts):
        gap = rows["separation"][:, None] * rows["normal"]
        np.testing.assert_allclose(rows["point_a"] - rows["point_b"], gap, atol=1e-9)
    assert (contacts["separation"] < 0.5).all()
    overlap = depth["upper"] > 0
    assert 50 < overlap.sum() < len(poses) - 50, "some poses must overlap and some must not"
    np.testing.assert_array_equal(nearest["separation"] > 0, ~overlap)
    assert (depth["lower"] <= depth["upper"]).all()
    np.testing.assert_allclose(np.linalg.norm(depth["translation"], axis=1), depth["upper"], rtol=1e-12)
    # After moving a by the translation, the bodies are separate.
    freed = poses[overlap].copy()
    freed[:, :3] += depth["translation"][overlap] * (1 + 1e-6)
    assert (palpus.depth(peg, bracket, freed)["upper"] < 1e-6 * peg.size).all()


def test_any_array_of_numbers_is_accepted(peg: palpus.Body, bracket: palpus.Body, poses: Array) -> None:
    expected = palpus.distance(peg, bracket, poses[:3])
    wide = np.asfortranarray(np.hstack([poses, poses]))[:, :7]
    for given in (poses[:3].tolist(), wide[:3], poses[:3].astype(">f8")):
        assert palpus.distance(peg, bracket, given).tobytes() == expected.tobytes()
    assert palpus.distance(peg, bracket, poses[0]).tobytes() == expected[:1].tobytes()
    assert palpus.distance(peg, bracket, poses[:0]).shape == (0,)
    assert palpus.contacts(peg, bracket, []).dtype == palpus.CONTACT
    assert expected.dtype == palpus.DISTANCE


def test_bad_poses_give_clear_errors(peg: palpus.Body, bracket: palpus.Body, poses: Array) -> None:
    def refuses(text: str, given: object, **named: Any) -> None:
        for function in (palpus.query, palpus.contacts, palpus.distance):
            with pytest.raises(palpus.Error, match=text):
                function(peg, bracket, given, **named)  # type: ignore[arg-type]

    broken = poses[:4].copy()
    broken[2, 1] = np.nan
    refuses(r"poses\[2\]: ty is NaN", broken)
    refuses(r"poses\[0\]: the quaternion has length [12]", poses[0] * (1, 1, 1, 2, 2, 2, 2))
    refuses(r"shape \[4, 6\], but must be \(N, 7\)", poses[:4, :6])
    refuses("not an array of numbers", "here")
    refuses("tolerance is -1", poses[:1], tolerance=-1.0)
    refuses("workers is 0", poses[:1], workers=0)
    with pytest.raises(palpus.Error, match="gap is 0"):
        palpus.depth(peg, bracket, poses[:1], gap=0.0)
    with pytest.raises(TypeError):
        palpus.contacts(peg, "bracket", poses[:1])  # type: ignore[arg-type]


def test_other_threads_run_meanwhile(peg: palpus.Body, bracket: palpus.Body, poses: Array) -> None:
    many = np.tile(poses, (20, 1))
    turns, done = 0, threading.Event()

    def ask() -> None:
        palpus.query(peg, bracket, many, 0.5)
        done.set()

    # With such a long interval, this thread runs only if the other thread releases the lock.
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    try:
        asking = threading.Thread(target=ask)
        asking.start()
        while not done.is_set():
            turns += 1
            time.sleep(0)
        asking.join()
    finally:
        sys.setswitchinterval(interval)
    assert turns > 10


def test_memory_does_not_grow(peg: palpus.Body, bracket: palpus.Body, poses: Array) -> None:
    def resident() -> int:
        text = pathlib.Path("/proc/self/status").read_text()
        return int(text.split("VmRSS:")[1].split()[0])

    if not pathlib.Path("/proc/self/status").exists():
        pytest.skip("this system does not report the memory of a process")
    block = np.tile(poses, (5, 1))
    for _ in range(20):
        results = palpus.query(peg, bracket, block, 0.5)
    before = resident()
    for _ in range(100):
        palpus.query(peg, bracket, block, 0.5)
    # An allocator may keep some freed memory, a few results at most. A leak of one result in ten would show.
    leak = 100 * sum(rows.nbytes for rows in results) // 1024
    assert resident() - before < leak / 10
