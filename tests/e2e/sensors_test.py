#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A simulated sensor log from its making to its score: folder, bag, store, evaluation."""

import filecmp
import json
import os
import shutil
import unittest

import support

SMALL = ["--world", "apartment", "--humans", "2", "--seed", "8", "--seconds", "2", "--rate", "5",
         "--keyframe-every", "5"]
FRAME_COUNT = 10
KEYFRAME_COUNT = 2
IMU_COUNT = 401


def files_under(folder):
    return sorted(os.path.relpath(os.path.join(root, name), folder)
                  for root, _, names in os.walk(folder) for name in names)


def figures_of(value):
    """Names and values of all leaves of a family."""
    for name, leaf in (value or {}).items():
        if isinstance(leaf, dict):
            yield from figures_of(leaf)
        else:
            yield name, leaf


class Sensors(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.summary = cls.ok("dsg-simulate", "sensors", *SMALL, "--out", "sim", "--bag")

    def ingest_and_evaluate(self, store, log, *options):
        said = self.ok("dsg-ingest", "--store", store, "--map", "home", "--poses", "gt",
                       "--no-layers", *options, log)
        return said, json.loads(self.ok("dsg-eval", "--store", store, "--map", "home", "--truth",
                                        "sim/truth", "--json"))

    def test_tells_what_it_made(self):
        self.assertIn(f"{FRAME_COUNT} stereo pairs, {KEYFRAME_COUNT} keyframes", self.summary)
        self.assertIn(f"{IMU_COUNT} inertial samples", self.summary)

    def test_two_processes_over_two_ranges_write_the_same_bytes(self):
        with open(self.path("halves.txt"), "w", encoding="utf-8") as said:
            halves = [support.start("dsg-simulate", "sensors", *SMALL, "--out", "again", "--frames",
                                    frames, "--threads", "1", cwd=self.folder, log=said)
                      for frames in ("0:4", "4:10")]
            codes = [half.wait(timeout=support.TIMEOUT_S) for half in halves]
        with open(self.path("halves.txt"), encoding="utf-8") as said:
            self.assertEqual([0, 0], codes, said.read())
        self.assertFalse(os.path.exists(self.path("again", "log")))
        self.ok("dsg-simulate", "sensors", *SMALL, "--out", "again", "--bag")
        names = files_under(self.path("sim"))
        self.assertEqual(names, files_under(self.path("again")))
        for name in names:
            self.assertTrue(filecmp.cmp(self.path("sim", name), self.path("again", name), False),
                            name)

    def test_folder_and_bag_give_the_robot_its_true_poses(self):
        for store, log in (("folder", "sim/log"), ("bag", "sim/log.bag")):
            with self.subTest(log=log):
                said, score = self.ingest_and_evaluate(store, log)
                self.assertIn(f"{IMU_COUNT} inertial samples", said)
                self.assertLess(score["trajectory"]["ate_m"], 1e-4)
                self.assertGreater(score["trajectory"]["coverage"], 0.99)
                stats = self.ask("stats", "--store", store, "--map", "home")
                agents = [layer for layer in stats["layers"] if layer["name"] == "agents"]
                self.assertEqual("1", agents[0]["node_count"])

    def test_what_was_not_built_is_null(self):
        _, score = self.ingest_and_evaluate("nulls", "sim/log")
        for family in ("mesh", "humans", "objects", "places", "rooms", "picks"):
            value = score[family]
            for name, figure in figures_of(value):
                # Counts of what is there to be found, or was, are no scores.
                if "count" in name:
                    continue
                self.assertIsNone(figure, f"{family}.{name}: {value}")

    def test_pictures_are_written(self):
        said = self.ok("dsg-simulate", "preview", "sim", "--count", "2")
        for name in ("sheet.png", "camera.png", "depth.png", "labels.png", "top.png"):
            self.assertIn(name, said)
            with open(self.path("sim", "preview", name), "rb") as picture:
                self.assertEqual(b"\x89PNG", picture.read(4))
        shutil.rmtree(self.path("sim", "preview"))

    def test_refuses_what_cannot_be(self):
        self.refused(2, ["--world", "castle"], "dsg-simulate", "sensors", "--world", "castle",
                     "--out", "x")
        self.refused(2, ["--humans", "-3"], "dsg-simulate", "sensors", "--humans", "-3", "--out",
                     "x")
        self.refused(2, ["--seconds"], "dsg-simulate", "sensors", "--seconds", "1e9", "--out", "x")
        self.refused(2, ["--frames"], "dsg-simulate", "sensors", "--frames", "9", "--out", "x")
        self.refused(1, ["sim", "--force"], "dsg-simulate", "sensors", *SMALL, "--out", "sim")
        self.refused(1, ["/proc"], "dsg-simulate", "sensors", *SMALL, "--out", "/proc/x")

    def test_the_truth_of_another_log_is_no_truth_of_this_one(self):
        self.ok("dsg-simulate", "sensors", "--world", "apartment", "--humans", "0", "--seed", "9",
                "--seconds", "1", "--rate", "2", "--out", "other")
        self.ok("dsg-ingest", "--store", "mixed", "--map", "home", "--poses", "gt", "sim/log")
        score = json.loads(self.ok("dsg-eval", "--store", "mixed", "--map", "home", "--truth",
                                   "other/truth", "--json"))
        self.assertIsNone(score["trajectory"]["ate_m"])
        self.assertTrue(any("another log" in note for note in score["notes"]), score["notes"])

    def test_broken_logs_are_named(self):
        shutil.copytree(self.path("sim", "log"), self.path("broken"))
        os.remove(self.path("broken", "mav0", "cam1", "sensor.yaml"))
        self.refused(1, ["cam1", "sensor.yaml"], "dsg-ingest", "--store", "s", "--map", "m",
                     "--poses", "gt", "broken")
        with open(self.path("broken", "mav0", "cam1", "sensor.yaml"), "w", encoding="utf-8") as f:
            f.write("T_BS: [1, 2\n")
        self.refused(1, ["sensor.yaml"], "dsg-ingest", "--store", "s", "--map", "m", "--poses",
                     "gt", "broken")
        with open(self.path("sim", "log.bag"), "rb") as bag:
            start = bag.read(200_000)
        with open(self.path("cut.bag"), "wb") as bag:
            bag.write(start)
        self.refused(1, ["cut.bag"], "dsg-ingest", "--store", "s", "--map", "m", "cut.bag")
        self.refused(2, ["external"], "dsg-ingest", "--store", "s", "--map", "m", "--poses",
                     "external", "sim/log")
        self.refused(2, ["vio", "--pose-file"], "dsg-ingest", "--store", "s", "--map", "m",
                     "--poses", "vio", "--pose-file", "x", "sim/log")
        self.refused(2, ["odometry", "vio"], "dsg-ingest", "--store", "s", "--map", "m",
                     "--odometry", "5pt", "sim/log")
        for more, word in (("--dry-run", "writes nothing"), ("sim/log", "one by one")):
            self.refused(2, ["odometry-mesh", word], "dsg-ingest", "--store", "s", "--map", "m",
                         "--poses", "vio", "--odometry-mesh", "x.ply", more, "sim/log")
        self.refused(2, ["odometry-inertial", "vio"], "dsg-ingest", "--store", "s", "--map", "m",
                     "--odometry-inertial", "off", "sim/log")

    def test_what_a_map_has_is_drawn_over_the_images_of_its_log(self):
        self.ok("dsg-ingest", "--store", "seen", "--map", "home", "--poses", "gt", "--voxel", "0.1",
                "sim/log")
        draw = ["dsg-overlay", "--store", "seen", "--map", "home", "--out"]
        said = self.ok(*draw, "drawn", "--every", "5", "sim/log")
        self.assertIn(f"wrote {KEYFRAME_COUNT} pictures of cam0", said)
        pictures = files_under(self.path("drawn"))
        rows = support.read_rows(self.path("sim", "log", "mav0", "cam0", "data.csv"))
        stamps = [next(iter(row.values())) for row in rows]
        self.assertEqual([f"cam0_{stamp}.png" for stamp in stamps[::5]], pictures)
        # A bag of the same log gives the same; only single instants, and another camera.
        self.ok(*draw, "drawn-bag", "--at", "+0s", "sim/log.bag")
        self.assertEqual(pictures[:1], files_under(self.path("drawn-bag")))
        self.assertTrue(filecmp.cmp(self.path("drawn", pictures[0]),
                                    self.path("drawn-bag", pictures[0]), shallow=False))
        self.ok(*draw, "drawn-color", "--camera", "color0", "--at", "+0s", "sim/log")
        self.assertEqual([f"color0_{stamps[0]}.png"], files_under(self.path("drawn-color")))
        # What was there is kept, and what cannot be drawn is said.
        self.refused(2, [pictures[0], "--force"], *draw, "drawn", "--every", "5", "sim/log")
        self.ok(*draw, "drawn", "--every", "5", "--force", "sim/log")
        self.refused(2, ["depth0", "cam0"], *draw, "x", "--camera", "depth0", "sim/log")
        self.refused(1, ["spot", "r0"], *draw, "x", "--robot", "spot", "sim/log")
        self.refused(1, ["no image within a second"], *draw, "x", "--at", "+9s", "sim/log")
        self.refused(2, ["--trail", "nan"], *draw, "x", "--trail", "nan", "sim/log")
        self.refused(2, ["--at"], *draw, "x", "--at", "+1s", "--every", "5", "sim/log")
        # A log without images.
        self.ok("dsg-simulate", "tracks", "--out", "tracks", "--people", "2", "--seconds", "5")
        self.refused(2, ["no camera"], *draw, "x", "tracks/log")

    def test_poses_are_estimated_from_images_and_inertial_samples(self):
        command = ["dsg-ingest", "--store", "own", "--map", "home", "--poses", "vio", "--recognize",
                   "--no-layers", "sim/log"]
        said = self.ok(*command)
        self.assertRegex(said, r" [1-9]\d* poses, ")
        self.assertNotIn("inertial samples", said)
        self.assertIn("nothing new", self.ok(*command))
        score = json.loads(self.ok("dsg-eval", "--store", "own", "--map", "home", "--truth",
                                   "sim/truth", "--trajectory", "--json"))
        self.assertLess(score["tracks"]["causal"]["ate"]["max_m"], 0.1)
        # Other methods are other sessions, and other maps.
        self.assertNotIn("nothing new", self.ok(*command[:4], "two", *command[5:], "--odometry",
                                                "2pt"))

    def test_a_bag_that_tells_no_noise_gets_poses_all_the_same(self):
        self.estimates("own-bag", "sim/log.bag")

    def test_poses_are_estimated_from_images_alone(self):
        self.estimates("own-eye", "--odometry-inertial", "off", "sim/log")

    def estimates(self, store, *log):
        said = self.ok("dsg-ingest", "--store", store, "--map", "home", "--poses", "vio",
                       "--no-layers", *log)
        self.assertRegex(said, r" [1-9]\d* poses, ")
        score = json.loads(self.ok("dsg-eval", "--store", store, "--map", "home", "--truth",
                                   "sim/truth", "--trajectory", "--json"))
        self.assertLess(score["tracks"]["causal"]["ate"]["max_m"], 0.1)


if __name__ == "__main__":
    unittest.main()
