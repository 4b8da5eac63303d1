#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether what the Markdown files link to is there, file and heading, each table of docs/measured
is linked, nothing in them is left to be done, and their programs are those that the tests run.
Addresses of the web are not asked for.

A block of code stands below a comment that names its source, of which it has to be a copy:

    <!-- examples/swap.cpp -->            the file, from the line below its licence
    <!-- examples/swap.cpp: motion -->    the lines between two lines `// [motion]`, or in Python
                                          `# [motion]`
    <!-- output of examples/swap -->      examples/swap.out, where <number> stands for any number

C++ without such a comment is only in pages that tests/CMakeLists.txt compiles.
"""

import re
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("docs", "examples", "benchmarks", "tests", "packaging", ".github")
PATTERNS = ("*.md", *(f"{folder}/**/*.md" for folder in FOLDERS))
LINK = re.compile(
    r"\[[^\]]*\]\(\s*<?([^\s)>]+)>?(?:\s+\"[^\"]*\")?\s*\)"  # [text](target "title")
    r"|^ *\[(?!\^)[^\]]+\]:\s*(\S+)",  # [text]: target, and no footnote
    re.MULTILINE,
)
HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
BLOCK = re.compile(
    r"(?:^<!-- (?P<output>output of )?(?P<file>examples/[\w./]+)(?:: (?P<part>\w+))? -->\n+)?"
    r"^ *```(?P<language>[^`\n]*)\n(?P<text>.*?)^ *```$",
    re.MULTILINE | re.DOTALL,
)
MARK = re.compile(r"^<!-- (?:output of )?examples/", re.MULTILINE)
COMPILED = re.compile(r"^fcl_fibers_code_blocks\((\S+) ", re.MULTILINE)
LEFT_TO_DO = re.compile(r"\b(TBD|TODO|FIXME|not measured yet)\b")


def without_code(text):
    """C++ and CMake have brackets before parentheses too; lines stay where they are."""

    def blank(match):
        return re.sub(r"[^\n]", " ", match[0])

    text = re.sub(r"^ *```.*?^ *```", blank, text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"(`+)(?!`)[^\n]*?\1", blank, text)


def anchors(path):
    """Of the headings, as GitHub makes them."""
    text = re.sub(r"^ *```.*?^ *```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    found = set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))
    counts = {}
    for heading in HEADING.findall(text):
        shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        anchor = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
        number = counts.get(anchor, 0)
        counts[anchor] = number + 1
        found.add(f"{anchor}-{number}" if number else anchor)
    return found


def what_is_wrong(path, link):
    """Of a link in the file at `path`; None where it leads somewhere."""
    if re.match(r"[a-z][a-z0-9+.-]*:", link):
        return None
    name, _, anchor = link.partition("#")
    target = (path.parent / name).resolve() if name else path
    if not target.is_relative_to(ROOT):
        return "leads out of the repository"
    if not target.exists():
        return "leads to a file that is not there"
    if anchor and (target.suffix != ".md" or anchor not in anchors(target)):
        return "leads to a heading that is not there"
    return None


def is_copy(block):
    """Whether a block is what the comment above it names."""
    path = ROOT / (block["file"] + (".out" if block["output"] else ""))
    source = path.read_text(encoding="utf-8") if path.is_file() else ""
    if block["output"]:
        pattern = re.escape(source).replace("<number>", r"[0-9.]+")
        return re.fullmatch(pattern, block["text"]) is not None
    if block["part"]:
        parts = re.split(rf"^ *(?://|#) \[{block['part']}\]\n", source, flags=re.MULTILINE)
        return len(parts) == 3 and block["text"] == textwrap.dedent(parts[1])
    return block["text"] == source.partition("\n")[2].lstrip("\n")


def code_errors(name, text):
    """Place and kind of what is wrong with the code of a page."""
    build = (ROOT / "tests/CMakeLists.txt").read_text(encoding="utf-8")
    marks = {match.start() for match in MARK.finditer(text)}
    for block in BLOCK.finditer(text):
        if block["file"]:
            marks.remove(block.start())
            if not is_copy(block):
                yield block.start(), f"the block below is no copy of {block['file']}"
        elif block["language"] == "cpp" and name not in COMPILED.findall(build):
            yield block.start(), "no test has this program; name its example in a comment above it"
    for mark in marks:
        yield mark, "no block of code is below this comment, or it has another form"


def main():
    errors = []
    links = 0
    tables = set((ROOT / "docs" / "measured").glob("*.csv"))
    for path in sorted({path for pattern in PATTERNS for path in ROOT.glob(pattern)}):
        text = path.read_text(encoding="utf-8")

        def error(at, what):
            line = text.count("\n", 0, at) + 1
            errors.append(f"{path.relative_to(ROOT)}:{line}: {what}")

        for match in LINK.finditer(without_code(text)):
            links += 1
            link = match[1] or match[2]
            tables.discard((path.parent / link).resolve())
            wrong = what_is_wrong(path, link)
            if wrong:
                error(match.start(), f"'{link}' {wrong}")
        for at, what in code_errors(str(path.relative_to(ROOT)), text):
            error(at, what)
        for match in LEFT_TO_DO.finditer(text):
            error(match.start(), match[0])
    errors += [f"{path.relative_to(ROOT)}: no page links this table" for path in sorted(tables)]
    if not links:
        errors.append("no link was found, so that none was looked at")
    print("\n".join(errors) or f"{links} links lead somewhere")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
