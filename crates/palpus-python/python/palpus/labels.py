"""Labels for lists of poses in Parquet files: nearest points, contacts and depths, block by block.

A block is a row group of a file of poses. Each block is read, processed and written separately. So blocks can be processed
in any order, on any machine, by any engine, and again; the bytes are always the same. `palpus.ray` processes them with Ray.
A plain loop is

    job = Job("tool.obj", "part.obj", "labels", tolerance=0.5)
    label = Labeller(job)
    for block in blocks("poses.parquet"):
        label(block)

Poses have the columns tx, ty, tz, qx, qy, qz, qw: body a in body b's frame. The folder of the job contains the folders
`nearest`, `contacts` and `depth`, each with one file per block. Their columns are the fields of palpus.DISTANCE, CONTACT
and DEPTH; a vector has three columns (normal_x, normal_y, normal_z). The column `pose` is the row number in the file of
poses. If the job has a `stiffness`, the folder `wrench` contains the wrench of direct rendering: force_x … torque_z
(N, N·m) about body a's origin.
"""

import dataclasses
import json
import os
import pathlib
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from ._native import Body, Error, Settings, World, depth, query

__all__ = ["Block", "Job", "Labeller", "blocks"]

_POSE = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"]


@dataclasses.dataclass(frozen=True)
class Job:
    """The labels to compute for each pose."""

    a: str
    b: str
    out: str
    unit: str | None = None
    tolerance: float | None = None
    depth: bool = False
    # Stiffness of contacts, which push below the tolerance, N/m. Needs a unit, because forces are
    # SI.
    stiffness: float | None = None


@dataclasses.dataclass(frozen=True)
class Block:
    """A row group of a file of poses."""

    file: str
    group: int
    first: int
    rows: int

    @property
    def name(self) -> str:
        return f"{pathlib.Path(self.file).stem}-{self.group:06}.parquet"


def blocks(poses: str | os.PathLike[str]) -> list[Block]:
    """Returns the blocks of a Parquet file of poses, or of all such files in a folder."""
    path = pathlib.Path(poses)
    files = sorted(path.glob("*.parquet")) if path.is_dir() else [path]
    found: list[Block] = []
    for file in files:
        try:
            about = pq.ParquetFile(file).metadata
        except (OSError, pa.ArrowInvalid) as error:
            raise Error(f"{file}: cannot be read as Parquet ({error}); check the path") from error
        missing = [name for name in _POSE if name not in about.schema.names]
        if missing:
            raise Error(f"{file}: there is no column {missing[0]}; a file of poses must have the columns {', '.join(_POSE)}")
        first = 0
        for group in range(about.num_row_groups):
            rows = about.row_group(group).num_rows
            found.append(Block(str(file), group, first, rows))
            first += rows
    if not found:
        raise Error(f"{path}: there are no poses; give a Parquet file, or a folder with Parquet files")
    names = [block.name for block in found]
    if len(set(names)) < len(names):
        raise Error(f"{path}: two files have the same name; rename one of them")
    return found


class Labeller:
    """Computes the labels of blocks. Prepares the bodies once. `workers` is the number of threads for each block."""

    def __init__(self, job: Job, workers: int | None = 1) -> None:
        self.job, self.workers = job, workers
        self.a, self.b = (Body.load(name, unit=job.unit, workers=workers) for name in (job.a, job.b))
        self.out = pathlib.Path(job.out)
        if job.stiffness is not None and (job.unit is None or job.tolerance is None):
            raise Error("wrenches need a unit and a tolerance (m): forces are SI; give both with the stiffness")
        _agree(self.out, job)

    def is_done(self, block: Block) -> bool:
        """Returns True if the labels of the block already exist."""
        return (self.out / "nearest" / block.name).exists()

    def __call__(self, block: Block) -> dict[str, Any]:
        """Writes the labels of a block, unless they already exist. Returns the block's name and counts."""
        counts = {"block": block.name, "poses": block.rows, "contacts": 0, "overlapping": 0, "done_before": True}
        if self.is_done(block):
            return counts
        table = pq.ParquetFile(block.file).read_row_group(block.group, columns=_POSE)
        poses = np.stack([table[name].to_numpy() for name in _POSE], axis=1)
        nearest, contacts = query(self.a, self.b, poses, self.job.tolerance, workers=self.workers)
        numbers = block.first + np.arange(block.rows, dtype=np.uint64)
        if self.job.depth:
            bounds = depth(self.a, self.b, poses, workers=self.workers)
            self._write("depth", block, {"pose": numbers, **_columns(bounds)})
        if self.job.stiffness is not None:
            names = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
            columns = dict(zip(names, np.ascontiguousarray(self._wrenches(poses).T)))
            self._write("wrench", block, {"pose": numbers, **columns})
        of_contacts = _columns(contacts)
        of_contacts["pose"] = of_contacts["pose"] + np.uint64(block.first)
        self._write("contacts", block, of_contacts)
        # This file is written last, because it shows that the block is done.
        self._write("nearest", block, {"pose": numbers, **_columns(nearest)})
        overlapping = int((nearest["separation"] < 0).sum())
        return {**counts, "contacts": len(contacts), "overlapping": overlapping, "done_before": False}

    def _wrenches(self, poses: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Returns the wrench at each pose. Each block starts with a new world, so it does not depend on earlier blocks."""
        settings = Settings.direct(tolerance=self.job.tolerance or 0.0, stiffness=self.job.stiffness or 0.0)
        world = World(settings)
        world.add_fixed(self.b, [0, 0, 0, 0, 0, 0, 1])
        world.add_tool(self.a, settings)
        return np.concatenate([world.step(pose) for pose in poses]) if len(poses) else np.empty((0, 6))

    def _write(self, kind: str, block: Block, columns: dict[str, npt.NDArray[Any]]) -> None:
        folder = self.out / kind
        folder.mkdir(parents=True, exist_ok=True)
        # The file is renamed when it is complete, so no reader sees a part of a file.
        unfinished = folder / f".{block.name}.{os.getpid()}"
        pq.write_table(pa.table(columns), unfinished, compression="zstd")
        unfinished.replace(folder / block.name)


def _columns(rows: npt.NDArray[np.void]) -> dict[str, npt.NDArray[Any]]:
    columns: dict[str, npt.NDArray[Any]] = {}
    for name in rows.dtype.names or ():
        column = rows[name]
        if column.ndim == 2:
            columns.update({f"{name}_{axis}": np.ascontiguousarray(column[:, k]) for k, axis in enumerate("xyz")})
        else:
            columns[name] = np.ascontiguousarray(column.astype("U1") if column.dtype.kind == "S" else column)
    return columns


def _agree(out: pathlib.Path, job: Job) -> None:
    """Writes the job into the folder of its labels. If a job is already there, fails unless it is the same job."""
    out.mkdir(parents=True, exist_ok=True)
    file, text = out / "job.json", json.dumps(dataclasses.asdict(job), indent=2) + "\n"
    try:
        with file.open("x") as new:
            new.write(text)
    except FileExistsError:
        before = file.read_text()
        if before and before != text:
            raise Error(f"{file}: this folder has the labels of another job; choose another folder") from None
