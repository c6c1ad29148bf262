#!/usr/bin/env python3
"""Runs the reference scripts and holds their answers against the bars of this stage.

usage: hold_reference.py REFERENCE_FOLDER MODELS_FOLDER PALPUS

Convex pairs: nothing wrong but "local only", that in at most 3 % of the overlapping `random` frames of all folders
together and in none of the `sliding` ones. Non-convex pairs: nothing wrong.
"""
import pathlib
import re
import subprocess
import sys

LOCAL_ONLY_SHARE = 0.03

LINE = re.compile(
    r"^(?P<folder>[^/\s]+)/(?P<poses>\w+): \d+ checked \((?P<deep>\d+) overlapping, \d+ disjoint\), "
    r"(?P<wrong>\d+) wrong of which (?P<local>\d+) local only"
)


def convex(reference, palpus):
    folders = sorted(p for p in (reference / "convex").iterdir() if p.is_dir())
    script = [sys.executable, reference / "check_query.py", *folders, "--palpus", palpus]
    answer = subprocess.run(script, capture_output=True, text=True)
    print(answer.stdout, end="")
    print(answer.stderr, end="", file=sys.stderr)
    rows = [m for m in map(LINE.match, answer.stdout.splitlines()) if m]
    if len(rows) != 2 * len(folders):
        return [f"{len(rows)} result lines for {len(folders)} folders"]
    faults = [f"{m['folder']}/{m['poses']}: wrong answers" for m in rows if m["wrong"] != m["local"]]
    faults += [f"{m['folder']}/sliding: local only" for m in rows if m["poses"] == "sliding" and m["local"] != "0"]
    deep = sum(int(m["deep"]) for m in rows if m["poses"] == "random")
    local = sum(int(m["local"]) for m in rows if m["poses"] == "random")
    print(f"random: {local} of {deep} overlapping frames are local only ({100 * local / deep:.2f} %)")
    if local > LOCAL_ONLY_SHARE * deep:
        faults.append("random: too many are local only")
    return faults


def nonconvex(reference, models, palpus):
    script = [sys.executable, reference / "check_nonconvex.py", reference / "nonconvex", models, "--palpus", palpus]
    return [] if subprocess.run(script).returncode == 0 else ["non-convex: wrong answers"]


def feel(reference, palpus):
    scenes = reference / "feel"
    if not scenes.is_dir():
        print("skipped: no closed loops of feel beside the reference answers")
        return []
    folders = sorted(p for p in scenes.iterdir() if p.is_dir())
    script = [sys.executable, reference / "check_feel.py", *folders, "--palpus", palpus]
    return [] if subprocess.run(script).returncode == 0 else ["feel: wrong"]


def main():
    reference, models, palpus = map(pathlib.Path, sys.argv[1:4])
    faults = convex(reference, palpus) + nonconvex(reference, models, palpus) + feel(reference, palpus)
    for fault in faults:
        print("FAILED:", fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
