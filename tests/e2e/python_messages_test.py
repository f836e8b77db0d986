#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Random messages of every type: the Python package and protobuf read and write the same JSON."""

import math
import os
import random
import subprocess
import sys
import tempfile
import unittest

import python_support
import support

python_support.run_with("google.protobuf")

from google.protobuf import descriptor_pool, json_format, message_factory  # noqa: E402

from dsgdb import json_codec, v1  # noqa: E402

FILES = ("query_service", "map_service", "ingest_service", "maintenance_service", "errors")
ROUNDS = 30
INTEGERS = (0, 1, -1, 2 ** 31 - 1, -2 ** 31, 2 ** 53, 2 ** 53 + 1, -2 ** 63, 2 ** 63 - 1)
NUMBERS = (0.0, 1.0, -1.5, 1e-300, 1e300, 0.1, math.inf, -math.inf)
TEXTS = ("", "a", "\u00e4\U0001f600", "\0\n\"\\", "</script>", "x" * 300)


def load_protos():
    """The descriptors of the protos, as protobuf's own Python has them."""
    with tempfile.TemporaryDirectory() as folder:
        proto = os.path.join(support.ROOT, "proto")
        names = [f"dsg/v1/{n}" for n in sorted(os.listdir(os.path.join(proto, "dsg", "v1")))
                 if n.endswith(".proto")]
        subprocess.run(["protoc", "-I", proto, f"--python_out={folder}", *names], check=True)
        sys.path.insert(0, folder)
        for name in FILES:
            __import__(f"dsg.v1.{name}_pb2")


def fill(message, rng, depth=0):
    """Sets about half of the fields, often to their limits."""
    for field in message.DESCRIPTOR.fields:
        if rng.random() < 0.5 or (depth > 3 and field.message_type is not None):
            continue
        if field.label == field.LABEL_REPEATED:
            fill_repeated(message, field, rng, depth)
        elif field.message_type is None:
            setattr(message, field.name, scalar(field, rng))
        elif field.message_type.full_name == "google.protobuf.FieldMask":
            message.update_mask.paths.extend(("name", "object.mesh_instance_id"))
        else:
            getattr(message, field.name).SetInParent()
            fill(getattr(message, field.name), rng, depth + 1)


def fill_repeated(message, field, rng, depth):
    target = getattr(message, field.name)
    for number in range(rng.randrange(3)):
        if field.message_type is None:
            target.append(scalar(field, rng))
        elif not field.message_type.GetOptions().map_entry:
            fill(target.add(), rng, depth + 1)
        elif field.message_type.fields_by_name["value"].message_type is None:
            target[f"k{number}"] = scalar(field.message_type.fields_by_name["value"], rng)
        else:
            fill(target[f"k{number}"], rng, depth + 1)


def scalar(field, rng):
    kind = field.cpp_type
    if kind == field.CPPTYPE_ENUM:
        return rng.choice(field.enum_type.values).number
    if kind == field.CPPTYPE_BOOL:
        return rng.random() < 0.5
    if kind == field.CPPTYPE_STRING:
        text = rng.choice(TEXTS)
        return text.encode() if field.type == field.TYPE_BYTES else text
    if kind in (field.CPPTYPE_DOUBLE, field.CPPTYPE_FLOAT):
        value = rng.choice(NUMBERS)
        # Numbers of which protobuf writes each digit, whatever the width.
        return value if kind == field.CPPTYPE_DOUBLE or abs(value) in (0, 1, 1.5, math.inf) else 0.5
    low, high = {field.CPPTYPE_INT32: (-2 ** 31, 2 ** 31 - 1), field.CPPTYPE_UINT32: (0, 2 ** 32),
                 field.CPPTYPE_INT64: (-2 ** 63, 2 ** 63 - 1)}.get(kind, (0, 2 ** 31))
    return rng.choice([number for number in INTEGERS if low <= number <= high])


class Messages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        load_protos()
        pool = descriptor_pool.Default()
        factory = message_factory.MessageFactory(pool)
        cls.types = {}
        for name, kind in vars(v1).items():
            if isinstance(kind, type) and hasattr(kind, "__dataclass_fields__") \
                    and kind.__module__ == "dsgdb.v1":
                cls.types[kind] = factory.GetPrototype(pool.FindMessageTypeByName(f"dsg.v1.{name}"))

    def test_each_message_of_the_protos_is_there(self):
        pool = descriptor_pool.Default()
        names = {name for file in ("graph", "read", "search", "space", "meetings", "scene", *FILES)
                 for name in pool.FindFileByName(f"dsg/v1/{file}.proto").message_types_by_name}
        self.assertEqual(names, {kind.__name__ for kind in self.types})

    def test_both_read_and_write_the_same(self):
        seed = int(os.environ.get("DSG_SEED", "7"))
        print(f"DSG_SEED={seed}")
        rng = random.Random(seed)
        for ours, theirs in self.types.items():
            for _ in range(ROUNDS):
                message = theirs()
                fill(message, rng)
                for sends_zeros in (True, False):
                    data = json_format.MessageToDict(message, preserving_proto_field_name=True,
                                                     including_default_value_fields=sends_zeros)
                    read = json_codec.from_json(ours, data)
                    written = json_format.ParseDict(json_codec.to_json(read), theirs())
                    self.assertEqual(message, written, data)
                    self.assertEqual(read, json_codec.from_json(ours, json_codec.to_json(read)))

    def test_what_is_newer_is_skipped(self):
        data = {"quality": "GUESSED", "at_ns": "1", "new_field": {"a": [1]}}
        read = json_codec.from_json(v1.LocateAgentResponse, data)
        self.assertEqual((v1.PoseQuality.POSE_QUALITY_UNSPECIFIED, 1), (read.quality, read.at_ns))

    def test_wrong_types_are_named(self):
        for message in (v1.LocateAgentRequest(agent=7), v1.LocateAgentRequest(at_ns="1"),
                        v1.LocateAgentRequest(at_ns=1.0), v1.LocateAgentRequest(at_ns=True),
                        v1.SearchNodesRequest(explain=1), v1.Vector3(x="1"),
                        v1.PredictAgentRequest(model="BEST"), v1.BatchGetNodesRequest(ids="O1"),
                        v1.LocateAgentRequest(read_at=7), v1.Asset(content="text"),
                        v1.Node(update_mask=json_codec.FieldMask(("map_T_node",)))):
            with self.assertRaises(TypeError) as caught:
                json_codec.to_json(message)
            self.assertRegex(str(caught.exception), r"^\w+\.\w+: ")


if __name__ == "__main__":
    unittest.main()
