"""`palpus bench scale`: how long a step takes on each of its pairs. The programs take turns pair by pair, so that what else the machine does
meets both. Its sweeps over triangles and contacts say nothing that the pairs do not."""
import json

from judging.bench import SIDES, CannotRun
from judging.page import EXACT, Resolution, Row, Table

ROUNDS = 2
PAIRS = ("spoon-cup", "armadillo-intestine", "nut-bolt", "gears", "drill-blade", "lucy-embryo")
QUICK_PAIRS = ("spoon-cup", "armadillo-intestine", "gears")
TICKS, QUICK_TICKS = 2000, 1000
TIMES = ("p50", "p99")
# The least that is told apart even where two runs of one program agree.
LEAST_SHARE = {"p50": 0.05, "p99": 0.10}


def scale(bench):
    if not bench.models.is_dir():
        raise CannotRun(f"{bench.models} is not there; name the models with --models FOLDER")
    rows = []
    for pair in QUICK_PAIRS if bench.quick else PAIRS:
        runs = {side: [] for side in SIDES}
        for turn in range(ROUNDS):
            for side in SIDES:
                runs[side].append(measure(bench, side, pair, turn))
        if all(runs["base"]):
            rows += pair_rows(pair, runs["base"], runs["new"])
    note = f"The least of {ROUNDS} runs each. Resolution: how far two runs of one program are apart, and at least 5 % (p99: 10 %)."
    return [Table("Step times", rows, note)]


def pair_rows(pair, before, after):
    if not all(after):
        return [Row(pair, before[0]["p50"], None, "less", EXACT)]
    rows = [time_row(f"{pair}: {part} (µs)", part, before, after) for part in TIMES]
    contacts = [run["contacts"] for run in (before[0], after[0])]
    return [*rows, Row(f"{pair}: contacts, mean", *contacts, "same", Resolution(0.0, 0.005))]


def time_row(name, part, before, after):
    """The least of the runs; what two runs of the same program differ by is not told apart."""
    a, b = ([run[part] for run in runs] for runs in (before, after))
    spread = max(max(a) / min(a), max(b) / min(b)) - 1
    return Row(name, min(a), min(b), "less", Resolution(0.0, max(spread, LEAST_SHARE[part])))


def measure(bench, side, pair, turn):
    """Times and contacts of a pair; none if its meshes are not there."""
    out = bench.folder(side, "scale", f"{pair}-{turn}")
    ticks = QUICK_TICKS if bench.quick else TICKS
    bench.palpus(side, "bench", "scale", "--ticks", ticks, "--models", bench.models, "--out", out, "--only", pair)
    rows = json.loads((out / "pairs.json").read_text())
    return {key: rows[0][key] for key in (*TIMES, "contacts")} if rows else {}
