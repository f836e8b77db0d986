#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Is each type of a namespace defined once? Two with one name in one program are one to the linker.

Unnamed namespaces are left out: what they hold is known to one file only. Tests may repeat names
that other tests have, as long as no header of theirs does.
"""

import re

import tree

UNNAMED = re.compile(r"^namespace \{\n.*?^\}  // namespace\n", re.DOTALL | re.MULTILINE)
NAMESPACE = re.compile(r"^namespace ([\w:]+) \{", re.MULTILINE)
TYPE = re.compile(r"^(?:struct|class|enum class) (\w+)(?: final)?(?: :[^{;]*)? \{", re.MULTILINE)


def types_of(text):
    """(namespace, name) of each type that other files could see."""
    text = UNNAMED.sub("", text)
    found = set()
    for match in TYPE.finditer(text):
        spaces = NAMESPACE.findall(text, 0, match.start())
        if spaces:
            found.add((spaces[-1], match.group(1)))
    return found


def problems_of(texts):
    """`texts`: path -> text."""
    first, problems = {}, []
    for path in sorted(texts):
        for space, name in sorted(types_of(texts[path])):
            other = first.setdefault((space, name), path)
            if other != path:
                problems.append(f"{path}: {space}::{name} is also defined in {other}")
    return problems


def find_problems():
    paths = [p for p in tree.files(tree.CPP) if p.endswith(".h") or not p.startswith("tests/")]
    return problems_of({p: tree.read(p) for p in paths}), f"{len(paths)} files"


if __name__ == "__main__":
    tree.main("types", find_problems)
