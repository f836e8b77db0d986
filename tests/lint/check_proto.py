#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Do the protos still speak to everything built from dsg_v1.descriptor.txt?

Compares protoc's descriptor of today with the golden one. An addition only asks for the golden
text to be renewed (--update); a break is refused by --update too, unless --allow-break is given.
"""

import os
import re
import subprocess
import sys
import tempfile

import tree

GOLDEN = "tests/lint/dsg_v1.descriptor.txt"
INCLUDE = "/usr/include"
TOKEN = re.compile(r'"((?:\\.|[^"\\])*)"|([{}])|([^\s{}":]+)')


def describe(with_comments=False):
    """describe_files of all protos of the tree, in alphabetical order."""
    paths = [p[len("proto/"):] for p in tree.files((".proto",)) if p.startswith("proto/")]
    return describe_files(os.path.join(tree.ROOT, "proto"), paths, with_comments)


def describe_files(folder, paths, with_comments):
    """The descriptor set of protos, as protobuf text; and what protoc warns of, such as imports
    that nothing uses."""
    with tempfile.TemporaryDirectory() as scratch:
        binary = os.path.join(scratch, "set.pb")
        options = ["--include_source_info"] if with_comments else []
        made = subprocess.run(
            ["protoc", "--proto_path=" + folder, *options, "--descriptor_set_out=" + binary,
             *paths], capture_output=True, text=True, check=False)
        if made.returncode != 0:
            raise SystemExit(made.stderr)
        with open(binary, "rb") as f:
            text = subprocess.run(
                ["protoc", f"--proto_path={INCLUDE}", "--decode=google.protobuf.FileDescriptorSet",
                 "google/protobuf/descriptor.proto"], stdin=f, capture_output=True, text=True,
                check=True).stdout
    # Names in JSON follow from the names of the fields and say nothing new.
    return (re.sub(r"^ *json_name: .*\n", "", text, flags=re.MULTILINE),
            made.stderr.splitlines())


def parse(text):
    """Protobuf text as nested dicts: field name -> list of values."""
    stack, key = [{}], None
    for string, brace, word in TOKEN.findall(text):
        if brace == "{":
            child = {}
            stack[-1].setdefault(key, []).append(child)
            stack.append(child)
            key = None
        elif brace == "}":
            stack.pop()
        elif key is None:
            key = word
            continue
        else:
            stack[-1].setdefault(key, []).append(string or word)
        key = None
    return stack[0]


def one(block, key, default=""):
    return block.get(key, [default])[0]


def reserved(block, number, name, is_enum):
    """Descriptors end the ranges of enums with the last number, those of messages one later."""
    after = 1 if is_enum else 0
    return name in block.get("reserved_name", []) and any(
        int(one(r, "start")) <= int(number) < int(one(r, "end")) + after
        for r in block.get("reserved_range", []))


def by_name(blocks):
    return {one(b, "name"): b for b in blocks}


def compare_fields(where, old, new):
    now = {one(f, "number"): f for f in new.get("field", [])}
    for field in old.get("field", []):
        number, name = one(field, "number"), one(field, "name")
        if number not in now:
            if not reserved(new, number, name, is_enum=False):
                yield f"{where}.{name} is gone; reserve its number {number} and its name"
            continue
        for key in ("name", "type", "type_name", "label", "proto3_optional"):
            before, after = one(field, key), one(now[number], key)
            if before != after:
                yield f"{where}.{name} = {number}: {key} was '{before}', is '{after}'"


def compare_enums(where, old, new):
    now = {one(v, "name"): one(v, "number", "0") for v in new.get("value", [])}
    for value in old.get("value", []):
        name, number = one(value, "name"), one(value, "number", "0")
        if name not in now:
            if not reserved(new, number, name, is_enum=True):
                yield f"{where}.{name} is gone; reserve its number {number} and its name"
        elif now[name] != number:
            yield f"{where}.{name}: number was {number}, is {now[name]}"


def compare_services(where, old, new):
    now = by_name(new.get("method", []))
    for method in old.get("method", []):
        name = one(method, "name")
        if name not in now:
            yield f"{where}.{name} is gone"
            continue
        for key in ("input_type", "output_type", "client_streaming", "server_streaming"):
            before, after = one(method, key), one(now[name], key)
            if before != after:
                yield f"{where}.{name}: {key} was '{before}', is '{after}'"


COMPARE = {"message_type": compare_fields, "nested_type": compare_fields,
           "enum_type": compare_enums, "service": compare_services}


def compare(where, old, new):
    """Yields what a program built from `old` would trip over in `new`."""
    for kind, compare_one in COMPARE.items():
        now = by_name(new.get(kind, []))
        for name, block in by_name(old.get(kind, [])).items():
            path = f"{where}.{name}"
            if name not in now:
                yield f"{path} is gone"
                continue
            yield from compare_one(path, block, now[name])
            if kind in ("message_type", "nested_type"):
                yield from compare(path, block, now[name])


def breaks(old_text, new_text):
    """Files do not matter, packages do: a message may move from file to file."""
    def by_package(text):
        packages = {}
        for file in parse(text).get("file", []):
            whole = packages.setdefault(one(file, "package"), {})
            for kind in COMPARE:
                whole.setdefault(kind, []).extend(file.get(kind, []))
        return packages
    new = by_package(new_text)
    return [problem for package, old in by_package(old_text).items()
            for problem in compare(package, old, new.get(package, {}))]


def find_problems(update, allow_break):
    new, _ = describe()
    golden = os.path.join(tree.ROOT, GOLDEN)
    old = tree.read(GOLDEN) if os.path.exists(golden) else ""
    problems = breaks(old, new)
    if update and (allow_break or not problems):
        with open(golden, "w", encoding="utf-8") as f:
            f.write(new)
        return [], GOLDEN + " renewed"
    if not problems and old != new:
        problems = [f"{GOLDEN} is out of date, though nothing breaks: run check_proto.py --update"]
    return problems, GOLDEN


if __name__ == "__main__":
    tree.main("proto", lambda: find_problems("--update" in sys.argv[1:],
                                             "--allow-break" in sys.argv[1:]))
