"""Instructions of queries between convex bodies: compares the file in the repository with a count of this checkout's sources."""
import re
import shutil

from judging.bench import ROOT, CannotRun
from judging.page import Resolution, Row, Table

COUNTED = Resolution(0.0, 0.02)


def convex(bench):
    if not shutil.which("valgrind"):
        raise CannotRun("valgrind is not installed; it counts the instructions")
    counted = bench.folder("new") / "instructions.txt"
    # An earlier file is removed, because the bench would compare with it.
    counted.unlink(missing_ok=True)
    command = ["cargo", "bench", "-p", "palpus", "--bench", "convex", "--", "--instructions", counted]
    run = bench.start(command, cwd=ROOT)
    if not counted.exists():
        raise CannotRun(f"cargo bench: exit {run.returncode}: {run.stderr.strip()[-300:]}")
    before, after = read(bench.kept), read(counted)
    rows = [Row(name, value, after.get(name), "less", COUNTED) for name, value in before.items()]
    return [Table("Instructions of convex queries", rows, "Before: the stored file. After: the sources of this checkout.")]


def read(path):
    """Returns the figures of the table by row and column. Columns are separated by at least two spaces."""
    table = [re.split(r"\s{2,}", line.strip()) for line in path.read_text().splitlines() if line.strip() and not line.startswith("#")]
    columns = table[0]
    figures = {}
    for row in table[1:]:
        name, values = " ".join(row[: -len(columns)]), row[-len(columns):]
        figures |= {f"{name}, {column}": int(value) for column, value in zip(columns, values)}
    return figures
