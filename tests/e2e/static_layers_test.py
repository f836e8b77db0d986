#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From a simulated log to rooms, places and objects, as a user sees it; and from broken ones."""

import glob
import json
import os
import shutil
import sqlite3
import unittest

import support

# Ten seconds of one room, seen all round.
SMALL = ["--world", "apartment", "--humans", "2", "--seed", "3", "--seconds", "10", "--rate", "5",
         "--keyframe-every", "1"]
FRAME_COUNT = 50


class StaticLayers(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ok("dsg-simulate", "sensors", *SMALL, "--out", "sim")
        cls.said = cls.ok("dsg-ingest", "--store", "store", "--map", "home", "--poses", "gt",
                          "--cad", "sim/truth/cad", "--timings", "sim/log")

    def ingest(self, store, log="sim/log", *options):
        return self.ok("dsg-ingest", "--store", store, "--map", "home", "--poses", "gt",
                       *options, log)

    def digests(self, store):
        """What each revision says of itself: its message and the digest of its content."""
        path = glob.glob(self.path(store, "**", "graph.db"), recursive=True)[0]
        # Read only: a plain connection that closes last would write back the log of the database.
        with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as db:
            return db.execute("SELECT revision, message, hex(content) FROM revision "
                              "ORDER BY revision"
                              ).fetchall()

    def nodes(self, layer, store="store"):
        return self.ask("ls", "--store", store, "--map", "home", "--layer", layer)["nodes"]

    def copy_of_log(self, name):
        shutil.copytree(self.path("sim", "log"), self.path(name))
        return self.path(name)

    def depth_files(self, log):
        return sorted(glob.glob(os.path.join(log, "mav0", "depth0", "data", "*.png")))

    def test_all_layers_are_there(self):
        self.assertIn(f"{FRAME_COUNT} frames fused", self.said)
        for layer in ("objects", "places", "rooms", "buildings", "structures"):
            with self.subTest(layer=layer):
                self.assertTrue(self.nodes(layer))

    def test_the_map_is_close_to_the_truth(self):
        score = json.loads(self.ok("dsg-eval", "--store", "store", "--map", "home", "--truth",
                                   "sim/truth", "--json"))
        self.assertLess(score["mesh"]["rmse_m"], 0.06)
        self.assertEqual(1.0, score["places"]["collision_free_ratio"])
        self.assertGreater(score["objects"]["unknown"]["found_ratio"], 0.5)

    def test_the_map_grows_while_the_log_runs(self):
        self.assertGreaterEqual(len(self.digests("store")), 9)

    def test_the_same_log_gives_the_same_bytes(self):
        self.ingest("again", "sim/log", "--cad", self.path("sim", "truth", "cad"))
        self.ingest("once", "sim/log", "--cad", self.path("sim", "truth", "cad"), "--threads", "1")
        self.assertEqual(self.digests("again"), self.digests("once"))

    def test_a_second_run_adds_nothing(self):
        before = self.digests("store")
        said = self.ok("dsg-ingest", "--store", "store", "--map", "home", "--poses", "gt", "--cad",
                       "sim/truth/cad", "sim/log")
        self.assertIn("nothing new", said)
        self.assertEqual(before, self.digests("store"))

    def revision_count(self, store):
        done = support.run("dsg", "stats", "--store", store, "--map", "home", "--json",
                           cwd=self.folder)
        if done.returncode != 0:
            return 0
        return int(json.loads(done.stdout)["header"]["head_revision"])

    def test_a_killed_run_goes_on_to_the_same_map(self):
        command = ["dsg-ingest", "--store", "killed", "--map", "home", "--poses", "gt", "--cad",
                   self.path("sim", "truth", "cad"), self.path("sim", "log")]
        for wanted in (2, 9, 14):
            run = support.start(*command, cwd=self.folder)
            support.wait_until(lambda: run.poll() is not None or
                               self.revision_count("killed") >= wanted, f"{wanted} revisions")
            run.kill()
            run.wait()
        self.ok(*command)
        self.assertEqual(self.digests("store"), self.digests("killed"))
        self.ok("dsg", "verify", "--store", "killed", "--map", "home")

    def test_poses_only_on_request(self):
        self.ingest("poses", "sim/log", "--no-layers")
        self.assertEqual([], self.nodes("places", "poses"))

    def test_broken_pictures_are_counted_and_the_map_stays(self):
        log = self.copy_of_log("broken")
        depth = self.depth_files(log)
        size = os.path.getsize(depth[10])
        with open(depth[10], "r+b") as picture:
            picture.seek(size // 2)
            picture.write(b"\0" * (size - size // 2))
        said = self.ingest("broken_store", log)
        self.assertIn("broken image 1", said)
        self.assertIn(f"{FRAME_COUNT - 1} frames fused", said)
        self.assertTrue(self.nodes("places", "broken_store"))

    def test_a_pose_jump_is_counted(self):
        log = self.copy_of_log("jump")
        path = os.path.join(log, "mav0", "state_groundtruth_estimate0", "data.csv")
        with open(path, encoding="utf-8") as table:
            lines = table.read().splitlines()
        middle = len(lines) // 2
        fields = lines[middle].split(",")
        fields[1] = str(float(fields[1]) + 50.0)
        lines[middle] = ",".join(fields)
        with open(path, "w", encoding="utf-8") as table:
            table.write("\n".join(lines) + "\n")
        self.assertIn("pose jump", self.ingest("jump_store", log))

    def test_refuses_what_cannot_be(self):
        for flags, words in ((["--voxel", "0"], ["voxel", "0"]),
                             (["--voxel", "nan"], ["voxel"]),
                             (["--range", "-1"], ["range"]),
                             (["--masking", "melt"], ["masking", "melt"]),
                             (["--commit-seconds", "0"], ["commit"]),
                             (["--mesh-seconds", "1"], ["mesh", "1"]),
                             (["--robot-radius", "99"], ["robot", "99"])):
            with self.subTest(flags=flags):
                self.refused(2, words, "dsg-ingest", "--store", "bad", "--map", "home", "--poses",
                             "gt", *flags, "sim/log")

    def test_a_broken_model_is_named(self):
        os.makedirs(self.path("models"), exist_ok=True)
        with open(self.path("models", "couch.ply"), "wb") as model:
            model.write(b"ply\nformat ascii 1.0\nelement vertex 9999999999\n")
        self.refused(1, ["couch.ply"], "dsg-ingest", "--store", "bad", "--map", "home", "--poses",
                     "gt", "--cad", "models", "sim/log")
        self.refused(1, ["no-such-folder"], "dsg-ingest", "--store", "bad", "--map", "home",
                     "--poses", "gt", "--cad", "no-such-folder", "sim/log")


if __name__ == "__main__":
    unittest.main()
