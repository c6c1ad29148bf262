"""Labels and prepared parts on many cores and machines, by Ray Data.

`python -m palpus.ray label POSES A B --out FOLDER` and `python -m palpus.ray prepare LIBRARY --out TABLE` are commands.

Ray gives blocks (`palpus.labels`) to actors that hold the prepared bodies. The labels are the same bytes with any number
of actors. Blocks that are there already are left out, so a job that was stopped goes on; an actor that dies costs the block
that it was at, which another one answers. The driver holds a row for each block, whatever the number of poses.

All machines must see the meshes, the poses and the folder of the labels under the same names.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import ray
import ray.data

from . import Error, parts
from .labels import Block, Job, Labeller, blocks

__all__ = ["label", "main", "prepare"]


class _Actor:
    """A labeller, as Ray Data calls it: a batch is one block."""

    def __init__(self, job: Job) -> None:
        self.label = Labeller(job)

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        block = Block(*(batch[name][0].item() if hasattr(batch[name][0], "item") else batch[name][0] for name in _BLOCK))
        return {name: np.array([value]) for name, value in self.label(block).items()}


_BLOCK = ("file", "group", "first", "rows")


def label(job: Job, poses: str, *, actors: int) -> Iterator[dict[str, Any]]:
    """Answers all blocks of `poses` that are not done with so many actors, each of one core.

    Yields the counts of each block when it is done. Ray must be initialised, or is, on this machine.
    """
    if actors < 1:
        raise Error(f"actors is {actors}, but must be 1 or more")
    first = Labeller(job)  # Prepares the bodies for all, and finds what is wrong before Ray starts.
    wanted = [block for block in blocks(poses) if not first.is_done(block)]
    if not wanted:
        return
    items = [{name: getattr(block, name) for name in _BLOCK} for block in wanted]
    done = ray.data.from_items(items, override_num_blocks=len(items)).map_batches(
        _Actor,
        fn_constructor_args=(job,),
        batch_size=1,
        batch_format="numpy",
        compute=ray.data.ActorPoolStrategy(size=min(actors, len(items))),
        num_cpus=1,
    )
    yield from done.iter_rows()


def prepare(library: str, out: str, *, unit: str | None = None, actors: int) -> Iterator[dict[str, Any]]:
    """Prepares all parts of a library into the cache folder, so many at a time, and writes their table to `out` at the end.

    Yields each part's row when it is done. A part that cannot be used is a row with its error. What was prepared before is
    only loaded, so a job that was stopped goes on. Machines share bodies if their cache folder (`XDG_CACHE_HOME`) is shared.
    """
    if actors < 1:
        raise Error(f"actors is {actors}, but must be 1 or more")

    def row_of(item: dict[str, Any]) -> dict[str, Any]:
        return parts.prepare(str(item["file"]), unit=unit)

    files = [{"file": file} for file in parts.parts(library)]
    done = ray.data.from_items(files, override_num_blocks=len(files)).map(
        row_of, compute=ray.data.TaskPoolStrategy(size=actors), num_cpus=1
    )
    rows = []
    for row in done.iter_rows():
        rows.append(row)
        yield row
    parts.write(rows, out)


def main(arguments: list[str]) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m palpus.ray", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("prepare", help="prepare a library of parts, and tell what they are like")
    command.add_argument("library", metavar="LIBRARY", help="folder of meshes, or one mesh")
    command.add_argument("--out", required=True, metavar="TABLE", help="Parquet file for the table")
    command.add_argument("--actors", type=int, default=1, metavar="N", help="parts at a time, a core each [default: 1]")
    command.add_argument("--unit", metavar="UNIT", help="of the meshes; bodies are then in metres")
    command.set_defaults(run=_prepare)
    command = commands.add_parser("label", help="labels of poses")
    command.set_defaults(run=_label)
    command.add_argument("poses", metavar="POSES", help="Parquet file or folder: tx, ty, tz, qx, qy, qz, qw, a in b's frame")
    command.add_argument("a", metavar="A", help="mesh of body a")
    command.add_argument("b", metavar="B", help="mesh of body b")
    command.add_argument("--out", required=True, metavar="FOLDER", help="where the labels go")
    command.add_argument("--actors", type=int, default=1, metavar="N", help="actors of one core each [default: 1]")
    command.add_argument("--tolerance", type=float, metavar="T", help="contacts are nearer than this")
    command.add_argument("--unit", metavar="UNIT", help="of the meshes; labels are then in metres")
    command.add_argument("--depth", action="store_true", help="bounds of the depth as well")
    command.add_argument("--stiffness", type=float, metavar="K", help="wrenches as well, of contacts this stiff, N/m")
    typed = parser.parse_args(arguments)
    try:
        typed.run(typed)
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def _label(typed: argparse.Namespace) -> None:
    job = Job(typed.a, typed.b, typed.out, typed.unit, typed.tolerance, typed.depth, typed.stiffness)
    begin, poses, count = time.monotonic(), 0, 0
    for done in label(job, typed.poses, actors=typed.actors):
        poses, count = poses + int(done["poses"]), count + 1
        rate = poses / (time.monotonic() - begin)
        print(f"\r{count} blocks, {poses} poses, {rate:.0f} poses/s", end="", file=sys.stderr, flush=True)
    print(f"\n{poses} poses in {time.monotonic() - begin:.1f} s; labels in {typed.out}", file=sys.stderr)


def _prepare(typed: argparse.Namespace) -> None:
    begin, count, bad = time.monotonic(), 0, 0
    for row in prepare(typed.library, typed.out, unit=typed.unit, actors=typed.actors):
        count, bad = count + 1, bad + bool(row["error"])
        print(f"\r{count} parts, {bad} that cannot be used", end="", file=sys.stderr, flush=True)
    print(f"\n{count} parts in {time.monotonic() - begin:.1f} s; what they are like is in {typed.out}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
