#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Do the protos follow the rules that public linters of protos share, and does everything in them
say what it means?

Names and shapes are checked in dsg.v1. Comments are checked everywhere: a service, an RPC, a
message, a field, an enum and a value of one has its own, unless a convention tells its meaning.
The conventions of fields are the list in the head comment of read.proto, and nowhere else.
"""

import fnmatch
import re

import check_proto
import tree
from check_proto import one

OURS = "dsg.v1"
CONVENTIONS = "dsg/v1/read.proto"
LOWER_SNAKE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*$")
UPPER_SNAKE = re.compile(r"[A-Z][A-Z0-9]*(_[A-Z0-9]+)*$")
PASCAL = re.compile(r"([A-Z][a-z0-9]*)+$")

# The names below break a rule and stay, since programs read them; nothing is added to these lists.

# Transforms, after the rule of docs/conventions.md for names of frames.
FRAME_FIELDS = {"Node.map_T_node", "ObjectComponent.map_T_model"}
# The values' names stand in `dsg --json` and in the JSON of the HTTP port.
BARE_VALUES = {
    "ChangeType": {"ADDED", "REMOVED", "CHANGED"},
    "Comparison": {"EQUAL", "NOT_EQUAL", "LESS", "LESS_OR_EQUAL", "GREATER", "GREATER_OR_EQUAL",
                   "EXISTS"},
    "InteractionType": {"PICKED", "PLACED"},
    "PlanMode": {"HIERARCHICAL", "FLAT"},
    "PoseQuality": {"EXACT", "INTERPOLATED", "IN_GAP"},
    "PredictionModel": {"GOALS", "CONSTANT_VELOCITY", "WEIGHTED_VELOCITY"},
    "PruneStrength": {"RETIRE", "ERASE"},
}
# A reason's name is the `reason` of google.rpc.ErrorInfo, whose domain makes it unique: new ones
# have no prefix either.
BARE_ENUMS = {"Reason"}
# Lists with one reply and no pages, and why.
LISTS_WITHOUT_PAGES = {
    "ListMaps": "the maps of one store, a few",
    "ListNearestNodes": "at most k, which the request says",
    "ListRevisions": "before_revision says where the next page begins",
    "ListTags": "at most 10,000 of a map, with 2 MiB of notes",
}

# Field numbers of descriptor.proto, which locate a comment: FileDescriptorProto, DescriptorProto,
# EnumDescriptorProto, ServiceDescriptorProto.
MESSAGE, ENUM, SERVICE, EXTENSION, PACKAGE = "4", "5", "6", "7", "2"
FIELD, NESTED, NESTED_ENUM, VALUE, METHOD = "2", "3", "4", "2", "2"


def camel(name):
    return "".join(part.capitalize() for part in name.split("_"))


def words(name):
    """GraphDelta -> ["graph", "delta"]"""
    return [w.lower() for w in re.findall(r"[A-Z][a-z0-9]*", name)]


def singular(word):
    if word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-1] if word.endswith("s") else word


def named_after_type(field):
    """`edges` of type Edge, `poses` of type TimedPose, `object` of type ObjectComponent."""
    if not one(field, "type_name"):
        return False
    type_words = words(one(field, "type_name").rpartition(".")[2])
    name = one(field, "name").split("_")
    if one(field, "label") == "LABEL_REPEATED":
        name = name[:-1] + [singular(name[-1])]
    return name in (type_words[-len(name):], type_words[:len(name)])


def conventions_of(comment):
    """The names, or patterns of names, that the list in a head comment explains."""
    found = []
    for line in comment.splitlines():
        if line.strip().startswith("- `"):
            found += re.findall(r"`([^`]+)`", line.partition(":")[0])
    return found


class File:
    """A descriptor with its comments, and what is wrong with it."""

    def __init__(self, descriptor, conventions, asked_by):
        self.descriptor = descriptor
        self.name = one(descriptor, "name")
        self.package = one(descriptor, "package")
        self.conventions = conventions
        self.asked_by = asked_by
        self.comments = comments_of(descriptor)
        self.problems = []

    def say(self, what, problem):
        self.problems.append(f"proto/{self.name}: {what}: {problem}")

    def want(self, what, matches, rule):
        if not matches:
            self.say(what, rule)

    def want_comment(self, what, *path):
        self.want(what, self.comments.get(path), "has no comment")

    def check(self):
        if self.package == OURS:
            self.check_file()
        self.want_comment("the package", PACKAGE)
        for i, service in enumerate(self.descriptor.get("service", [])):
            self.check_service(service, (SERVICE, str(i)))
        for i, message in enumerate(self.descriptor.get("message_type", [])):
            self.check_message(message, "", (MESSAGE, str(i)))
        for i, enum in enumerate(self.descriptor.get("enum_type", [])):
            self.check_enum(enum, (ENUM, str(i)))
        for i, option in enumerate(self.descriptor.get("extension", [])):
            self.want_comment(one(option, "name"), EXTENSION, str(i))
        return self.problems

    def check_file(self):
        folder, _, file = self.name.rpartition("/")
        self.want("the file", LOWER_SNAKE.match(file.removesuffix(".proto")),
                  "its name is not lower_snake_case.proto")
        self.want("the file", folder == self.package.replace(".", "/"),
                  f"it is not in the folder of its package {self.package}")
        self.want("the file", one(self.descriptor, "syntax") == "proto3", "it is not proto3")

    def check_service(self, service, path):
        name = one(service, "name")
        self.want(name, PASCAL.match(name) and name.endswith("Service"),
                  "a service is named PascalCase and ends in Service")
        self.want_comment(name, *path)
        for i, method in enumerate(service.get("method", [])):
            self.check_method(method, path + (METHOD, str(i)))

    def check_method(self, method, path):
        name = one(method, "name")
        self.want(name, PASCAL.match(name), "an RPC is named in PascalCase")
        self.want_comment(name, *path)
        for kind, suffix in (("input_type", "Request"), ("output_type", "Response")):
            self.want(name, one(method, kind) == f".{self.package}.{name}{suffix}",
                      f"it needs a {name}{suffix} of its own")

    def check_message(self, message, within, path):
        if one(one(message, "options", {}), "map_entry") == "true":
            return
        name = within + one(message, "name")
        self.want(name, PASCAL.match(one(message, "name")), "a message is named in PascalCase")
        # What they are for is said by the comment of their RPC.
        if name not in self.asked_by:
            self.want_comment(name, *path)
        for i, field in enumerate(message.get("field", [])):
            self.check_field(field, name, path + (FIELD, str(i)))
        for i, nested in enumerate(message.get("nested_type", [])):
            self.check_message(nested, name + ".", path + (NESTED, str(i)))
        for i, enum in enumerate(message.get("enum_type", [])):
            self.check_enum(enum, path + (NESTED_ENUM, str(i)))

    def check_field(self, field, message, path):
        name = f"{message}.{one(field, 'name')}"
        self.want(name, LOWER_SNAKE.match(one(field, "name")) or name in FRAME_FIELDS,
                  "a field is named in lower_snake_case")
        is_known = named_after_type(field) or any(
            fnmatch.fnmatchcase(one(field, "name"), c) for c in self.conventions)
        if not is_known:
            self.want(name, self.comments.get(path),
                      f"has no comment, and no convention in the head of proto/{CONVENTIONS} "
                      "says what it means; write unit, frame, default and range")

    def check_enum(self, enum, path):
        name = one(enum, "name")
        prefix = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).upper() + "_"
        self.want(name, PASCAL.match(name), "an enum is named in PascalCase")
        self.want_comment(name, *path)
        self.want(name, "allow_alias" not in one(enum, "options", {}),
                  "two names of one value confuse readers")
        for i, value in enumerate(enum.get("value", [])):
            value_name = one(value, "name")
            self.want(value_name, UPPER_SNAKE.match(value_name), "a value is UPPER_SNAKE_CASE")
            if i == 0:
                self.want(value_name, value_name == prefix + "UNSPECIFIED"
                          and one(value, "number", "0") == "0",
                          f"the first value is {prefix}UNSPECIFIED = 0")
                continue
            is_bare = name in BARE_ENUMS or value_name in BARE_VALUES.get(name, ())
            self.want(value_name, is_bare or value_name.startswith(prefix),
                      f"it must begin with {prefix}")
            self.want_comment(value_name, *path, VALUE, str(i))


def comments_of(descriptor):
    """The comments by path; those before and behind a declaration count alike."""
    found = {}
    for place in one(descriptor, "source_code_info", {}).get("location", []):
        text = one(place, "leading_comments") + one(place, "trailing_comments")
        if text.strip():
            found[tuple(place["path"])] = text.replace(r"\n", "\n")
    return found


def paging_problems(files):
    """An RPC that lists something in one reply gives it in pages."""
    messages = check_proto.by_name(m for file in files for m in file.get("message_type", []))
    for method in methods_of(files):
        name = one(method, "name")
        is_stream = one(method, "server_streaming") == "true"
        if not name.startswith("List") or is_stream or name in LISTS_WITHOUT_PAGES:
            continue
        for message, wanted in (("Request", ("page_size", "page_token")),
                                ("Response", ("next_page_token",))):
            fields = [one(f, "name") for f in messages.get(name + message, {}).get("field", [])]
            for field in wanted:
                if field not in fields:
                    yield f"{name}: {name}{message} has no {field}"


def methods_of(files):
    return [m for file in files for s in file.get("service", []) for m in s.get("method", [])]


def problems_of(text, conventions=None):
    """What is wrong with the files of a descriptor set with comments, as protobuf text."""
    files = check_proto.parse(text).get("file", [])
    for file in files:
        if conventions is None and one(file, "name") == CONVENTIONS:
            conventions = conventions_of(comments_of(file).get((PACKAGE,), ""))
    asked_by = {one(method, "name") + suffix for method in methods_of(files)
                for suffix in ("Request", "Response")}
    problems = [p for file in files for p in File(file, conventions or [], asked_by).check()]
    return problems + list(paging_problems(files))


def find_problems():
    text, warnings = check_proto.describe(with_comments=True)
    count = text.count("\nfile {") + text.startswith("file {")
    return warnings + problems_of(text), f"{count} files"


if __name__ == "__main__":
    tree.main("proto_style", find_problems)
