#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Each lint check finds what it is there to find, and lets good code pass."""

import os
import tempfile
import unittest

import check_docs
import check_layering
import check_names
import check_packages
import check_proto
import check_proto_style
import check_python
import check_tidy
import check_types
import tree

LICENCE = "// SPDX-License-Identifier: Apache-2.0\n"


class Layering(unittest.TestCase):
    def problems(self, path, include):
        return check_layering.problems_of(path, f"#include {include}\n")

    def test_allows_downward_includes(self):
        self.assertEqual([], self.problems("schema/store/a.cc", '"schema/model/node.h"'))
        self.assertEqual([], self.problems("server/a.cc", '"query/service/service_core.h"'))
        self.assertEqual([], self.problems("schema/store/sqlite/a.cc", "<sqlite3.h>"))
        self.assertEqual([], self.problems("schema/codec/a.cc", '"dsg/v1/graph.pb.h"'))

    def test_refuses_upward_and_sideways_includes(self):
        self.assertEqual(1, len(self.problems("schema/model/a.h", '"schema/store/snapshot.h"')))
        self.assertEqual(1, len(self.problems("schema/store/a.h", '"schema/store/sqlite/db.h"')))
        self.assertEqual(1, len(self.problems("ingest/log/a.cc", '"ingest/simulator/w.h"')))
        self.assertEqual(1, len(self.problems("query/engine/a.cc", '"server/server.h"')))
        self.assertEqual(1, len(self.problems("query/engine/a.cc",
                                              '"query/maintenance/archives.h"')))
        self.assertEqual(1, len(self.problems("ingest/log/a.cc", '"query/api/api.h"')))

    def test_keeps_third_party_headers_in_their_folders(self):
        self.assertEqual(1, len(self.problems("query/engine/a.cc", "<sqlite3.h>")))
        self.assertEqual(1, len(self.problems("schema/codec/a.cc", "<grpcpp/grpcpp.h>")))
        self.assertEqual(1, len(self.problems("schema/codec/a.h", '"dsg/v1/graph.pb.h"')))
        self.assertEqual(1, len(self.problems("server/a.cc", "<opencv2/core.hpp>")))

    def test_keeps_internal_headers_in_their_folders(self):
        self.assertEqual([], self.problems("schema/codec/a_internal.h", '"dsg/v1/graph.pb.h"'))
        self.assertEqual([], self.problems("schema/codec/a.cc", '"schema/codec/a_internal.h"'))
        self.assertEqual(1, len(self.problems("schema/codec/a.h",
                                              '"schema/codec/a_internal.h"')))
        self.assertEqual(1, len(self.problems("schema/store/a.cc",
                                              '"schema/codec/a_internal.h"')))

    def test_asks_for_whole_paths(self):
        self.assertEqual(1, len(self.problems("schema/model/a.cc", '"node.h"')))


class Tidy(unittest.TestCase):
    def problems(self, path, text):
        return check_tidy.problems_of(path, text)

    def test_lets_plain_code_pass(self):
        text = LICENCE + "namespace dsg {\nint Twice(int x) {\n  return 2 * x;\n}\n}\n"
        self.assertEqual([], self.problems("schema/model/a.cc", text))

    def test_measures_functions_and_not_namespaces_or_classes(self):
        body = "  Call(\"}\");\n" * 80
        namespace = LICENCE + "namespace dsg {\n" + "int a();\n" * 80 + "}\n"
        self.assertEqual([], self.problems("schema/a.cc", namespace))
        a_class = LICENCE + "class A {\n public:\n" + "  int a();\n" * 80 + "};\n"
        self.assertEqual([], self.problems("schema/a.cc", a_class))
        function = LICENCE + "namespace dsg {\nint A::F(struct S* s) const {\n" + body + "}\n}\n"
        self.assertEqual(["schema/a.cc:3: a function of 82 lines, must be below 70"],
                         self.problems("schema/a.cc", function))
        method = LICENCE + "class A {\n  void F() override {\n" + body + "  }\n};\n"
        self.assertEqual(1, len(self.problems("schema/a.cc", method)))
        shell = "#!/usr/bin/env bash\n# SPDX-License-Identifier: Apache-2.0\nf() {\n" + \
            "  true\n" * 80 + "}\n"
        self.assertEqual(1, len(self.problems("dev", shell)))

    def test_names_each_offence(self):
        for line in ("// TO" "DO: later", "int a;  // see /ho" "me/someone/x",
                     "std::random_device device;", "std::mt19937_64 generator;",
                     "std::cout << 1;", "int a;" + " " * 100 + "int b;"):
            with self.subTest(line=line):
                self.assertEqual(1, len(self.problems("schema/a.cc", LICENCE + line + "\n")))

    def test_wants_the_licence_line(self):
        self.assertEqual(1, len(self.problems("schema/a.cc", "int a;\n")))


PROTO = """file {{ name: "a.proto" package: "dsg.v1"
  message_type {{ name: "M" {fields} {extra} }}
  enum_type {{ name: "E" value {{ name: "ZERO" number: 0 }} {values} }} }}"""
FIELD = 'field {{ name: "{}" number: {} label: LABEL_OPTIONAL type: {} }}'


class Proto(unittest.TestCase):
    def breaks(self, new_fields, extra="", values='value { name: "ONE" number: 1 }'):
        old = PROTO.format(fields=FIELD.format("x", 1, "TYPE_DOUBLE"), extra="",
                           values='value { name: "ONE" number: 1 }')
        return check_proto.breaks(old, PROTO.format(fields=new_fields, extra=extra, values=values))

    def test_additions_break_nothing(self):
        self.assertEqual([], self.breaks(FIELD.format("x", 1, "TYPE_DOUBLE") +
                                         FIELD.format("y", 2, "TYPE_DOUBLE")))

    def test_changed_types_numbers_and_names_break(self):
        self.assertEqual(1, len(self.breaks(FIELD.format("x", 1, "TYPE_FLOAT"))))
        self.assertEqual(1, len(self.breaks(FIELD.format("x", 2, "TYPE_DOUBLE"))))
        self.assertEqual(1, len(self.breaks(FIELD.format("z", 1, "TYPE_DOUBLE"))))

    def test_removal_needs_number_and_name_reserved(self):
        reserved = 'reserved_range { start: 1 end: 2 } reserved_name: "x"'
        self.assertEqual(1, len(self.breaks("")))
        self.assertEqual([], self.breaks("", extra=reserved))

    def test_enum_values_keep_their_numbers(self):
        same = FIELD.format("x", 1, "TYPE_DOUBLE")
        self.assertEqual(1, len(self.breaks(same, values='value { name: "ONE" number: 2 }')))
        self.assertEqual(1, len(self.breaks(same, values="")))


STYLE = """syntax = "proto3";
// A package.
// - `map`, `*_count`: told here.
package dsg.v1;
// A service.
service ThingService {{
  // A list.
  rpc ListThings(ListThingsRequest) returns (ListThingsResponse);
}}
message ListThingsRequest {{ string map = 1; int32 page_size = 2; string page_token = 3; }}
message ListThingsResponse {{ repeated Thing things = 1; string next_page_token = 2; }}
// A thing.
message Thing {{
  int64 part_count = 1;
  // Metres.
  double length_m = 2;
  Colour colour = 3;
  {fields}
}}
// A colour.
enum Colour {{
  COLOUR_UNSPECIFIED = 0;
  // Red.
  COLOUR_RED = 1;
  {values}
}}
{more}
"""


class ProtoStyle(unittest.TestCase):
    def problems(self, fields="", values="", more="", change=("", "")):
        text = STYLE.format(fields=fields, values=values, more=more).replace(*change)
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "dsg/v1"))
            with open(os.path.join(folder, "dsg/v1/thing.proto"), "w", encoding="utf-8") as f:
                f.write(text)
            described, _ = check_proto.describe_files(folder, ["dsg/v1/thing.proto"], True)
        return check_proto_style.problems_of(described, ["map", "page_*", "next_page_token",
                                                         "*_count"])

    def test_lets_good_protos_pass(self):
        self.assertEqual([], self.problems())

    def test_reads_the_conventions_from_a_comment(self):
        self.assertEqual(["map", "*_count"], check_proto_style.conventions_of(
            " A package.\n - `map`, `*_count`: as in `other`.\n   `not` this one\n"))

    def test_wants_comments(self):
        for change in (("  // Metres.\n", ""), ("// A thing.\n", ""), ("  // Red.\n", ""),
                       ("// A colour.\n", ""), ("// A service.\n", ""), ("  // A list.\n", ""),
                       ("string map = 1", "string chart = 1")):
            with self.subTest(change=change):
                self.assertEqual(1, len(self.problems(change=change)))

    def test_wants_the_names_of_public_linters(self):
        for change in (("ThingService", "Things"), ("ListThings(", "list_things("),
                       ("length_m", "lengthM"), ("COLOUR_RED", "RED"), ("COLOUR_RED", "COLOUR_Red"),
                       ("COLOUR_UNSPECIFIED", "COLOUR_NONE")):
            with self.subTest(change=change):
                self.assertLessEqual(1, len(self.problems(change=change)))
        self.assertEqual(1, len(self.problems(more="// A thing.\nmessage small_thing {}")))

    def test_keeps_the_list_of_bare_values_closed(self):
        change = ("Colour", "PoseQuality")
        bare = "// A value.\n  {} = 2;"

        def of(value):
            found = self.problems(values=bare.format(value), change=change)
            return [p for p in found if value in p]

        self.assertEqual([], of("EXACT"))
        self.assertEqual(1, len(of("GUESSED")))

    def test_wants_messages_of_their_own_and_pages(self):
        self.assertEqual(1, len(self.problems(change=(" string page_token = 3;", ""))))
        second = ("// A call.\nrpc GetThing(ListThingsRequest) returns (GetThingResponse);\n}\n"
                  "message GetThingResponse {}\nmessage ListThingsRequest")
        self.assertEqual(1, len(self.problems(change=("}\nmessage ListThingsRequest", second))))


class Python(unittest.TestCase):
    def test_a_message_that_the_protos_do_not_have_is_found(self):
        text = tree.read(check_python.GENERATED)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "v1.py")
            for changed, problems in ((text, 0), (text.replace("at_ns: int", "at_s: int"), 1)):
                with open(path, "w", encoding="utf-8") as f:
                    f.write(changed)
                self.assertEqual(problems, len(check_python.generated_problems(path)))

    def test_a_wrong_type_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "module.py")
            for text, problems in (("x: int = 1\n", 0), ("x: int = ''\n", 1)):
                with open(path, "w", encoding="utf-8") as f:
                    f.write(text)
                self.assertEqual(problems, len(check_python.type_problems(path)))


class Types(unittest.TestCase):
    def test_one_name_means_one_type(self):
        type_in = "namespace dsg::query {{\nstruct {} {{\n}};\n}}  // namespace dsg::query\n".format
        hidden = "namespace dsg::query {\nnamespace {\nstruct Way {\n};\n}  // namespace\n}\n"
        self.assertEqual([], check_types.problems_of(
            {"a.h": type_in("Way"), "b.h": type_in("Path"), "c.cc": hidden}))
        self.assertEqual(1, len(check_types.problems_of(
            {"a.h": type_in("Way"), "b.h": type_in("Way")})))


class Names(unittest.TestCase):
    def test_unnamed_names_differ_within_a_folder(self):
        file = "namespace dsg {{\nnamespace {{\n{}\n}}  // namespace\n}}\n".format
        one = file("constexpr int kCount = 3;\nint Add(int a) {\n  return a;\n}")
        self.assertEqual([], check_names.problems_of(
            {"a/one.cc": one, "b/one.cc": one, "a/two.cc": file("double Sum(double a) {\n}")}))
        self.assertEqual(2, len(check_names.problems_of({"a/one.cc": one, "a/two.cc": one})))
        self.assertEqual(1, len(check_names.problems_of(
            {"a/one.cc": one, "a/two.cc": file("double Add(double a) {\n}")})))

    def test_one_alias_of_one_type_may_repeat(self):
        file = "namespace {{\nusing Json = {};\n}}\n".format
        self.assertEqual([], check_names.problems_of({"a.cc": file("A"), "b.cc": file("A")}))
        self.assertEqual(1, len(check_names.problems_of({"a.cc": file("A"), "b.cc": file("B")})))


class Pages(unittest.TestCase):
    def test_packages_and_reasons_must_match(self):
        packages = "# list\n[build]\ncmake\nlld\n"
        good = "| `cmake` | configures |\n| `lld` | links |\n"
        self.assertEqual([], check_packages.problems_of(packages, good))
        self.assertEqual(2, len(check_packages.problems_of(packages, "| `cmake` |\n| `gold` |\n")))

    def test_links_and_verbs_must_exist(self):
        text = "[a](b.md) [c](https://example.org) ./dev test ./dev dance\n"
        problems = check_docs.problems_of("docs/x.md", text, {"test"}, {"docs/y.md"}.__contains__)
        self.assertEqual(["docs/x.md: the link to b.md leads nowhere",
                          "docs/x.md: there is no ./dev dance"], problems)


if __name__ == "__main__":
    unittest.main()
