"""`palpus bench scale`: the time of a step on each of its pairs. The programs take turns pair by pair, so that other load of the machine
affects both. The sweeps over triangles and contacts would add no information."""
import json

from judging.bench import SIDES, CannotRun
from judging.page import EXACT, Resolution, Row, Table

ROUNDS = 2
PAIRS = ("spoon-cup", "armadillo-intestine", "nut-bolt", "gears", "drill-blade", "lucy-embryo")
QUICK_PAIRS = ("spoon-cup", "armadillo-intestine", "gears")
TICKS, QUICK_TICKS = 2000, 1000
TIMES = ("p50", "p99")
# Smallest resolution, even if two runs of one program agree better.
LEAST_SHARE = {"p50": 0.05, "p99": 0.10}


def scale(bench):
    if not bench.models.is_dir():
        raise CannotRun(f"{bench.models} does not exist; name the models with --models FOLDER")
    rows = []
    for pair in QUICK_PAIRS if bench.quick else PAIRS:
        runs = {side: [] for side in SIDES}
        for turn in range(ROUNDS):
            for side in SIDES:
                runs[side].append(measure(bench, side, pair, turn))
        if all(runs["base"]):
            rows += pair_rows(pair, runs["base"], runs["new"])
    note = f"The smallest of {ROUNDS} runs each. Resolution: the difference between two runs of one program, but at least 5 % (p99: 10 %)."
    return [Table("Step times", rows, note)]


def pair_rows(pair, before, after):
    if not all(after):
        return [Row(pair, before[0]["p50"], None, "less", EXACT)]
    rows = [time_row(f"{pair}: {part} (µs)", part, before, after) for part in TIMES]
    contacts = [run["contacts"] for run in (before[0], after[0])]
    return [*rows, Row(f"{pair}: contacts, mean", *contacts, "same", Resolution(0.0, 0.005))]


def time_row(name, part, before, after):
    """Compares the smallest times of the runs. The resolution is the difference between two runs of the same program."""
    a, b = ([run[part] for run in runs] for runs in (before, after))
    spread = max(max(a) / min(a), max(b) / min(b)) - 1
    return Row(name, min(a), min(b), "less", Resolution(0.0, max(spread, LEAST_SHARE[part])))


def measure(bench, side, pair, turn):
    """Returns times and contacts of a pair; an empty dictionary if its meshes are missing."""
    out = bench.folder(side, "scale", f"{pair}-{turn}")
    ticks = QUICK_TICKS if bench.quick else TICKS
    bench.palpus(side, "bench", "scale", "--ticks", ticks, "--models", bench.models, "--out", out, "--only", pair)
    rows = json.loads((out / "pairs.json").read_text())
    return {key: rows[0][key] for key in (*TIMES, "contacts")} if rows else {}
