"""Labels on many cores and machines, by Ray Data: `python -m palpus.ray label POSES A B --out FOLDER`.

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

from . import Error
from .labels import Block, Job, Labeller, blocks

__all__ = ["label", "main"]


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


def main(arguments: list[str]) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m palpus.ray", description=__doc__.splitlines()[0])
    command = parser.add_subparsers(required=True).add_parser("label", help="labels of poses")
    command.add_argument("poses", metavar="POSES", help="Parquet file or folder: tx, ty, tz, qx, qy, qz, qw, a in b's frame")
    command.add_argument("a", metavar="A", help="mesh of body a")
    command.add_argument("b", metavar="B", help="mesh of body b")
    command.add_argument("--out", required=True, metavar="FOLDER", help="where the labels go")
    command.add_argument("--actors", type=int, default=1, metavar="N", help="actors of one core each [default: 1]")
    command.add_argument("--tolerance", type=float, metavar="T", help="contacts are nearer than this")
    command.add_argument("--unit", metavar="UNIT", help="of the meshes; labels are then in metres")
    command.add_argument("--depth", action="store_true", help="bounds of the depth as well")
    typed = parser.parse_args(arguments)
    job = Job(typed.a, typed.b, typed.out, typed.unit, typed.tolerance, typed.depth)
    begin, poses, count = time.monotonic(), 0, 0
    try:
        for done in label(job, typed.poses, actors=typed.actors):
            poses, count = poses + int(done["poses"]), count + 1
            rate = poses / (time.monotonic() - begin)
            print(f"\r{count} blocks, {poses} poses, {rate:.0f} poses/s", end="", file=sys.stderr, flush=True)
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"\n{poses} poses in {time.monotonic() - begin:.1f} s; labels in {typed.out}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
