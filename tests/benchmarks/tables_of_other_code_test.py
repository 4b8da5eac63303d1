#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Each table of figures names the commit and the code that it is of: those that stand in documents
between marks, and those of docs/measured.

    tables_of_other_code_test.py [--strict]

It prints which tables are of this code and which of other code. --strict, for a release: the latter
fail.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from collections import Counter
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks" / "report"))

import figures  # noqa: E402
from code_hash import (  # noqa: E402
    as_it_is,
    files_of_commit,
    files_of_tree,
    hash_of,
    is_measured,
    without_comments,
)
from tables import MARK, documents  # noqa: E402

SOURCE = re.compile(
    r"\bcommit (?P<commits>[\w.-]+(?: and [\w.-]+)*),\s+"
    r"code (?P<codes>[0-9a-f]{12}(?: and [0-9a-f]{12})*)\b"
)

# What a code is of. Tables of earlier commits have one of comments and of what measures nothing,
# too.
CODES = ((without_comments, is_measured), (as_it_is, bool))

# A machine with this many cores measures when there is one. The log has what was.
SECOND_MACHINE = re.compile(r"_\d+_cores")


class Source(NamedTuple):
    """What some figures are of; of no commit where a table is not measured yet."""

    place: str  # the document, and the table or its line
    commits: tuple = ()
    codes: frozenset = frozenset()


def words(text):
    return text.split(" and ")


def last_line(path):
    """Of a CSV file, where what it is of stands."""
    return path.read_text(encoding="utf-8").splitlines()[-1]


def sources_of(root):
    """Of all tables, and of all else that names its code; and what is wrong. A table that several
    machines have measured has one source to find: the newest is what counts."""
    found, faults = [], []
    measured = sorted((root / "docs" / "measured").glob("*.csv"))
    sources = [
        (path.relative_to(root).as_posix(), SOURCE.search(last_line(path))) for path in measured
    ]
    for path in documents(root):
        text, name = path.read_text(encoding="utf-8"), path.relative_to(root).as_posix()
        marks = list(MARK.finditer(text))
        found += [Source(f"{name}, table {mark[2]}") for mark in marks if not mark[4].strip()]
        marks = [mark for mark in marks if mark[4].strip()]
        sources += [(f"{name}, table {mark[2]}", newest(mark[4], root)) for mark in marks]
        rest = MARK.sub(lambda mark: "\n" * mark[0].count("\n"), text)
        for match in SOURCE.finditer(rest):
            sources.append((f"{name}, line {rest.count(chr(10), 0, match.start()) + 1}", match))
    for place, match in sources:
        if match:
            codes = frozenset(words(match["codes"]))
            found.append(Source(place, tuple(words(match["commits"])), codes))
        else:
            faults.append(f"{place}: it does not end with 'commit X, code Y'")
    return found, faults


def newest(text, root):
    """Of the sources below a table, one that is of this code, or the last."""
    here = hash_of(files_of_tree(root))
    found = sorted(SOURCE.finditer(text), key=lambda match: match["codes"] == here)
    return found[-1] if found else None


def differences(files, others):
    """How many files of which folders differ."""
    names = filter(is_measured, files.keys() | others.keys())
    names = [name for name in names if files.get(name) != others.get(name)]
    counts = Counter("/".join(name.split("/")[:-1][:2]) for name in names)
    return ", ".join(f"{folder} {number}" for folder, number in sorted(counts.items()))


def codes_of(commits, root, form, of):
    return {hash_of(files_of_commit(commit, root, form), of) for commit in commits}


def judged(root):
    """Lines of text, what is wrong, and which figures are of other code."""
    sources, faults = sources_of(root)
    here = files_of_tree(root)
    lines, others = [], []
    for place, commits, codes in sources:
        if not commits:
            others.append(place)
            lines.append(f"{place}: not measured yet")
            continue
        known = [files_of_commit(commit, root) for commit in commits]
        if all(known) and not any(codes == codes_of(commits, root, *rule) for rule in CODES):
            right = " and ".join(hash_of(files) for files in known)
            said = " and ".join(sorted(codes))
            faults.append(f"{place}: code {said} is not its commit's, which is {right}")
        if codes == {hash_of(here)}:
            lines.append(f"{place}: of this code")
            continue
        if not (SECOND_MACHINE.search(place) or place.startswith("docs/log.md")):
            others.append(place)
        far = differences(known[0], here) if known[0] else "which is not in the history here"
        lines.append(f"{place}: of other code, commit {' and '.join(commits)} ({far})")
    return lines, faults, others


def summary(root):
    lines, _, others = judged(root)
    return (
        f"{len(others)} of {len(lines)} tables are of other code or not measured yet; a release "
        "measures them again (tests/benchmarks/tables_of_other_code_test.py lists them)."
    )


class TreeTest(unittest.TestCase):
    """A small tree with a document, in a history of its own."""

    def setUp(self):
        self.root = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)
        for name in (
            "src/tree/a.cpp",
            "include/a.h",
            "benchmarks/main.cpp",
            "docs/a.md",
            "README.md",
        ):
            self.write(name, name)
        self.write(".gitignore", "/src/*.o\n")
        self.git("init", "-q")
        self.commit()

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def git(self, *words):
        command = ["git", "-C", self.root, "-c", "user.name=a", "-c", "user.email=a@b", *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def commit(self):
        self.git("add", ".")
        self.git("commit", "-qm", "a")

    def hash(self):
        return hash_of(files_of_tree(self.root))

    def document(self, code, commit="HEAD", table="ratios"):
        head = self.git("rev-parse", "--short", commit)
        text = (
            f"<!-- table {table}: a -->\n`a`; commit {head}, code {code}.\n<!-- end of table -->\n"
        )
        self.write("README.md", text)

    def test_commit_tree_and_archive_have_one_hash(self):
        """If this failed, figures of this code would be called figures of other code."""
        self.assertEqual(self.hash(), hash_of(files_of_commit("HEAD", self.root)))
        self.write("src/ignored.o", "built")
        self.write("benchmarks/report/__pycache__/a.pyc", "built")
        self.write("benchmarks/report/tables.py", "makes tables of results")
        self.write("benchmarks/run.py", "calls programs")
        self.write("docs/a.md", "changed")
        self.write("src/tree/a.cpp", "src/tree/a.cpp  // Why.\n/* Why\nnot. */")
        known = self.hash()
        self.assertEqual(known, hash_of(files_of_commit("HEAD", self.root)))
        shutil.rmtree(self.root / ".git")
        (self.root / "src" / "ignored.o").unlink()
        self.assertEqual(known, self.hash())

    def test_what_only_looks_like_a_comment_counts(self):
        """If this failed, code could change behind a hash that stays."""
        seen = set()
        for text in (
            'a = "//x";',
            'a = "//y";',
            'a = "\\"//x";',
            'a = "\\"//y";',
            "a = '\"'; b = 1; // \"",
            "a = '\"'; b = 2; // \"",
            "a = 1'000; b = '/'; c(); // '",
            "a = 1'000; b = '/'; d(); // '",
            'a = R"x(")" // 1)x";',
            'a = R"x(")" // 2)x";',
            "a b",
            "ab",
            "#define A b\nc",
            "#define A b c",
        ):
            self.write("src/tree/a.cpp", text)
            seen.add(self.hash())
        self.assertEqual(len(seen), 14)

    def test_each_change_of_code_changes_the_hash(self):
        """If this failed, figures of other code would be called figures of this one."""
        seen = {self.hash()}
        self.write("src/tree/a.cpp", "changed")
        seen.add(self.hash())
        self.write("src/new.cpp", "not tracked yet")
        seen.add(self.hash())
        (self.root / "include" / "a.h").rename(self.root / "include" / "b.h")
        seen.add(self.hash())
        (self.root / "benchmarks" / "main.cpp").unlink()
        seen.add(self.hash())
        self.assertEqual(len(seen), 5)

    def test_a_table_is_of_this_code_or_of_other_code(self):
        """If this failed, nobody would see that a table is old."""
        self.document(self.hash())
        self.assertEqual(judged(self.root), (["README.md, table ratios: of this code"], [], []))
        self.write("src/tree/a.cpp", "changed")
        self.write("src/tree/b.cpp", "new")
        lines, faults, others = judged(self.root)
        self.assertEqual(faults, [])
        self.assertEqual(others, ["README.md, table ratios"])
        self.assertRegex(lines[0], r": of other code, commit [0-9a-f]+ \(src/tree 2\)$")
        self.assertIn("1 of 1 tables are of other code or", summary(self.root))

    def test_a_table_names_the_code_of_its_commit(self):
        """If this failed, a hash could be copied to figures that it is not of."""
        self.document("0123456789ab")
        self.assertRegex(judged(self.root)[1][0], ": code 0123456789ab is not its")
        shutil.rmtree(self.root / ".git")  # as in an archive, where no commit is known
        self.assertEqual(judged(self.root)[1], [])

    def test_two_commits_have_the_codes_of_both(self):
        """If this failed, tables of two measurements could not tell what they are of."""
        first, codes = self.git("rev-parse", "--short", "HEAD"), [self.hash()]
        self.write("src/tree/a.cpp", "changed")
        self.commit()
        codes.append(self.hash())
        self.document(" and ".join(codes), first)
        text = (self.root / "README.md").read_text()
        second = self.git("rev-parse", "--short", "HEAD")
        self.write("README.md", text.replace(first, f"{first} and {second}"))
        lines, faults, others = judged(self.root)
        self.assertEqual((faults, len(others)), ([], 1))
        self.write("README.md", text)
        self.assertEqual(len(judged(self.root)[1]), 1)

    def test_a_table_without_its_code_is_a_fault(self):
        """If this failed, a table could hide what it is of."""
        for source in ("commit abcdef0.", "| a |", "commit abcdef0, code unknown."):
            self.write("README.md", f"<!-- table a: b -->\n{source}\n<!-- end of table -->\n")
            self.assertEqual(
                judged(self.root)[1],
                ["README.md, table a: it does not end with 'commit X, code Y'"],
            )

    def test_a_file_of_a_table_names_its_code(self):
        """If this failed, a table in docs/measured could be old, or not tell what it is of."""
        for source, faults in ((f"commit HEAD, code {self.hash()}.", 0), ("of nothing", 1)):
            self.write("docs/measured/a.csv", f"a,b\n1,2\n{source},\n")
            lines, found, others = judged(self.root)
            self.assertEqual((len(found), others), (faults, []))
            self.assertEqual("docs/measured/a.csv: of this code" in lines, not faults)

    def test_a_second_machine_may_be_older(self):
        """If this failed, two machines would have to measure at once."""
        self.document(self.hash())
        text = (self.root / "README.md").read_text()
        old = "`a`; commit abcdef0, code 0123456789ab.\n"
        self.write("README.md", text.replace("<!-- end", old + "<!-- end"))
        self.assertEqual(judged(self.root), (["README.md, table ratios: of this code"], [], []))

    def test_a_place_without_a_table_is_no_fault_before_a_release(self):
        """If this failed, a new table could not be documented before hours of measuring, or a
        release could lack one."""
        self.write("README.md", "<!-- table a: b -->\n\n<!-- end of table -->\n")
        place = "README.md, table a"
        self.assertEqual(judged(self.root), ([f"{place}: not measured yet"], [], [place]))


class DocumentsTest(unittest.TestCase):
    def test_tables_name_the_code_that_they_are_of(self):
        """If this failed, nobody could tell which code a table is of."""
        lines, faults, others = judged(ROOT)
        self.assertGreater(len(lines), 30)
        print("\n".join(lines))
        self.assertEqual(faults, [])
        self.assertEqual(figures.fill(ROOT, write=False), [], "report.py --docs fills them in")
        if STRICT:
            self.assertEqual(others, [], "a release has figures of its own code")


STRICT = "--strict" in sys.argv
if __name__ == "__main__":
    program = unittest.main(argv=[word for word in sys.argv if word != "--strict"], exit=False)
    print(summary(ROOT))
    sys.exit(not program.result.wasSuccessful())
