#!/usr/bin/env python3
"""Measures the cost of labelling poses: with a loop, and with Ray with one and two actors.

usage: labels.py A B [POSES [BLOCK]]        (default: 200000 poses in blocks of 20000)

A and B are mesh files, such as tool.obj and part.obj of `palpus export spoon-cup FOLDER`. The poses are a smooth path
through B's box. Prints poses per second, bytes per pose that are read and written, and memory. Needs the Python package
with `ray[data]`; docs/ray.md quotes its output.
"""

import logging
import pathlib
import resource
import sys
import tempfile
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import ray

import palpus
from palpus.labels import Job, Labeller, blocks
from palpus.ray import label

COLUMNS = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")


def way(a: palpus.Body, b: palpus.Body, count: int) -> np.ndarray:
    """Returns poses on a slow spiral through B's box, with rotations about a slowly moving axis."""
    low, high = b.vertices.min(axis=0), b.vertices.max(axis=0)
    s = np.arange(count) / 2000.0
    middle, half = (low + high) / 2, (high - low) / 2 + 0.1 * a.size
    place = middle + half * np.stack([np.sin(1.0 * s), np.sin(1.3 * s + 1), np.sin(0.7 * s + 2)], axis=1)
    axis = np.stack([np.sin(0.3 * s), np.cos(0.2 * s), np.sin(0.11 * s + 1)], axis=1)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    half_turn = 0.4 * s[:, None]
    return np.concatenate([place, axis * np.sin(half_turn), np.cos(half_turn)], axis=1)


def size(folder: pathlib.Path) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*.parquet"))


def main() -> None:
    a, b = sys.argv[1:3]
    count, block = (int(sys.argv[k]) if len(sys.argv) > k else given for k, given in ((3, 200_000), (4, 20_000)))
    body_a, body_b = palpus.Body.load(a), palpus.Body.load(b)
    with tempfile.TemporaryDirectory() as folder:
        home = pathlib.Path(folder)
        poses = home / "poses.parquet"
        pq.write_table(pa.table(dict(zip(COLUMNS, way(body_a, body_b, count).T))), poses, row_group_size=block)
        print(f"{count} poses in blocks of {block}; read: {size(home) / count:.0f} bytes a pose")

        begin = time.monotonic()
        labeller = Labeller(Job(a, b, str(home / "loop")))
        for one in blocks(poses):
            labeller(one)
        alone = time.monotonic() - begin
        rss = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"a loop: {count / alone:.0f} poses/s; this process at most {rss:.0f} MB")
        print(f"written: {size(home / 'loop') / count:.0f} bytes a pose")

        begin = time.monotonic()
        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="error")
        logging.getLogger("ray.data").setLevel(logging.WARNING)
        print(f"Ray's start: {time.monotonic() - begin:.1f} s")
        rates = []
        for actors in (1, 2):
            begin = time.time()
            for _ in label(Job(a, b, str(home / f"by-{actors}")), str(poses), actors=actors):
                pass
            # Uses the times of the files, because rows reach the driver in groups. The first file of each actor includes the start.
            done = sorted(file.stat().st_mtime for file in (home / f"by-{actors}" / "nearest").iterdir())
            rates.append(block * (len(done) - actors) / (done[-1] - done[actors - 1]))
            print(f"{actors} actors: {rates[-1]:.0f} poses/s; the first block was there after {done[0] - begin:.1f} s")
        same = [(home / f"by-{n}" / "nearest" / one.name).read_bytes() for one in blocks(poses) for n in (1, 2)]
        assert same[0::2] == same[1::2], "other bytes with two actors"
        print(f"two actors: {rates[1] / rates[0]:.2f} times one; the same bytes")
        row = {"block": "poses-000000.parquet", "poses": block, "contacts": 0, "overlapping": 0, "done_before": False}
        print(f"a block's row: {len(ray.cloudpickle.dumps(row))} bytes")
        ray.shutdown()


if __name__ == "__main__":
    main()
