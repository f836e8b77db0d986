#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""House rules that a compiler does not know: short functions, licence lines, no leftovers.

Looks at text, not at meaning: what needs a parser is left to clang-tidy.
"""

import ast
import re

import tree

MAX_FUNCTION_LINES = 70
MAX_LINE_CHARACTERS = 100
TEXT = (".h", ".cc", ".py", ".sh", ".sql", ".proto", ".cmake", "CMakeLists.txt", ".yaml", ".md",
        "Dockerfile", "/dev", "/run")
# Spelled in two pieces so that this file passes its own check.
LEFTOVER = re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X|HA" r"CK)\b")
PRIVATE_PATH = re.compile(r"(?<![\w.])/(ho" r"me|ro" r"ot|wo" r"rk|Us" r"ers)/\w")
# A test may draw its seed, as long as it prints it; everything else is given one.
DRAWN_SEED = re.compile(r"std::random_device")
UNSEEDED = re.compile(
    r"\bs?rand\(|std::(mt19937(_64)?|default_random_engine|minstd_rand0?)"
    r"\s+\w+(?<!_)\s*(;|\{\s*\})")
PRINTS = re.compile(r"std::c(out|err)\b|\bf?printf\(|\bputs\(")
# Mains and the command-line tool talk to people; so do tests.
MAY_PRINT = re.compile(r"^(docs/examples/|query/cli/|ingest/simulator/cli/|tests/)|"
                       r"(^|/|_)main\.cc$|"
                       r"schema/base/(log|check)\.|"
                       r"^proto/generate_api\.cc$|"
                       r"^schema/program/command_line\.|^ingest/program/(progress|run_report)")
SPDX = "SPDX-License-Identifier: Apache-2.0"
TRANSPARENT = re.compile(r"\b(namespace|class|struct|union|enum|extern)\b")


def blank_out(text):
    """C++ source with comments, strings and preprocessor lines blanked, line breaks kept."""
    pattern = re.compile(
        r'//[^\n]*|/\*.*?\*/|R"([^(\n]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"'
        r"|(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])+'"
        r"|^[ \t]*#(?:\\\n|[^\n])*", re.DOTALL | re.MULTILINE)
    return pattern.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def cpp_functions(text):
    """Yields (first line, line count) of each outermost function body with its head."""
    code = blank_out(text)
    inside, opaque, head_start, function = [], 0, 0, None
    for at, char in enumerate(code):
        if char == "{":
            head = code[head_start:at]
            transparent = not opaque and (
                TRANSPARENT.search(head) is not None and not re.search(r"\)\s*(const|noexcept|"
                r"override|final|->.*)*\s*$", head.strip()))
            if not transparent:
                if not opaque and "(" in head:
                    lead = len(head) - len(head.lstrip())
                    function = code.count("\n", 0, head_start + lead) + 1
                opaque += 1
            inside.append(transparent)
            head_start = at + 1
        elif char == "}" and inside:
            if not inside.pop():
                opaque -= 1
                if not opaque and function is not None:
                    yield function, code.count("\n", 0, at) + 2 - function
                    function = None
            head_start = at + 1
        elif char == ";" and not opaque:
            head_start = at + 1


def python_functions(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node.lineno, node.end_lineno - node.lineno + 1


def shell_functions(text):
    for match in re.finditer(r"^\w+\(\) \{\n(.*?)^\}", text, re.DOTALL | re.MULTILINE):
        yield text.count("\n", 0, match.start()) + 1, match.group().count("\n") + 1


def functions_of(path, text):
    if path.endswith(tree.CPP):
        return cpp_functions(text)
    if path.endswith(".py"):
        return python_functions(text)
    if text.startswith("#!/usr/bin/env bash"):
        return shell_functions(text)
    return ()


def line_problems(path, number, line):
    if LEFTOVER.search(line):
        yield f"{path}:{number}: unfinished work is an issue, not a comment"
    if PRIVATE_PATH.search(line):
        yield f"{path}:{number}: a path of one machine"
    if path.endswith(".md"):
        return
    if len(line) > MAX_LINE_CHARACTERS:
        yield f"{path}:{number}: {len(line)} characters, at most {MAX_LINE_CHARACTERS}"
    if "\t" in line and not line.startswith("\t"):
        yield f"{path}:{number}: a tab"
    if path.endswith(tree.CPP):
        code = re.sub(r'"(\\.|[^"\\])*"|//.*', '""', line)
        drawn = DRAWN_SEED.search(code) and not path.startswith("tests/")
        if drawn or UNSEEDED.search(code):
            yield f"{path}:{number}: randomness without a seed; pass the generator in"
        if PRINTS.search(code) and not MAY_PRINT.search(path):
            yield f"{path}:{number}: a library must not print; use schema/base/log.h"


def problems_of(path, text):
    found = []
    lines = text.split("\n")
    if path.endswith(tree.CPP + (".py", ".sh", ".sql")) or lines[0].startswith("#!"):
        if not any(SPDX in line for line in lines[:2]):
            found.append(f"{path}:1: begin with the line '{SPDX}'")
    for number, line in enumerate(lines, 1):
        found += line_problems(path, number, line)
    if text and not text.endswith("\n"):
        found.append(f"{path}:{len(lines)}: no line break at the end")
    for first, count in functions_of(path, text):
        if count >= MAX_FUNCTION_LINES:
            found.append(f"{path}:{first}: a function of {count} lines, "
                         f"must be below {MAX_FUNCTION_LINES}")
    return found


def find_problems():
    paths = [p for p in tree.files() if ("/" + p).endswith(TEXT)]
    problems = [p for path in paths for p in problems_of(path, tree.read(path))]
    return problems, f"{len(paths)} files"


if __name__ == "__main__":
    tree.main("tidy", find_problems)
