#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Names of unnamed namespaces are unique among the .cc files of a folder.

Unity builds compile several files of a folder as one. A name that two of them use for different
things does not compile there or, worse, calls the other file's overload without a word.
"""

import collections
import os
import re

import check_tidy
import tree

UNNAMED = re.compile(r"\bnamespace\s*\{")
TYPE = re.compile(r"\b(?:struct|class|enum(?:\s+class)?|union)\s+(\w+)")
HARMLESS = re.compile(r"namespace\b|static_assert\b|using\s+(?!\w+\s*=)")
ALIAS = re.compile(r"\busing\s+(\w+)\s*=")
FUNCTION = re.compile(r"(~?\w+|operator\s*\S+?)\s*\(")
VALUE = re.compile(r"(\w+)\s*(?:\[[^\]]*\]\s*)*(?:=|$)")
# Test cases are named by their suite; macros name nothing.
MACRO = re.compile(r"^\s*[A-Z][A-Z0-9_]+\s*\(")
# Each file of these is a program of its own.
PROGRAMS = ("tests/bench/", "tests/eval/", "docs/")


def name_of(head):
    """The name that a declaration makes, from its text up to the body or semicolon."""
    head = re.sub(r"\btemplate\s*<[^{}()]*?>(?=\s*\w)", " ", head).strip()
    if not re.match(r"\w", head) or MACRO.match(head) or HARMLESS.match(head):
        return None
    match = ALIAS.match(head)
    if match:
        # Two files may give one name to the same type.
        return " ".join(head.split())
    match = TYPE.match(head)
    if match:
        return match.group(1)
    before_value = head.split("=", 1)[0]
    match = FUNCTION.search(before_value)
    if match:
        # What a class declares is defined by its own name.
        is_member = before_value[:match.start()].endswith("::")
        return None if is_member or match.group(1).startswith("operator") else match.group(1)
    match = VALUE.search(before_value.strip())
    return match.group(1) if match and match.group(1) else None


def unnamed_names(text):
    """Names that the unnamed namespaces of a C++ source declare at their top."""
    code = check_tidy.blank_out(text)
    names = set()
    for opening in UNNAMED.finditer(code):
        at, depth, head = opening.end(), 1, opening.end()
        while depth and at < len(code):
            char = code[at]
            if char in "{}":
                if char == "{":
                    if depth == 1:
                        names.add(name_of(code[head:at]))
                    depth += 1
                else:
                    depth -= 1
                if depth == 1:
                    head = at + 1
            elif char == ";" and depth == 1:
                # After a body there is nothing, or the variable's end.
                names.add(name_of(code[head:at]))
                head = at + 1
            at += 1
    return names - {None}


def is_one_alias(uses):
    texts = {declared for _, declared in uses}
    return len(texts) == 1 and ALIAS.match(texts.pop()) is not None


def problems_of(texts):
    """`texts`: contents by path."""
    uses_in = collections.defaultdict(lambda: collections.defaultdict(list))
    for path, text in texts.items():
        folder, file = os.path.split(path)
        for declared in unnamed_names(text):
            alias = ALIAS.match(declared)
            uses_in[folder][alias.group(1) if alias else declared].append((file, declared))
    return [f"{folder}: '{name}' is in {', '.join(sorted(file for file, _ in uses))}; "
            "share one, or rename"
            for folder, uses_of in sorted(uses_in.items())
            for name, uses in sorted(uses_of.items())
            if len(uses) > 1 and not is_one_alias(uses)]


def find_problems():
    paths = [p for p in tree.files((".cc",)) if not p.startswith(PROGRAMS)]
    return problems_of({path: tree.read(path) for path in paths}), f"{len(paths)} files"


if __name__ == "__main__":
    tree.main("names", find_problems)
