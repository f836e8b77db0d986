#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scene graphs of others through a store and out again: the same content, in both forms.

The files are compared by spark_content.py, which knows the format and nothing of our programs.
"""

import json
import os
import struct
import unittest

import spark_content
import support

DATA = os.environ.get("DSG_DATA") or os.path.join(support.ROOT, "..", "shared", "data")
SPARK = os.path.join(DATA, "dsg-spark")
FILES = ["apartment_dsg", "b45_rooms_places2d_objects", "mp3d_x8F5xyUWy9e_0_partial_dsg_600",
         "mp3d_x8F5xyUWy9e_0_partial_dsg_1447"]


def floats_to_single(graph):
    """What the binary form keeps in single precision, as it would be read back."""
    for node in graph["nodes"].values():
        feature = node.get("semantic_feature")
        if feature and feature["data"]:
            feature["data"] = [spark_content.single(v) for v in feature["data"]]
        for name in ("trajectory_positions",):
            if name in node:
                node[name] = [[spark_content.single(v) for v in p] for p in node[name]]
    return graph


class RoundTrip(support.ProgramsTest):
    def file(self, name):
        path = os.path.join(SPARK, name)
        if not os.path.exists(path):
            self.skipTest("the recorded scene graphs are not there; set DSG_DATA")
        return path

    def through(self, path, map_name, ending):
        """Imports a file into a map of its own and exports it again."""
        store, out = self.path("store"), self.path(f"{map_name}.{ending}")
        self.ok("dsg", "import", path, "--store", store, "--map", map_name)
        self.ok("dsg", "export", "--spark", out, "--store", store, "--map", map_name, "--force")
        return out

    def test_every_recorded_file_comes_back_as_json(self):
        for name in FILES:
            with self.subTest(name):
                path = self.file(name + ".json")
                out = self.through(path, name.lower(), "json")
                before, after = spark_content.read(path), spark_content.read(out)
                self.assertEqual([], spark_content.differences(before, after)[:5])

    def test_every_recorded_file_comes_back_as_binary(self):
        for name in FILES:
            with self.subTest(name):
                path = self.file(name + ".json")
                out = self.through(path, name.lower() + "_b", "sparkdsg")
                before = floats_to_single(spark_content.read(path))
                after = spark_content.read(out)
                self.assertEqual([], spark_content.differences(before, after)[:5])

    def test_an_export_comes_back_from_its_own_import(self):
        for name in FILES + ["scene_graph_content"]:
            with self.subTest(name):
                first = self.through(self.file(name + ".json"), name.lower() + "_1", "json")
                second = self.through(first, name.lower() + "_2", "sparkdsg")
                third = self.through(second, name.lower() + "_3", "json")
                before, after = spark_content.read(first), spark_content.read(third)
                self.assertEqual([], spark_content.differences(before, after)[:5])


class Dangling(support.ProgramsTest):
    """A file with edges that lead nowhere: read but for these, or refused if asked to."""

    WORDS = ["skipped 2 edges to nodes that are not there",
             "edge p0 to p7: node 8070450532247928839 (p7) is not in the file"]

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        place = ord("p") << 56
        nodes = [{"id": place + i, "layer": 3, "partition": 0, "attributes": {
            "type": "PlaceNodeAttributes", "position": [i, 0, 0]}} for i in range(3)]
        ends = [(0, 1), (1, 2), (0, 7), (8, 2)]
        edges = [{"source": place + a, "target": place + b, "info": {}} for a, b in ends]
        cls.file = cls.path("dangling.json")
        with open(cls.file, "w", encoding="utf-8") as file:
            json.dump({"nodes": nodes, "edges": edges}, file)

    def notes_of(self, *command):
        done = support.run(*command, cwd=self.folder)
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stderr

    def test_import_skips_and_counts_them(self):
        done = self.notes_of("dsg", "import", self.file, "--store", self.path("i"), "--map", "m")
        for words in self.WORDS:
            self.assertIn(words, done)
        self.refused(2, self.WORDS, "dsg", "import", "--strict", self.file, "--store",
                     self.path("s"), "--map", "m")

    def test_ingest_skips_and_logs_them(self):
        done = self.notes_of("dsg-ingest", self.file, "--store", self.path("g"), "--map", "m")
        for words in self.WORDS:
            self.assertIn(words, done)
        self.refused(1, self.WORDS, "dsg-ingest", "--strict", self.file, "--store",
                     self.path("gs"), "--map", "m")


class OwnMap(support.ProgramsTest):
    """A map with rooms, people and a robot, out and in again."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        log = cls.simulate("sim", people=3, seconds=40)
        cls.store = cls.path("store")
        cls.ingest(cls.store, log)
        cls.ok("dsg", "export", "--spark", "office.json", "--pose-step", 0, "--store", cls.store,
               "--map", "office")
        cls.ok("dsg", "import", "office.json", "--store", cls.store, "--map", "again")

    def both(self, *question):
        """The answers of the map and of what came back, without revisions."""
        answers = []
        for map_name in ("office", "again"):
            answer = self.ask(*question, "--store", self.store, "--map", map_name)
            answers.append(strip(answer))
        return answers

    def test_nodes_and_hierarchy_are_the_same(self):
        before, after = self.both("ls", "--limit", 1000)
        self.assertTrue(before["nodes"])
        self.assertEqual([(n["id"], n["kind"], n.get("name")) for n in before["nodes"]],
                         [(n["id"], n["kind"], n.get("name")) for n in after["nodes"]])

    def test_agents_were_where_they_were(self):
        listed = self.ask("ls", "--layer", "agents", "--store", self.store, "--map", "office")
        agents = [n["id"] for n in listed["nodes"]]
        self.assertTrue(agents)
        for agent in agents:
            for at in ("+5s", "+17.3s", "+31s"):
                before, after = self.both("where", agent, "--at", at)
                for axis in "xyz":
                    self.assertAlmostEqual(position(before).get(axis, 0.0),
                                           position(after).get(axis, 0.0), delta=2e-3)

    def test_who_was_where_and_what_is_found_are_the_same(self):
        listed = self.ask("ls", "--layer", "rooms", "--store", self.store, "--map", "office")
        for room in listed["nodes"]:
            before, after = self.both("who", "--room", room["id"], "--from", "+0s", "--to", "+40s")
            # Who grazed a room may not be told from who passed its door.
            lasting = {i["agent_id"] for i in before.get("intervals", []) if
                       int(i["exit_ns"]) - int(i["enter_ns"]) > 2 * support.NS_PER_S}
            found = {i["agent_id"] for i in after.get("intervals", [])}
            self.assertLessEqual(lasting, found, room["id"])
        before, after = self.both("find", "object", "--limit", 1000)
        self.assertTrue(before["hits"])
        self.assertEqual([(h["node"]["id"], h["ancestor_ids"]) for h in before["hits"]],
                         [(h["node"]["id"], h["ancestor_ids"]) for h in after["hits"]])

    def test_a_revision_and_an_instant_are_honoured(self):
        old = self.path("old.json")
        self.ok("dsg", "export", "--spark", old, "--revision", 1, "--store", self.store, "--map",
                "office")
        with open(old, encoding="utf-8") as file:
            self.assertEqual(1, json.load(file)["metadata"]["dsgdb"]["revision"])
        early = self.path("early.json")
        self.ok("dsg", "export", "--spark", early, "--at", "+5s", "--store", self.store, "--map",
                "office")
        self.assertLess(max(times_of(early)), max(times_of(self.path("office.json"))))

    def test_refuses_what_it_cannot_write(self):
        common = ("--store", self.store, "--map", "office")
        for path, words in (("office.txt", "end the name in .json"),
                            ("office.json", "is there already"),
                            ("no/such/office.json", "cannot create")):
            self.refused(2, [words], "dsg", "export", "--spark", path, *common)
        self.assertFalse(os.path.exists(self.path("office.txt")))

    def test_a_full_disk_leaves_no_file(self):
        # The graph is larger than what a file may be; the index of the store's log is smaller.
        done = support.run("bash", "-c", "trap '' XFSZ; ulimit -f 64; exec \"$@\"", "bash",
                           "dsg", "export", "--spark", "full.json", "--store", self.store, "--map",
                           "office", cwd=self.folder)
        self.assertNotEqual(0, done.returncode)
        self.assertIn("DISK_FULL", done.stderr)
        self.assertFalse(os.path.exists(self.path("full.json")))
        self.assertFalse(os.path.lexists(self.path("full.json.part")))

    def test_a_server_exports_the_same_bytes(self):
        local, remote = self.path("local.sparkdsg"), self.path("remote.sparkdsg")
        self.ok("dsg", "export", "--spark", local, "--store", self.store, "--map", "office")
        address = "unix:" + self.path("socket")
        with self.server(self.store, address):
            self.ok("dsg", "export", "--spark", remote, "--server", address, "--map", "office")
        with open(local, "rb") as a, open(remote, "rb") as b:
            self.assertEqual(a.read(), b.read())


class Gltf(support.ProgramsTest):
    """The .glb of a map with and without a mesh, by a reader of the container alone."""

    def check(self, path):
        with open(path, "rb") as file:
            data = file.read()
        magic, version, length = struct.unpack_from("<4sII", data)
        self.assertEqual((b"glTF", 2, len(data)), (magic, version, length))
        size, kind = struct.unpack_from("<I4s", data, 12)
        self.assertEqual(b"JSON", kind)
        root = json.loads(data[20:20 + size])
        at = 20 + size
        binary = 0
        if at < len(data):
            binary, kind = struct.unpack_from("<I4s", data, at)
            self.assertEqual(b"BIN\0", kind)
            self.assertEqual(len(data), at + 8 + binary)
        for buffer in root.get("buffers", []):
            self.assertLessEqual(buffer["byteLength"], binary)
        sizes = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
        parts = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
        views = root.get("bufferViews", [])
        for view in views:
            self.assertLessEqual(view.get("byteOffset", 0) + view["byteLength"], binary)
        for accessor in root.get("accessors", []):
            view = views[accessor["bufferView"]]
            item = sizes[accessor["componentType"]] * parts[accessor["type"]]
            stride = view.get("byteStride", item)
            end = accessor.get("byteOffset", 0) + stride * (accessor["count"] - 1) + item
            self.assertLessEqual(end, view["byteLength"])
        for mesh in root.get("meshes", []):
            for primitive in mesh["primitives"]:
                self.check_indices(root, primitive, data[at + 8:])
        for scene in root["scenes"]:
            for node in scene["nodes"]:
                self.assertLess(node, len(root["nodes"]))
        return root

    def check_indices(self, root, primitive, binary):
        count = root["accessors"][primitive["attributes"]["POSITION"]]["count"]
        if "indices" not in primitive:
            return
        accessor = root["accessors"][primitive["indices"]]
        view = root["bufferViews"][accessor["bufferView"]]
        form = {5121: "B", 5123: "H", 5125: "I"}[accessor["componentType"]]
        offset = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        indices = struct.unpack_from(f"<{accessor['count']}{form}", binary, offset)
        self.assertLess(max(indices), count)

    def test_maps_without_a_mesh_and_with_one_hold(self):
        self.ingest(self.path("store"), self.simulate("sim", people=1, seconds=5, seed=3))
        for revision in ((), ("--revision", 1)):
            self.ok("dsg", "export", "--gltf", "a.glb", "--store", "store", "--map", "office",
                    "--force", *revision)
            root = self.check(self.path("a.glb"))
            self.assertEqual("2.0", root["asset"]["version"])
        graph = {"SPARK_DSG_header": {"project_name": "main",
                                      "version": {"major": 1, "minor": 1, "patch": 3}},
                 "directed": False, "multigraph": False, "layer_keys": [], "layer_names": {},
                 "metadata": {}, "nodes": [], "edges": [],
                 "mesh": {"has_colors": False, "has_timestamps": False, "has_labels": True,
                          "has_first_seen_stamps": False,
                          "points": [[0, 0, 0], [3, 0, 0], [0, 3, 0], [3, 3, 1]],
                          "labels": [1, 1, 1, 2], "faces": [[0, 1, 2], [1, 3, 2]]}}
        with open(self.path("mesh.json"), "w", encoding="utf-8") as file:
            json.dump(graph, file)
        self.ok("dsg", "import", "mesh.json", "--store", "store", "--map", "mesh")
        self.ok("dsg", "export", "--gltf", "m.glb", "--spark", "m.json", "--store", "store",
                "--map", "mesh")
        self.assertTrue(self.check(self.path("m.glb"))["meshes"])
        self.assertEqual([], spark_content.differences(spark_content.read(self.path("mesh.json")),
                                                       spark_content.read(self.path("m.json"))))


def times_of(path):
    """Of all poses of robots and people."""
    nodes = spark_content.read(path)["nodes"].values()
    poses = [n["timestamp"] for n in nodes if "timestamp" in n]
    return poses + [t for n in nodes for t in n.get("trajectory_timestamps", [])]


def strip(answer):
    if isinstance(answer, dict):
        return {k: strip(v) for k, v in answer.items() if "revision" not in k}
    return [strip(v) for v in answer] if isinstance(answer, list) else answer


def position(answer):
    """The first position anywhere in an answer."""
    if isinstance(answer, dict):
        if "position" in answer:
            return answer["position"]
        answer = list(answer.values())
    if isinstance(answer, list):
        for part in answer:
            found = position(part)
            if found is not None:
                return found
    return None


if __name__ == "__main__":
    unittest.main()
