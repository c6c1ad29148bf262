"""Labels of files of poses: with a loop, and with Ray with one, two and four actors. One test kills an actor."""

import os
import pathlib
import signal
import subprocess
import sys
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import palpus
from models import MESHES

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")

from palpus.labels import Block, Job, Labeller, blocks  # noqa: E402

Array = npt.NDArray[Any]
COLUMNS = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")


def write(path: pathlib.Path, poses: Array, block: int) -> str:
    pq.write_table(pa.table(dict(zip(COLUMNS, poses.T))), path, row_group_size=block)
    return str(path)


def job(out: pathlib.Path, **named: Any) -> Job:
    return Job(str(MESHES / "peg.obj"), str(MESHES / "bracket.obj"), str(out), tolerance=0.5, **named)


def files(out: pathlib.Path) -> dict[str, bytes]:
    return {str(file.relative_to(out)): file.read_bytes() for file in sorted(out.rglob("*.parquet"))}


def by_loop(out: pathlib.Path, poses: str, **named: Any) -> dict[str, bytes]:
    label = Labeller(job(out, **named))
    for block in blocks(poses):
        label(block)
    return files(out)


def test_labels_equal_query_results(tmp_path: pathlib.Path, peg: palpus.Body, bracket: palpus.Body, poses: Array) -> None:
    # The blocks consist of whole runs, so one batch over all poses gives the same bits.
    by_loop(tmp_path / "out", write(tmp_path / "poses.parquet", poses, 256), depth=True)
    nearest, contacts = palpus.query(peg, bracket, poses, 0.5)
    table = pq.read_table(tmp_path / "out" / "nearest")
    assert table["pose"].to_pylist() == list(range(len(poses)))
    assert table["separation"].to_pylist() == nearest["separation"].tolist()
    assert table["point_a_z"].to_pylist() == nearest["point_a"][:, 2].tolist()
    table = pq.read_table(tmp_path / "out" / "contacts")
    assert table["pose"].to_pylist() == contacts["pose"].tolist()
    assert table["kind_a"].to_pylist() == [kind.decode() for kind in contacts["kind_a"]]
    table = pq.read_table(tmp_path / "out" / "depth")
    upper = palpus.depth(peg, bracket, poses)["upper"]
    assert np.abs(np.array(table["upper"]) - upper).max() < 0.02 * peg.size, "bounds of other runs may differ by the gap"


def test_wrenches_equal_wrenches_of_a_world(tmp_path: pathlib.Path, poses: Array) -> None:
    scaled = poses * ([1e-3] * 3 + [1] * 4)
    parts = write(tmp_path / "poses.parquet", scaled, 300)
    meshes = str(MESHES / "peg.obj"), str(MESHES / "bracket.obj")
    label = Labeller(Job(*meshes, str(tmp_path / "out"), unit="mm", tolerance=5e-4, stiffness=500))
    for block in blocks(parts):
        label(block)
    table = pq.read_table(tmp_path / "out" / "wrench")
    settings = palpus.Settings.direct(tolerance=5e-4, stiffness=500)
    world = palpus.World(settings)
    tool, part = (palpus.Body.load(name, unit="mm") for name in meshes)
    world.add_fixed(part, [0, 0, 0, 0, 0, 0, 1])
    world.add_tool(tool, settings)
    expected = np.concatenate([world.step(pose) for pose in scaled[:300]])
    names = [f"{kind}_{axis}" for kind in ("force", "torque") for axis in "xyz"]
    found = np.stack([table[name].to_numpy()[:300] for name in names], axis=1)
    assert found.tobytes() == expected.tobytes() and np.abs(expected).max() > 0.1
    with pytest.raises(palpus.Error, match="wrenches need a unit"):
        Labeller(Job(*meshes, str(tmp_path / "none"), stiffness=500))


def test_stopped_job_continues(tmp_path: pathlib.Path, poses: Array) -> None:
    parts = write(tmp_path / "poses.parquet", poses, 100)
    expected = by_loop(tmp_path / "all", parts)
    label = Labeller(job(tmp_path / "some"))
    for block in blocks(parts)[3:5]:
        label(block)
    again = [label(block)["done_before"] for block in blocks(parts)]
    assert again == [k in (3, 4) for k in range(7)]
    assert files(tmp_path / "some") == expected


def test_bad_input_gives_clear_errors(tmp_path: pathlib.Path, poses: Array) -> None:
    good = write(tmp_path / "poses.parquet", poses, 100)
    Labeller(job(tmp_path / "out"))
    with pytest.raises(palpus.Error, match="of another job"):
        Labeller(job(tmp_path / "out", depth=True))
    with pytest.raises(palpus.Error, match="cannot be read as Parquet"):
        blocks(tmp_path / "none.parquet")
    pq.write_table(pa.table({"tx": [1.0]}), tmp_path / "short.parquet")
    with pytest.raises(palpus.Error, match="no column ty"):
        blocks(tmp_path / "short.parquet")
    broken = poses.copy()
    broken[150, 0] = np.inf
    bad = blocks(write(tmp_path / "bad.parquet", broken, 100))
    with pytest.raises(palpus.Error, match=r"poses\[50\]: tx is inf"):
        Labeller(job(tmp_path / "bad"))(bad[1])
    assert bad[1] == Block(bad[1].file, 1, 100, 100) and good


def kill_an_actor() -> None:
    """Kills one of the actors that Ray has started for this process."""
    parents, actors = {}, []
    for folder in pathlib.Path("/proc").iterdir():
        try:
            pid, command = int(folder.name), (folder / "cmdline").read_text()
            parents[pid] = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except (ValueError, OSError):
            continue
        if command.startswith("ray::") and "_Actor" in command:
            actors.append(pid)
    for actor in actors:
        ancestor = actor
        while ancestor > 1 and ancestor != os.getpid():
            ancestor = parents.get(ancestor, 0)
        if ancestor == os.getpid():
            os.kill(actor, signal.SIGKILL)
            return
    raise AssertionError("no actor was found")


@pytest.mark.skipif(sys.platform != "linux", reason="finds the actors in /proc, which only Linux has")
def test_labels_do_not_depend_on_actors(tmp_path: pathlib.Path, poses: Array) -> None:
    ray = pytest.importorskip("ray")
    from palpus.parts import parts as parts_of
    from palpus.parts import prepare as prepare_part
    from palpus.ray import label, prepare

    parts = write(tmp_path / "poses.parquet", np.tile(poses, (40, 1)), 700)
    expected = by_loop(tmp_path / "loop", parts)
    ray.init(num_cpus=4, include_dashboard=False, log_to_driver=False)
    try:
        ray.data.DataContext.get_current().enable_progress_bars = False
        for actors in (1, 2, 4):
            out = tmp_path / f"actors-{actors}"
            done = list(label(job(out), parts, actors=actors))
            assert sum(row["poses"] for row in done) == 40 * 700
            assert files(out) == expected, actors
        out = tmp_path / "killed"
        rows = label(job(out), parts, actors=2)
        next(rows)
        kill_an_actor()
        list(rows)
        assert files(out) == expected
        assert list(label(job(out), parts, actors=2)) == [], "all blocks are done"

        library = tmp_path / "library"
        library.mkdir()
        for mesh in MESHES.glob("*.obj"):
            (library / mesh.name).write_bytes(mesh.read_bytes())
        (library / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
        healths = [prepare_part(file) for file in parts_of(library)]
        assert [bool(row["error"]) for row in healths] == ["flat.obj" in row["file"] for row in healths]
        for actors in (1, 2):
            table = tmp_path / f"health-{actors}.parquet"
            assert len(list(prepare(str(library), str(table), actors=actors))) == len(healths)
            assert pq.read_table(table).to_pylist() == healths, actors
    finally:
        ray.shutdown()


def test_command(tmp_path: pathlib.Path, poses: Array) -> None:
    pytest.importorskip("ray")
    command = [sys.executable, "-m", "palpus.ray", "prepare", "nothing", "--out", "table.parquet"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 1 and "there are no meshes" in result.stderr
    command = [sys.executable, "-m", "palpus.ray", "label", "none.parquet", str(MESHES / "peg.obj")]
    command += [str(MESHES / "bracket.obj"), "--out", "out"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 1 and "none.parquet: cannot be read" in result.stderr
