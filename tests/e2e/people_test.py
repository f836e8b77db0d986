#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From detections to tracks, and from loop closures to a corrected map, as a user sees it."""

import json
import unittest

import support

WORLD = ["--world", "apartment", "--humans", "4", "--seed", "2", "--seconds", "40", "--rate", "5",
         "--keyframe-every", "1"]
DRIFT = ["--seed", "2", "--wrong-loops", "0.3", "--drift-m-per-m", "0.05", "--drift-rad-per-m",
         "0.02", "--loop-period", "2"]


class People(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ok("dsg-simulate", "sensors", *WORLD, "--out", "sim")
        cls.ok("dsg-simulate", "drift", "sim", "--out", "drift", *DRIFT)
        cls.said = cls.map_log("store")
        cls.drifted = ["--poses", "external", "--pose-file", cls.path("drift", "odometry.csv"),
                       "--voxel", "0.1"]

    @classmethod
    def map_log(cls, store, *options):
        poses = [] if "--poses" in options else ["--poses", "gt", "--voxel", "0.1"]
        return cls.ok("dsg-ingest", "--store", store, "--map", "home", *poses, *options, "sim/log")

    def score(self, store):
        return json.loads(self.ok("dsg-eval", "--store", store, "--map", "home", "--truth",
                                  "sim/truth", "--json"))

    def about(self, verb, *arguments, store="store"):
        return self.ask(verb, *arguments, "--store", store, "--map", "home")

    def test_people_have_tracks_near_the_truth(self):
        humans = self.score("store")["humans"]
        self.assertLess(humans["tracked_m"], 0.15)
        self.assertGreater(humans["idf1"], 0.8)
        self.assertIn("detections of people used", self.said)

    def test_without_depth_the_floor_and_the_track_help(self):
        self.map_log("flat", "--no-people-depth")
        humans = self.score("flat")["humans"]
        self.assertLess(humans["tracked_m"], 0.35)
        self.assertLess(humans["tracked_m"], 0.5 * humans["raw_m"])

    def test_the_paper_s_tracker_is_better_than_its_detections(self):
        self.map_log("paper", "--people", "paper")
        humans = self.score("paper")["humans"]
        self.assertLess(humans["filtered_m"], humans["raw_m"])
        self.assertLess(humans["tracked_m"], humans["filtered_m"])

    def test_no_people_on_request(self):
        said = self.map_log("off", "--people", "off")
        self.assertIn("detections", said)
        agents = self.about("ls", "--layer", "agents", store="off")["nodes"]
        self.assertEqual(["body"], [node["name"] for node in agents])

    def test_somebody_can_be_asked_for(self):
        agents = self.about("ls", "--layer", "agents")["nodes"]
        names = [node["name"] for node in agents if node["kind"] == "human"]
        people = [name for name in names
                  if self.about("show", name)["node"]["agent"]["track_state"] != "dropped"]
        self.assertTrue(people)
        name = people[0]
        track = self.about("track", name)
        self.assertGreater(len(track["poses"]), 3)
        shapes = self.about("shape", name)["shapes"]
        self.assertEqual(len(track["poses"]), len(shapes))
        self.assertEqual(72, len(shapes[0]["shape"]["joints"]))

    def test_a_second_run_adds_nothing(self):
        self.assertIn("nothing new", self.map_log("store"))

    def test_loop_closures_correct_the_whole_map(self):
        self.map_log("off_course", *self.drifted)
        said = self.map_log("closed", *self.drifted, "--loops", self.path("drift", "loops.jsonl"))
        self.assertIn("4 loop closures, 3 believed", said)
        before, after = self.score("off_course"), self.score("closed")
        self.assertLess(after["trajectory"]["ate_smoothed_m"],
                        0.7 * before["trajectory"]["ate_smoothed_m"])
        self.assertLess(after["mesh"]["rmse_no_icp_m"], before["mesh"]["rmse_no_icp_m"])
        # What was believed before is still there, and both maps say the same of it.
        head = int(self.about("stats", store="closed")["header"]["head_revision"])
        revisions = self.about("log", store="closed")["revisions"]
        corrections = sum("moved by loop closures" in one["message"] for one in revisions)
        self.assertGreater(corrections, 0)
        believed = []
        for revision in range(1, head + 1):
            done = support.run("dsg", "where", "body", "--at", "+5s", "--revision", str(revision),
                               "--json", "--store", "closed", "--map", "home", cwd=self.folder)
            if done.returncode != 0:
                continue
            x = json.loads(done.stdout)["pose"]["position"]["x"]
            if not believed or believed[-1] != x:
                believed.append(x)
        self.assertLessEqual(len(believed), corrections + 1)
        self.assertGreater(len(believed), 1)
        self.ok("dsg", "verify", "--store", "closed", "--map", "home")

    def test_a_loop_closure_that_is_said_fifty_times_counts_once(self):
        with open(self.path("drift", "loops.jsonl"), encoding="utf-8") as file:
            lines = file.readlines()
        with open(self.path("often.jsonl"), "w", encoding="utf-8") as file:
            file.writelines(line for line in lines for _ in range(50))
        poses_only = [*self.drifted, "--no-layers", "--people", "off"]
        self.map_log("once", *poses_only, "--loops", self.path("drift", "loops.jsonl"))
        said = self.map_log("often", *poses_only, "--loops", self.path("often.jsonl"))
        self.assertIn("200 loop closures, 3 believed, 0 outside the trajectory, 196 that say again",
                      said)
        tracks = [self.about("track", "body", store=store)["poses"] for store in ("once", "often")]
        self.assertEqual(*tracks)

    def test_a_broken_loop_closure_is_named(self):
        with open(self.path("broken.jsonl"), "w", encoding="utf-8") as file:
            file.write('{"from_ns": 1, "to_ns": 2, "translation": [0, 0], "rotation": [0,0,0,1]}\n')
        done = support.run("dsg-ingest", "--store", "refused", "--map", "home", *self.drifted,
                           "--loops", "broken.jsonl", "sim/log", cwd=self.folder)
        self.assertNotEqual(0, done.returncode)
        self.assertIn("broken.jsonl:1", done.stderr)

    def test_the_robot_has_a_shape_on_request(self):
        with open(self.path("robot.obj"), "w", encoding="utf-8") as file:
            file.write("v 0 0 0\nv 0.4 0 0\nv 0 0.3 0\nv 0 0 0.2\n"
                       "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
        self.map_log("shaped", "--no-layers", "--robot-cad", self.path("robot.obj"))
        body = self.about("show", "body", store="shaped")["node"]
        self.assertTrue(body["agent"]["body_model_sha256"])


if __name__ == "__main__":
    unittest.main()
