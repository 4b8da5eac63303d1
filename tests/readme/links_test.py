#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether what the Markdown files link to is there, file and heading, nothing in them is left to be
done, and the README's program is examples/minimal.cpp with its output. Addresses of the web are not
asked for."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PATTERNS = ("*.md", "docs/**/*.md", "benchmarks/**/*.md", "tests/**/*.md")
LINK = re.compile(
    r"\[[^\]]*\]\(\s*<?([^\s)>]+)>?(?:\s+\"[^\"]*\")?\s*\)"  # [text](target "title")
    r"|^ *\[(?!\^)[^\]]+\]:\s*(\S+)",  # [text]: target, and no footnote
    re.MULTILINE,
)
HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
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


def first_program_errors():
    """examples/CMakeLists.txt runs the program and has its output as a regular expression."""
    blocks = re.findall(
        r"^```(cpp|text)\n(.*?)^```", (ROOT / "README.md").read_text(encoding="utf-8"), re.M | re.S
    )
    if [language for language, _ in blocks] != ["cpp", "text"]:
        return ["README.md: there is not one block of C++ and then one of its output"]
    (_, program), (_, output) = blocks
    _, _, minimal = (ROOT / "examples/minimal.cpp").read_text(encoding="utf-8").partition("\n")
    examples = (ROOT / "examples/CMakeLists.txt").read_text(encoding="utf-8")
    expected = re.search(r"fcl_fibers_example\(minimal [^\"]*\"(.*)\"\)", examples)[1]
    errors = []
    if program != minimal:
        errors.append("README.md: the program is not examples/minimal.cpp")
    if not re.fullmatch(expected, output.rstrip("\n"), re.S):
        errors.append(f"README.md: the output is not that of examples/CMakeLists.txt: {expected}")
    return errors


def main():
    errors = first_program_errors()
    links = 0
    for path in sorted({path for pattern in PATTERNS for path in ROOT.glob(pattern)}):
        text = path.read_text(encoding="utf-8")

        def error(at, what):
            line = text.count("\n", 0, at) + 1
            errors.append(f"{path.relative_to(ROOT)}:{line}: {what}")

        for match in LINK.finditer(without_code(text)):
            links += 1
            link = match[1] or match[2]
            wrong = what_is_wrong(path, link)
            if wrong:
                error(match.start(), f"'{link}' {wrong}")
        for match in LEFT_TO_DO.finditer(text):
            error(match.start(), match[0])
    if not links:
        errors.append("no link was found, so that none was looked at")
    print("\n".join(errors) or f"{links} links lead somewhere")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
