#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes dsgdb/v1.py from proto/dsg/v1: a frozen dataclass for each message, a class for each enum,
and one typed method for each RPC, with the comments of the protos.

    generate_api.py                 renews dsgdb/v1.py
    generate_api.py --check [FILE]  exits with 1 if it, or FILE, is not what the protos say

Needs protoc and python3-protobuf. The result is committed, so that who installs or reads the
package needs neither; tests/lint/check_python.py checks that it is current.
"""

import keyword
import os
import re
import subprocess
import sys
import tempfile
import textwrap

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
PROTO = os.path.join(ROOT, "proto")
TARGET = os.path.join(HERE, "dsgdb", "v1.py")
WIDTH = 100

HEAD = '''# SPDX-License-Identifier: Apache-2.0
# Written by generate_api.py from proto/dsg/v1; do not edit.
"""The messages of dsg.v1 as frozen dataclasses, and `Api`, one method for each RPC.

Frames are right-handed with z up; units are metres, radians, and nanoseconds on the map's clock;
quaternions are Hamilton, x y z w. Intervals are half-open, [from_ns, to_ns). A field that is None
is unset; `from` is written `from_`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Iterator, Mapping, Optional

from dsgdb.connect import Caller
from dsgdb.json_codec import FieldMask, ProtoEnum
from dsgdb.mixins import Located, Triple

# The version of the project that this file was written for.
VERSION = "{version}"
'''

# What some messages can do besides holding their fields; see dsgdb/mixins.py.
MIXINS = {"LocateAgentResponse": "Located", "Vector3": "Triple"}


def load_files():
    """The descriptors of all proto files with comments and our own options, by name."""
    names = sorted(n for n in os.listdir(os.path.join(PROTO, "dsg", "v1")) if n.endswith(".proto"))
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["protoc", "-I", PROTO, f"--python_out={folder}", "dsg/v1/options.proto"],
                       check=True)
        binary = os.path.join(folder, "set.pb")
        subprocess.run(["protoc", "-I", PROTO, "--include_source_info",
                        f"--descriptor_set_out={binary}", *(f"dsg/v1/{n}" for n in names)],
                       check=True)
        sys.path.insert(0, folder)
        sys.dont_write_bytecode = True
        # Known before the descriptors are read, so that the options of methods are understood.
        from dsg.v1 import options_pb2
        from google.protobuf import descriptor_pb2
        files = descriptor_pb2.FileDescriptorSet()
        with open(binary, "rb") as f:
            files.ParseFromString(f.read())
    return list(files.file), options_pb2


def project_version():
    with open(os.path.join(ROOT, "CMakeLists.txt"), encoding="utf-8") as f:
        return re.search(r"^project\(dsg VERSION ([\d.]+)", f.read(), re.MULTILINE).group(1)


def comments_of(file):
    """Comments by the path of what they stand at."""
    return {tuple(location.path): (location.leading_comments or location.trailing_comments).strip()
            for location in file.source_code_info.location}


def wrapped(text, indent, first="", later=""):
    """Lines of a comment, filled anew; what its errors are begins a line."""
    parts = [""]
    for line in text.split("\n"):
        if line.strip().startswith("Errors:"):
            parts.append("")
        parts[-1] += line.strip() + " "
    lines = []
    for part in parts:
        lines += textwrap.wrap(part, WIDTH - len(indent), initial_indent=first,
                               subsequent_indent=later, break_long_words=False,
                               break_on_hyphens=False)
        first = later
    return [indent + line for line in lines]


def docstring(text, indent):
    # The quotes take the first three columns.
    lines = wrapped(text.replace("\\", "\\\\"), indent, first="\"\"\"")
    if len(lines) == 1 and len(lines[0]) + 3 <= WIDTH:
        return [lines[0] + '"""']
    return lines and lines + [indent + '"""']


def short(type_name):
    return type_name.rsplit(".", 1)[1]


def snake(name):
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


class Messages:
    """Turns descriptors of messages into dataclasses."""

    def __init__(self, files):
        self.enums = {e.name: e for file in files for e in file.enum_type}

    def scalar(self, field):
        """The Python type of one value, and how its default is written."""
        kind = field.Type.Name(field.type)
        if kind == "TYPE_MESSAGE":
            return short(field.type_name), None
        if kind == "TYPE_ENUM":
            name = short(field.type_name)
            return name, f"{name}.{self.enums[name].value[0].name}"
        return {"TYPE_DOUBLE": ("float", "0.0"), "TYPE_FLOAT": ("float", "0.0"),
                "TYPE_BOOL": ("bool", "False"), "TYPE_STRING": ("str", '""'),
                "TYPE_BYTES": ("bytes", 'b""')}.get(kind, ("int", "0"))

    def declaration(self, message, field):
        name = field.name + ("_" if keyword.iskeyword(field.name) else "")
        kind, default = self.scalar(field)
        if field.label == field.LABEL_REPEATED:
            entry = next((n for n in message.nested_type
                          if n.options.map_entry and n.name == kind), None)
            if entry is None:
                return f"{name}: tuple[{kind}, ...] = ()"
            value, _ = self.scalar(entry.field[1])
            return f"{name}: Mapping[str, {value}] = field(default_factory=dict)"
        if default is None or field.HasField("oneof_index"):
            return f"{name}: Optional[{kind}] = None"
        return f"{name}: {kind} = {default}"

    def dataclass(self, message, comment_of):
        mixin = MIXINS.get(message.name)
        lines = ["", "", "@dataclass(frozen=True)",
                 f"class {message.name}{f'({mixin})' if mixin else ''}:"]
        text = comment_of(())
        lines += docstring(text, "    ")
        if text and message.field:
            lines.append("")
        for at, one in enumerate(message.field):
            lines += wrapped(comment_of((2, at)), "    ", "# ", "# ")
            lines.append("    " + self.declaration(message, one))
        if not text and not message.field:
            lines.append("    pass")
        return lines


def enum_class(enum, comment_of):
    lines = ["", "", f"class {enum.name}(ProtoEnum):"]
    text = comment_of(())
    lines += docstring(text, "    ") + ([""] if text else [])
    for at, value in enumerate(enum.value):
        lines += wrapped(comment_of((2, at)), "    ", "# ", "# ")
        lines.append(f'    {value.name} = "{value.name}"')
    return lines


def method(service, one, text, options):
    request, reply = short(one.input_type), short(one.output_type)
    result = f"Iterator[{reply}]" if one.server_streaming else reply
    reads = one.options.idempotency_level == one.options.NO_SIDE_EFFECTS
    call = [f'"dsg.v1.{service.name}/{one.name}"', "request", reply, "timeout", f"reads={reads}"]
    if one.server_streaming:
        lifetime = options.Lifetime.Name(one.options.Extensions[options.lifetime])
        lifetime = lifetime.replace("LIFETIME_", "").replace("UNSPECIFIED", "ANSWER").lower()
        call.append(f'lifetime="{lifetime}"')
    lines = ["", f"    def {snake(one.name)}(self, request: {request},",
             f"{' ' * (9 + len(snake(one.name)))}timeout: Optional[float] = None) -> {result}:"]
    lines += docstring(text, "        ")
    opening = f"        return self._{'stream' if one.server_streaming else 'unary'}("
    return lines + textwrap.wrap(", ".join(call) + ")", WIDTH, initial_indent=opening,
                                 subsequent_indent=" " * len(opening))


API_HEAD = '''

class Api(Caller):
    """Every RPC of the server. A timeout is the deadline of the call, seconds; None = the default
    of the connection. Errors are raised as `dsgdb.Error`; a stream raises them where it ends.
    """'''


def generate():
    files, options = load_files()
    messages = Messages(files)
    lines = HEAD.format(version=project_version()).rstrip("\n").split("\n")
    api = API_HEAD.split("\n")
    for file in files:
        comments = comments_of(file)

        def lookup(*path):
            return lambda rest, path=path: comments.get(path + rest, "")

        if file.name.endswith("/options.proto"):
            continue
        for at, enum in enumerate(file.enum_type):
            lines += enum_class(enum, lookup(5, at))
        for at, message in enumerate(file.message_type):
            lines += messages.dataclass(message, lookup(4, at))
        for at, service in enumerate(file.service):
            for number, one in enumerate(service.method):
                api += method(service, one, comments.get((6, at, 2, number), ""), options)
    return "\n".join(lines + api) + "\n"


def main(arguments):
    if arguments and (arguments[0] != "--check" or len(arguments) > 2):
        print(__doc__, file=sys.stderr)
        return 2
    text = generate()
    if arguments:
        with open((arguments + [TARGET])[1], encoding="utf-8") as f:
            return 0 if f.read() == text else 1
    with open(TARGET, "w", encoding="utf-8") as f:
        f.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
