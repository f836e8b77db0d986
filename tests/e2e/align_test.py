#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Two sessions of one building, each with poses of its own odometry: what both saw tells where the
second map is in the first, and lays it over it."""

import json
import math
import os
import pathlib
import shutil
import unittest

import support

WORLD = ["--world", "apartment", "--humans", "1", "--seed", "6", "--seconds", "16", "--rate", "10",
         "--keyframe-every", "5"]
FIRST_S, SECOND_S = (0.0, 13.0), (4.0, 16.0)


def stamp_of(line):
    """Of a row of a table or of a line of JSON."""
    return json.loads(line)["time_ns"] if line.startswith("{") else int(line.split(",")[0])


def cut(source, target, begin_s, end_s):
    """The measurements of an interval of a folder's log, as a log of its own."""
    clock = support.read_rows(os.path.join(source, "mav0", "cam0", "data.csv"))
    first_ns = int(clock[0]["#timestamp [ns]"])
    low, high = first_ns + int(begin_s * 1e9), first_ns + int(end_s * 1e9)
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("*_clean"))
    for path in pathlib.Path(target).rglob("data.[cj]s*"):
        heads = 1 if path.suffix == ".csv" else 0
        lines = path.read_text(encoding="utf-8").splitlines()
        kept = [line for line in lines[heads:] if low <= stamp_of(line) <= high]
        path.write_text("".join(line + "\n" for line in lines[:heads] + kept), encoding="utf-8")
    about = pathlib.Path(target, "log.json")
    told = json.loads(about.read_text(encoding="utf-8"))
    del told["counts"]
    about.write_text(json.dumps(told), encoding="utf-8")


class Align(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ok("dsg-simulate", "sensors", *WORLD, "--out", "sim")
        for name, span in (("first", FIRST_S), ("second", SECOND_S)):
            cut(cls.path("sim", "log"), cls.path(name), *span)
            cls.ok("dsg-ingest", "--store", "store", "--map", name, "--poses", "vio",
                   "--recognize", "--no-layers", name)

    def places(self, map_name, robot="r0"):
        """Where the robot was, by time."""
        track = self.ask("track", robot, "--store", "store", "--map", map_name)
        return {pose["time_ns"]: [pose["pose"]["position"].get(axis, 0.0) for axis in "xyz"]
                for pose in track["poses"]}

    def test_finds_the_second_session_in_the_first(self):
        said = json.loads(self.ok("dsg-align", "first", "second", "--store", "store", "--json"))
        x, y, z, heading = said["transform"]
        first, second = self.places("first"), self.places("second")
        both = sorted(first.keys() & second.keys())
        self.assertGreater(len(both), 20)
        # Else nothing is to be found.
        self.assertGreater(math.dist(first[both[0]], second[both[0]]), 0.5)
        for time_ns in both:
            at = second[time_ns]
            moved = (x + math.cos(heading) * at[0] - math.sin(heading) * at[1],
                     y + math.sin(heading) * at[0] + math.cos(heading) * at[1], z + at[2])
            self.assertLess(math.dist(moved, first[time_ns]), 0.15)
        self.assertGreaterEqual(said["agreeing_views"], 3)
        self.assertGreaterEqual(said["views"], said["agreeing_views"])
        self.assertGreaterEqual(said["other_keyframes"], said["agreeing_views"])

    def test_prints_what_merge_takes(self):
        transform = self.ok("dsg-align", "first", "second", "--store", "store").strip()
        plan = self.ok("dsg", "merge", "--store", "store", "--map", "first", "second",
                       f"--transform={transform}", "--yes", "--dry-run")
        x, y, z, heading = (float(number) for number in transform.split(","))
        self.assertIn(f"{x:.3f},{y:.3f},{z:.3f} turned by {math.degrees(heading):.2f}", plan)

    def test_a_later_session_goes_on_in_the_map_of_the_first(self):
        log = ("--poses", "vio", "--no-layers", "--agent-prefix", "again-", "second")
        self.refused(1, ["first", "--transform", "dsg-align"], "dsg-ingest", "--store", "store",
                     "--map", "first", *log)
        transform = self.ok("dsg-align", "first", "second", "--store", "store", "--quiet").strip()
        before = self.places("first")
        self.ok("dsg-ingest", "--store", "store", "--map", "first", f"--transform={transform}",
                *log)
        again = self.places("first", "r1")
        both = sorted(before.keys() & again.keys())
        self.assertGreater(len(both), 20)
        for time_ns in both:
            self.assertLess(math.dist(before[time_ns], again[time_ns]), 0.15)

    def test_says_what_is_missing(self):
        self.ok("dsg-ingest", "--store", "store", "--map", "bare", "--poses", "vio", "--no-layers",
                "first")
        self.refused(1, ["bare", "--recognize"], "dsg-align", "first", "bare", "--store", "store")
        self.refused(1, ["nowhere"], "dsg-align", "first", "nowhere", "--store", "store")
        self.refused(2, ["both"], "dsg-align", "first", "first", "--store", "store")
        self.refused(2, ["--align-share"], "dsg-align", "first", "second", "--store", "store",
                     "--align-share", "2")


if __name__ == "__main__":
    unittest.main()
