"""`palpus bench scale`: how long a step takes. The programs run by turns, so that what else the machine does meets both."""
import json

from judging.bench import SIDES, CannotRun
from judging.page import EXACT, Resolution, Row, Table

ROUNDS = 2
QUICK_PAIRS = ("spoon-cup", "armadillo-intestine", "gears")
TICKS, QUICK_TICKS = 5000, 1000
FILES = ("triangles.json", "contacts.json", "pairs.json")
TIMES = ("p50", "p99")
# The least that is told apart even where two runs of one program agree.
LEAST_SHARE = {"p50": 0.05, "p99": 0.10}


def scale(bench):
    if not bench.models.is_dir():
        raise CannotRun(f"{bench.models} is not there; name the models with --models FOLDER")
    runs = {side: [] for side in SIDES}
    for turn in range(ROUNDS):
        for side in SIDES:
            runs[side].append(measure(bench, side, turn))
    rows = []
    for name, first in runs["base"][0].items():
        after = [run.get(name) for run in runs["new"]]
        if None in after:
            rows.append(Row(name, first["p50"], None, "less", EXACT))
            continue
        before = [run[name] for run in runs["base"]]
        rows += [time_row(f"{name}: {part} (µs)", part, before, after) for part in TIMES]
        contacts = [run["contacts"] for run in (before[0], after[0])]
        rows.append(Row(f"{name}: contacts, mean", *contacts, "same", Resolution(0.0, 0.005)))
    return [Table("Step times", rows, f"The least of {ROUNDS} runs each. Resolution: how far two runs of one program are apart, and at least 5 % (p99: 10 %).")]


def time_row(name, part, before, after):
    """The least of the runs; what two runs of the same program differ by is not told apart."""
    a, b = ([run[part] for run in runs] for runs in (before, after))
    spread = max(max(a) / min(a), max(b) / min(b)) - 1
    return Row(name, min(a), min(b), "less", Resolution(0.0, max(spread, LEAST_SHARE[part])))


def measure(bench, side, turn):
    """Times and contacts of each pair, by name."""
    figures = {}
    for number, only in enumerate(QUICK_PAIRS if bench.quick else [None]):
        out = bench.folder(side, "scale", f"{turn}-{number}")
        chosen = ["--only", only] if only else []
        bench.palpus(side, "bench", "scale", "--ticks", QUICK_TICKS if bench.quick else TICKS, "--models", bench.models, "--out", out, *chosen)
        for path in (out / name for name in FILES):
            if path.exists():
                figures |= {row["name"]: {key: row[key] for key in (*TIMES, "contacts")} for row in json.loads(path.read_text())}
    return figures
