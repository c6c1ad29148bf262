"""Labels and prepared parts on many cores and machines, with Ray Data.

`python -m palpus.ray label POSES A B --out FOLDER` and `python -m palpus.ray prepare LIBRARY --out TABLE` are commands.

Ray distributes blocks (`palpus.labels`) to actors that have the prepared bodies. The bytes of the labels do not depend on
the number of actors. Blocks that already exist are skipped, so a stopped job can continue. If an actor dies, another actor
processes its block again. The driver stores one row for each block, whatever the number of poses.

All machines must see the meshes, the poses and the folder of the labels at the same paths.
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
    """A labeller with the interface that Ray Data calls. A batch is one block."""

    def __init__(self, job: Job) -> None:
        self.label = Labeller(job)

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        block = Block(*(batch[name][0].item() if hasattr(batch[name][0], "item") else batch[name][0] for name in _BLOCK))
        return {name: np.array([value]) for name, value in self.label(block).items()}


_BLOCK = ("file", "group", "first", "rows")


def label(job: Job, poses: str, *, actors: int) -> Iterator[dict[str, Any]]:
    """Processes all blocks of `poses` that are not done, with this number of actors of one core each.

    Yields the counts of each block when it is done. If Ray is not initialised, starts it on this machine.
    """
    if actors < 1:
        raise Error(f"actors is {actors}, but must be 1 or more")
    first = Labeller(job)  # Caches the bodies for all actors, and reports errors before Ray starts.
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
    """Prepares all parts of a library, `actors` of them at a time, and writes their table to `out` at the end.

    Stores the bodies in the cache folder. Yields each part's row when it is done. A part that cannot be used has an error in
    its row. Parts that are already in the cache are only loaded, so a stopped job can continue. Machines share bodies if
    they share the cache folder (`XDG_CACHE_HOME`).
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
    """Runs the command, and returns its exit status."""
    parser = argparse.ArgumentParser(prog="python -m palpus.ray", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("prepare", help="prepare a library of parts, and write a table of their state")
    command.add_argument("library", metavar="LIBRARY", help="folder of meshes, or one mesh")
    command.add_argument("--out", required=True, metavar="TABLE", help="Parquet file for the table")
    command.add_argument("--actors", type=int, default=1, metavar="N", help="parts at a time, one core each [default: 1]")
    command.add_argument("--unit", metavar="UNIT", help="unit of the meshes; bodies are then in metres")
    command.set_defaults(run=_prepare)
    command = commands.add_parser("label", help="write the labels of poses")
    command.set_defaults(run=_label)
    command.add_argument("poses", metavar="POSES", help="Parquet file or folder: tx, ty, tz, qx, qy, qz, qw of a in b's frame")
    command.add_argument("a", metavar="A", help="mesh of body a")
    command.add_argument("b", metavar="B", help="mesh of body b")
    command.add_argument("--out", required=True, metavar="FOLDER", help="folder for the labels")
    command.add_argument("--actors", type=int, default=1, metavar="N", help="actors, one core each [default: 1]")
    command.add_argument("--tolerance", type=float, metavar="T", help="maximum separation of contacts")
    command.add_argument("--unit", metavar="UNIT", help="unit of the meshes; labels are then in metres")
    command.add_argument("--depth", action="store_true", help="also write bounds of the depth")
    command.add_argument("--stiffness", type=float, metavar="K", help="also write wrenches, with this contact stiffness, N/m")
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
        print(f"\r{count} parts, {bad} of them cannot be used", end="", file=sys.stderr, flush=True)
    print(f"\n{count} parts in {time.monotonic() - begin:.1f} s; table in {typed.out}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
