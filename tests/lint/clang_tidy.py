#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy on the .cc files that differ from a commit: clang_tidy.py BUILD-FOLDER [COMMIT].

Slow, so it is asked for by name and no part of the tests.
"""

import os
import subprocess
import sys

import tree


def git(*arguments):
    return subprocess.run(["git", *arguments], cwd=tree.ROOT, capture_output=True, text=True,
                          check=True).stdout.split("\n")


def changed_files(commit):
    names = git("diff", "--name-only", "--diff-filter=d", commit)
    names += git("ls-files", "--others", "--exclude-standard")
    known = set(tree.files((".cc",)))
    return sorted(known.intersection(names))


def main(build, commit="HEAD"):
    paths = changed_files(commit)
    problems = []
    for number, path in enumerate(paths, 1):
        print(f"clang-tidy: [{number}/{len(paths)}] {path}", flush=True)
        run = subprocess.run(["clang-tidy", "--quiet", "-p", build, path], cwd=tree.ROOT,
                             capture_output=True, text=True, check=False)
        if run.returncode:
            print(run.stdout, run.stderr, sep="\n")
            problems.append(path)
    return tree.report("clang-tidy", problems, f"{len(paths)} changed files")


if __name__ == "__main__":
    os.chdir(tree.ROOT)
    sys.exit(main(*sys.argv[1:]))
