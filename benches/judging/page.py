"""Rows with figures before and after, their verdicts, and the page with all tables."""
import dataclasses
import datetime
import math
import os


@dataclasses.dataclass
class Resolution:
    """Differences up to `floor` (in the figure's unit) plus `share` of the earlier value count as equal."""

    floor: float = 0.0
    share: float = 0.0

    def width(self, before):
        return self.floor + self.share * abs(before)

    def __str__(self):
        parts = ([f"{self.floor:.3g}"] if self.floor else []) + ([f"{100 * self.share:.3g} %"] if self.share else [])
        return " + ".join(parts) or "exact"


EXACT = Resolution()


@dataclasses.dataclass
class Row:
    """One figure of two programs. `sense`: 'less' or 'more' is better, or 'same' if every difference is worse."""

    what: str
    before: object
    after: object
    sense: str
    resolution: Resolution

    def verdict(self):
        a, b = self.before, self.after
        if a == b or (is_nan(a) and is_nan(b)):
            return "equal"
        if not (is_number(a) and is_number(b)):
            # One of the two figures has no value: the probe was lost, or the figure does not exist.
            return "better" if is_number(b) and not is_number(a) else "WORSE"
        gain = {"less": a - b, "more": b - a, "same": -abs(a - b)}[self.sense]
        if abs(gain) <= self.resolution.width(a):
            return "within"
        return "better" if gain > 0 else "WORSE"


@dataclasses.dataclass
class Table:
    """The rows of one judge. `brief` leaves out rows that are equal or within the resolution."""

    title: str
    rows: list
    note: str = ""
    brief: bool = False

    def count(self, verdict):
        return sum(row.verdict() == verdict for row in self.rows)

    def text(self):
        counts = ", ".join(f"{self.count(v)} {v}" for v in ("equal", "within", "better", "WORSE"))
        lines = [f"## {self.title}", "", f"{len(self.rows)} figures: {counts}. {self.note}".strip(), ""]
        shown = [row for row in self.rows if not self.brief or row.verdict() in ("better", "WORSE")]
        if shown:
            lines += ["| what | before | after | change | resolution | |", "|---|---:|---:|---:|---:|---|"]
            lines += [line(row) for row in sorted(shown, key=lambda row: row.verdict() != "WORSE")]
        return "\n".join(lines) + "\n"


def is_number(value):
    return isinstance(value, (int, float)) and not is_nan(value)


def is_nan(value):
    return isinstance(value, float) and math.isnan(value)


def number(value):
    return f"{value:.6g}" if is_number(value) else "none" if value is None else str(value)


def line(row):
    change = ""
    if is_number(row.before) and is_number(row.after) and row.before != row.after:
        change = f"{100 * (row.after - row.before) / abs(row.before):+.2g} %" if row.before else f"{row.after - row.before:+.3g}"
    verdict = row.verdict()
    mark = "**WORSE**" if verdict == "WORSE" else verdict
    return f"| {row.what} | {number(row.before)} | {number(row.after)} | {change} | {row.resolution} | {mark} |"


def write(bench, tables, unable):
    now = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC")
    head = ["# Before and after", "", f"{now}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}{', quick' if bench.quick else ''}.", ""]
    head += [f"- {name}: `{path.name}`, SHA-256 {bench.fingerprint(name)}…" for name, path in bench.programs.items()]
    head += [
        "",
        "*equal*: the same bits. *within*: closer than the figure's own resolution (a floor in its unit, plus a share of the value before).",
        "",
        "| judge | figures | equal | within | better | worse |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for table in tables:
        if not table.rows:
            continue
        counts = " | ".join(str(table.count(v)) for v in ("equal", "within", "better"))
        worse = table.count("WORSE")
        head.append(f"| {table.title} | {len(table.rows)} | {counts} | {f'**{worse}**' if worse else 0} |")
    head += [f"| {name} | not run: {why.replace('|', '/')} | | | | |" for name, why in unable.items()]
    (bench.out / "judges.md").write_text("\n".join(head) + "\n\n" + "\n".join(table.text() for table in tables))
