#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Is every C++ file as clang-format 14 would write it? With --fix, rewrites those that are not."""

import os
import subprocess
import sys

import tree

VERSION = "version 14."
BATCH = 40


def find_problems(fix):
    version = subprocess.run(["clang-format", "--version"], capture_output=True, text=True,
                             check=True).stdout
    if VERSION not in version:
        return [f"needs clang-format {VERSION[8:]}x, found: {version.strip()}"], "0 files"
    paths = tree.files(tree.CPP)
    problems = []
    for first in range(0, len(paths), BATCH):
        batch = paths[first:first + BATCH]
        if fix:
            subprocess.run(["clang-format", "-i", *batch], cwd=tree.ROOT, check=True)
            continue
        run = subprocess.run(["clang-format", "--dry-run", *batch], cwd=tree.ROOT,
                             capture_output=True, text=True, check=False)
        wrong = {line.split(":")[0] for line in run.stderr.splitlines()
                 if "clang-format-violations" in line}
        problems += [f"{path}: run ./dev format" for path in sorted(wrong)]
        if run.returncode:
            problems.append(run.stderr.strip())
    return problems, f"{len(paths)} files"


if __name__ == "__main__":
    os.chdir(tree.ROOT)
    tree.main("format", lambda: find_problems("--fix" in sys.argv[1:]))
