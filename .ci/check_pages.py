#!/usr/bin/env python3
"""Checks the Markdown pages: every link within the repository leads to an existing file and heading, the book has every page of docs/, and Python code compiles.

usage: .ci/check_pages.py      (exit 1 if something is wrong)
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = [*ROOT.glob("*.md"), *sorted((ROOT / "docs").glob("*.md"))]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def anchors(page):
    """Returns the anchors of the headings of a page."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    headings = re.findall(r"^#+ +(.*)$", text, flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.replace("`", "").strip().lower()).replace(" ", "-") for heading in headings}


def main():
    wrong = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for code in re.findall(r"^```python\n(.*?)^```", text, flags=re.S | re.M):
            try:
                compile(code, page.name, "exec")
            except SyntaxError as error:
                wrong.append(f"{page.relative_to(ROOT)}: Python code: {error}")
        text = re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.S)
        for target in LINK.findall(text):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            file = (page.parent / path).resolve() if path else page
            if not file.exists():
                wrong.append(f"{page.relative_to(ROOT)}: {target} does not exist")
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                wrong.append(f"{page.relative_to(ROOT)}: {path or page.name} has no heading {anchor!r}")
    summary = (ROOT / "docs" / "SUMMARY.md").read_text(encoding="utf-8")
    for page in sorted((ROOT / "docs").glob("*.md")):
        if page.name != "SUMMARY.md" and f"({page.name})" not in summary:
            wrong.append(f"docs/SUMMARY.md does not name {page.name}")
    print("\n".join(wrong) if wrong else f"{len(PAGES)} pages: all links are valid, the book has every page, and Python code compiles")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
