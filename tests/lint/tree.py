# SPDX-License-Identifier: Apache-2.0
"""The source tree as the lint checks see it: which files there are, and how a check reports.

Knows the fixed folders of the repository by name, so build output and data are never read.
"""

import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FOLDERS = ("proto", "server", "ingest", "query", "schema", "tests", "docker", "docs", ".ci")
CPP = (".h", ".cc")


def files(suffixes=None, root=ROOT):
    """Paths relative to the root, sorted; `suffixes` narrows them, None means all."""
    found = [n for n in os.listdir(root) if os.path.isfile(os.path.join(root, n))]
    for top in FOLDERS:
        for folder, subfolders, names in os.walk(os.path.join(root, top)):
            subfolders[:] = [s for s in subfolders if s != "__pycache__"]
            found += [os.path.relpath(os.path.join(folder, n), root) for n in names]
    found = [f for f in found if not f.startswith("tests/data/")]
    if suffixes is not None:
        found = [f for f in found if f.endswith(tuple(suffixes))]
    return sorted(found)


def read(path, root=ROOT):
    with open(os.path.join(root, path), encoding="utf-8") as f:
        return f.read()


def report(check, problems, looked_at):
    """Prints one line a problem and a closing line; returns the exit code."""
    for problem in problems:
        print(f"{check}: {problem}")
    print(f"{check}: {looked_at}, {len(problems)} problem{'s' * (len(problems) != 1)}")
    return 1 if problems else 0


def main(check, find_problems):
    """Runs `find_problems() -> (problems, what was looked at)` as a program."""
    problems, looked_at = find_problems()
    sys.exit(report(check, problems, looked_at))
