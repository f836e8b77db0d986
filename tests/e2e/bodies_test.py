#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From a detector that gives meshes to bodies in files, compared with those that people had."""

import array
import base64
import json
import math
import os
import struct
import unittest

import support

WORLD = ["--world", "apartment", "--humans", "5", "--seed", "2", "--seconds", "12", "--rate", "5",
         "--keyframe-every", "1", "--bodies"]
POSES = ["--poses", "gt", "--no-layers"]


def read_true_bodies(path):
    """Vertices minus the pelvis in the axes of the map, metres, by the id of the detection."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == b"DSGBODY1"
    count = struct.unpack_from("<I", data, 8)[0]
    bodies = {}
    for begin in range(12, len(data), 8 + 6 * count):
        numbers = array.array("h", data[begin + 8:begin + 8 + 6 * count])
        bodies[struct.unpack_from("<q", data, begin)[0]] = [
            [n / 1e4 for n in numbers[i:i + 3]] for i in range(0, 3 * count, 3)]
    return bodies


def read_obj(path):
    vertices, faces = [], []
    with open(path, encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if words[0] == "v":
                vertices.append([float(word) for word in words[1:]])
            elif words[0] == "f":
                faces.append([int(word) - 1 for word in words[1:]])
    return vertices, faces


def minus(points, origin):
    return [[a - b for a, b in zip(point, origin)] for point in points]


def mean_distance(a, b):
    return sum(math.dist(p, q) for p, q in zip(a, b, strict=True)) / len(a)


class Bodies(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.simulated = cls.ok("dsg-simulate", "sensors", *WORLD, "--bag", "--out", "sim")
        cls.said = cls.map_log("store", "sim/log")
        with open(cls.path("sim", "log", "mav0", "detections0", "topology.json"),
                  encoding="utf-8") as file:
            cls.topology = json.load(file)
        cls.person = cls.longest_track()

    @classmethod
    def map_log(cls, store, log, *options):
        return cls.ok("dsg-ingest", "--store", store, "--map", "home", *POSES, *options, log)

    @classmethod
    def about(cls, verb, *arguments, store="store"):
        return cls.ask(verb, *arguments, "--store", store, "--map", "home")

    @classmethod
    def longest_track(cls):
        agents = cls.about("ls", "--layer", "agents")["nodes"]
        people = [node["name"] for node in agents if node["kind"] == "human"]
        return max(people, key=lambda name: len(cls.about("shape", name)["shapes"]))

    def rewritten_log(self, name, change):
        """The log with each detection as `change` makes it, without its images."""
        folder = self.path(name, "mav0", "detections0")
        os.makedirs(folder)
        source = self.path("sim", "log", "mav0")
        for channel in ("cam0", "imu0", "state_groundtruth_estimate0"):
            os.symlink(os.path.join(source, channel), self.path(name, "mav0", channel))
        os.symlink(os.path.join(source, "detections0", "topology.json"),
                   os.path.join(folder, "topology.json"))
        with open(os.path.join(source, "detections0", "data.jsonl"), encoding="utf-8") as read, \
                open(os.path.join(folder, "data.jsonl"), "w", encoding="utf-8") as write:
            for number, line in enumerate(read):
                write.write(json.dumps(change(number, json.loads(line))) + "\n")
        return name

    def test_a_stored_body_is_that_of_the_truth_but_for_the_detector_s_errors(self):
        truths = read_true_bodies(self.path("sim", "truth", "bodies.bin"))
        rows = support.read_rows(self.path("sim", "truth", "detections.csv"))
        excesses = []
        for shape in self.about("shape", self.person)["shapes"][:10]:
            time_ns = int(shape["shape"]["time_ns"])
            files = self.about("shape", self.person, "--obj", "bodies", "--force", "--from",
                               str(time_ns), "--to", str(time_ns + 1))["files"]
            vertices, faces = read_obj(self.path(files[0]["path"]))
            self.assertEqual(self.topology["vertex_count"], len(vertices))
            self.assertEqual(self.topology["faces"], faces)
            pelvis = [shape["pose"]["position"][axis] for axis in "xyz"]
            root = minus(vertices, pelvis)
            error, visibility = min(
                (mean_distance(root, truths[int(row["id"])]), float(row["visibility"]))
                for row in rows if int(row["time_ns"]) == time_ns and int(row["id"]) in truths)
            self.assertGreater(error, 0.01)
            # As the detector's joints, and by the turn of the track.
            excesses.append(error - (0.06 + 0.25 * (1.0 - visibility)))
        self.assertLess(sum(excesses) / len(excesses), 0.05)

    def test_the_evaluation_says_how_far_bodies_are_off(self):
        humans = json.loads(self.ok("dsg-eval", "--store", "store", "--map", "home", "--truth",
                                    "sim/truth", "--json"))["humans"]
        self.assertGreater(humans["vertex_body_count"], 20)
        self.assertEqual(humans["joint_body_count"], humans["vertex_body_count"])
        self.assertLess(humans["vertex_root_m"], 0.2)
        self.assertLess(humans["joint_root_m"], 0.2)
        self.assertLess(humans["vertex_m"], humans["tracked_m"] + humans["vertex_root_m"] + 0.1)
        self.assertIn("vertices", self.simulated)

    def test_faces_are_stored_once_and_bags_bring_the_same(self):
        self.assertIn("with vertices of the body", self.said)
        self.assertNotIn("without faces", self.said)
        self.map_log("of_bag", "sim/log.bag")
        for store in ("store", "of_bag"):
            self.ok("dsg", "verify", "--store", store, "--map", "home")
        ours, theirs = (self.about("shape", self.person, store=store)["shapes"]
                        for store in ("store", "of_bag"))
        self.assertEqual(ours, theirs)
        self.assertEqual(1, len({shape["topology_sha256"] for shape in ours}))

    def test_bodies_walk_in_a_scene_and_stand_in_pictures(self):
        shapes = self.about("shape", self.person)["shapes"]
        at = str(shapes[len(shapes) // 2]["shape"]["time_ns"])
        where = ["--store", "store", "--map", "home"]
        self.ok("dsg", "export", "--gltf", "walk.glb", "--bodies", "--body-step", "0.5", *where)
        with open(self.path("walk.glb"), "rb") as file:
            scene = file.read()
        document = json.loads(scene[20:20 + struct.unpack_from("<I", scene, 12)[0]])
        self.assertGreater(len(document["animations"][0]["channels"]), 2)
        self.refused(3, ["--body-step", "--body-max"], "dsg", "export", "--gltf", "few.glb",
                     "--bodies", "--body-max", "3", *where)
        self.refused(2, ["--at"], "dsg", "export", "--ply", "b.ply", "--bodies", *where)
        ply = self.ask("export", "--ply", "b.ply", "--bodies", "--at", at, *where)["files"][0]
        self.assertGreaterEqual(int(ply["faces"]), len(self.topology["faces"]))
        for name, arguments in (("plain", ["map", "--at", at]),
                                ("bodies", ["map", "--at", at, "--bodies"]),
                                ("one", ["shape", self.person])):
            self.ok("dsg", *arguments, "--png", f"{name}.png", *where)
        with open(self.path("plain.png"), "rb") as a, open(self.path("bodies.png"), "rb") as b:
            self.assertNotEqual(a.read(), b.read())

    def test_bodies_that_do_not_fit_are_points_or_refused(self):
        def without_last_vertex(number, detection):
            if number % 2 == 0:
                vertices = base64.b64decode(detection["vertices_mm"])[:-6]
                detection["vertices_mm"] = base64.b64encode(vertices).decode()
            return detection

        log = self.rewritten_log("odd", without_last_vertex)
        self.assertIn("without faces that fit", self.map_log("odd_store", log))
        self.refused(1, ["data.jsonl:1", "vertices", "--strict"], "dsg-ingest", "--store",
                     "strict_store", "--map", "home", *POSES, "--strict", log)

    def test_without_vertices_all_is_as_before(self):
        log = self.rewritten_log("bare", lambda _, detection: {
            key: value for key, value in detection.items() if key != "vertices_mm"})
        self.assertNotIn("vertices", self.map_log("bare_store", log))
        shapes = self.about("shape", self.person, store="bare_store")["shapes"]
        self.assertEqual({0}, {shape.get("vertex_count", 0) for shape in shapes})
        self.assertEqual([shape["shape"]["joints"] for shape in shapes],
                         [shape["shape"]["joints"]
                          for shape in self.about("shape", self.person)["shapes"]])


if __name__ == "__main__":
    unittest.main()
