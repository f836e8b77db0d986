#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Does docs/dependencies.md give a reason for each Debian package, and for no other?"""

import re

import tree


def problems_of(packages_text, document):
    listed = [line.strip() for line in packages_text.splitlines()
              if line.strip() and line[0] not in "#["]
    explained = re.findall(r"^\| `([^`]+)` \|", document, re.MULTILINE)
    problems = [f"docs/dependencies.md: no row for {name}" for name in listed
                if name not in explained]
    problems += [f"docs/dependencies.md: {name} is not in docker/packages.txt"
                 for name in explained if name not in listed]
    problems += [f"docker/packages.txt: {name} is listed twice"
                 for name in sorted({n for n in listed if listed.count(n) > 1})]
    return problems


def find_problems():
    packages = tree.read("docker/packages.txt")
    return problems_of(packages, tree.read("docs/dependencies.md")), "docker/packages.txt"


if __name__ == "__main__":
    tree.main("packages", find_problems)
