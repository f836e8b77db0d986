#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Logs and files that give nothing or fail leave no map; dropped and renamed maps; set names."""

import json
import os
import signal
import unittest

import support

SENSORS = ["--world", "apartment", "--humans", "0", "--seed", "3", "--seconds", "4", "--rate", "5",
           "--keyframe-every", "1"]
# Blocks of 1024 bytes that a file may have: a new map fits, the first delta does not.
FILE_BLOCKS_MAX = 400


class HonestEnds(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small = cls.simulate("small", people=3, seconds=60)
        cls.ok("dsg-simulate", "sensors", *SENSORS, "--out", "sim")

    def maps(self, *place):
        return [m["name"] for m in self.ask("maps", *place)["maps"]]

    def head(self, store, *more):
        return int(self.ask("stats", "--store", store, *more)["head_revision"])

    def poses_file(self, log):
        """The ground truth of the robot's poses, in EuRoC's columns."""
        return self.path(log, "mav0", "state_groundtruth_estimate0", "data.csv")

    def poses_made(self, name, rows_of):
        """The log's own poses as ROWS_OF makes them of a list of rows of cells."""
        with open(self.poses_file("sim/log"), encoding="utf-8") as f:
            lines = f.read().splitlines()
        rows = rows_of([line.split(",") for line in lines[1:] if line.strip()])
        with open(self.path(name), "w", encoding="utf-8") as f:
            f.write("\n".join([lines[0]] + [",".join(cells) for cells in rows]) + "\n")
        return name

    def sparse_poses(self, name):
        """A pose a second, none at the time of a frame: too far apart for any."""
        return self.poses_made(name, lambda rows: rows[150::200])

    def test_frames_lost_to_jumps_come_with_the_option_that_helps(self):
        def jump(rows):
            return [[c[0], str(float(c[1]) + 1000.0 * (i % 2))] + c[2:]
                    for i, c in enumerate(rows)]
        poses = self.poses_made("jumps.csv", jump)
        done = support.run("dsg-ingest", "--store", "jumps", "--map", "home", "--pose-file", poses,
                           "sim/log", cwd=self.folder)
        self.assertEqual(0, done.returncode, done.stderr)
        # The first has no other before it.
        self.assertIn("skipped: pose jump 19", done.stdout)
        self.assertIn("give poses without jumps with --pose-file", done.stderr)

    def test_a_log_whose_frames_are_all_lost_leaves_no_map(self):
        poses = self.sparse_poses("sparse.csv")
        said = self.refused(1, ["gives the map nothing", "no pose", "--pose-file"], "dsg-ingest",
                            "--store", "sparse", "--map", "home", "--pose-file", poses, "sim/log")
        self.assertIn('map "home" is not made', said)
        self.assertEqual([], self.maps("--store", "sparse"))
        self.assertEqual([], os.listdir(self.path("sparse")))

    def test_a_log_whose_frames_are_all_lost_does_not_harm_a_map_that_was_there(self):
        self.ok("dsg-ingest", "--store", "both", "--map", "home", "--no-layers", "sim/log")
        before = self.head("both")
        poses = self.sparse_poses("sparse2.csv")
        self.refused(1, ["gives the map nothing"], "dsg-ingest", "--store", "both", "--map",
                     "home", "--pose-file", poses, "sim/log")
        self.assertGreaterEqual(self.head("both"), before)

    def test_the_first_log_that_fails_pins_neither_name_nor_epoch_nor_codec(self):
        # No delta fits.
        self.refused(1, ["quota", 'map "office" is not made'], "dsg-ingest", "--store", "pin",
                     "--map", "office", "--epoch", "100", "--codec", "lossless", "--quota", "1",
                     self.small)
        self.assertEqual([], self.maps("--store", "pin"))
        self.ok("dsg-ingest", "--store", "pin", "--map", "office", "--epoch", "7", "--codec",
                "quantized", self.small)
        self.assertEqual("7", self.ask("stats", "--store", "pin")["map"].get("epoch_ns"))

    def test_what_an_earlier_log_of_the_run_has_brought_stays(self):
        done = support.run("dsg-ingest", "--store", "two", "--map", "home", self.small, "nowhere",
                           cwd=self.folder)
        self.assertNotEqual(0, done.returncode, done.stdout)
        self.assertIn("nowhere", done.stderr)
        self.assertGreater(self.head("two"), 0)

    def test_a_log_that_fails_late_says_what_of_it_stays(self):
        self.ok("dsg-ingest", "--store", "late", "--map", "home", self.small)
        before = self.head("late")
        with open(self.path("late.csv"), "w", encoding="utf-8") as f:
            f.write("time_s,id,x,y,z\n")
            for i in range(100):
                f.write(f"{0.1 * i:.1f},visitor,{0.05 * i:.2f},1,0\n")
            # Fifty years later: the clock was set while it ran.
            f.write("1600000000,visitor,5,1,0\n")
        late = ["--commit-poses", "10", "late.csv"]
        said = self.refused(1, ["check the clock", "keeps what was committed",
                                f"revisions {before + 1} to {before + 10}",
                                f"dsg revert {before}"],
                            "dsg-ingest", "--store", "late", "--map", "home", *late)
        self.assertNotIn("not made", said)
        self.assertEqual(before + 10, self.head("late"))
        self.ok("dsg", "revert", "--store", "late", str(before))
        self.assertEqual(0, int(self.ask("diff", "--store", "late", str(before),
                                         str(self.head("late"))).get("pose_count", 0)))
        # Nothing of it stays in a map that was made for it, and of a run in one piece.
        for commit in ["10", "100000"]:
            self.refused(1, ["check the clock", 'map "new" is not made'], "dsg-ingest", "--store",
                         "late", "--map", "new", "--commit-poses", commit, "late.csv")
        self.assertEqual(["home"], self.maps("--store", "late"))

    def test_a_run_that_is_interrupted_says_what_stays(self):
        with open(self.path("stopped.err"), "w+", encoding="utf-8") as err:
            running = support.start("dsg-ingest", "--store", "stopped", "--map", "home", "sim/log",
                                    cwd=self.folder, log=err)
            # The map is made at the first commit, with most of the log still to be read.
            support.wait_until(lambda: os.path.isdir(self.path("stopped")) and
                               os.listdir(self.path("stopped")), "the map")
            running.send_signal(signal.SIGINT)
            self.assertEqual(-signal.SIGINT, running.wait(support.TIMEOUT_S))
            err.seek(0)
            self.assertIn("interrupted; what is committed stays", err.read())

    def test_a_table_of_which_every_row_is_an_agent_is_refused(self):
        with open(self.path("many.csv"), "w", encoding="utf-8") as f:
            f.write("time_s,id,x,y,z\n")
            f.writelines(f"{0.1 * i:.1f},{i},1,1,0\n" for i in range(100_001))
        self.refused(1, ["100001 agents", "split it by time"], "dsg-ingest", "--store", "many",
                     "--map", "many", "many.csv")
        self.assertFalse(os.path.exists(self.path("many")))

    def test_through_a_server_a_log_that_gives_nothing_leaves_no_map_either(self):
        os.makedirs(self.path("served"))
        poses = self.sparse_poses("sparse3.csv")
        with self.server("served", "unix:h.sock"):
            self.refused(1, ["gives the map nothing", 'map "home" is not made'], "dsg-ingest",
                         "--server", "unix:h.sock", "--map", "home", "--pose-file", poses,
                         "sim/log")
            self.assertEqual([], self.maps("--server", "unix:h.sock"))
            self.assertEqual([], os.listdir(self.path("served")))

    def test_a_first_import_that_fails_leaves_no_map(self):
        graph = self.path("big.json")
        place = ord("p") << 56
        nodes = [{"id": place + i, "layer": 3, "partition": 0, "attributes": {
            "type": "PlaceNodeAttributes", "position": [i % 100, i // 100, 0]}}
            for i in range(20000)]
        with open(graph, "w", encoding="utf-8") as f:
            json.dump({"nodes": nodes, "edges": []}, f)
        done = support.run("bash", "-c", f"trap '' XFSZ; ulimit -f {FILE_BLOCKS_MAX}; exec \"$@\"",
                           "bash", "dsg", "import", graph, "--store", "imported", "--map", "lab",
                           cwd=self.folder)
        self.assertNotEqual(0, done.returncode, done.stdout)
        self.assertIn("graph.db", done.stderr)
        self.assertEqual([], self.maps("--store", "imported"))

    def test_drop_and_rename_through_a_server_that_serves_the_map(self):
        self.ingest("served2", self.small)
        address = "unix:d.sock"
        agent = support.read_rows(self.path(self.small, "tracks.csv"))[0]["agent"]
        with self.server("served2", address):
            before = self.ask("track", agent, "--server", address, "--map", "office")["poses"]
            # From now on the server holds the map's lock.
            self.ok("dsg", "tag", "now", "--server", address, "--map", "office")
            self.refused(3, ["WRITER_LOCKED"], "dsg", "drop", "office", "--yes", "--store",
                         "served2")
            self.ok("dsg", "rename", "office", "wing", "--server", address)
            self.assertEqual(["wing"], self.maps("--server", address))
            self.assertEqual(before,
                             self.ask("track", agent, "--server", address, "--map",
                                      "wing")["poses"])
            self.refused(1, ["MAP_UNKNOWN"], "dsg", "stats", "--server", address, "--map", "office")
            self.refused(2, ["--yes"], "dsg", "drop", "wing", "--server", address)
            self.ok("dsg", "drop", "wing", "--yes", "--server", address)
            self.assertEqual([], self.maps("--server", address))
            self.assertEqual([], os.listdir(self.path("served2")))
            # The name is free, for the same log too.
            self.ok("dsg-ingest", "--server", address, "--map", "office", self.small)

    def test_what_a_person_sets_survives_the_same_log(self):
        self.ingest("named", self.small)
        room = self.ask("ls", "--store", "named", "--kind", "room")["nodes"][0]["id"]
        self.ok("dsg", "set", room, "--name", "my room", "--class", "lab", "--store", "named")
        head = self.head("named")
        self.ingest("named", self.small)
        self.assertEqual(head, self.head("named"))
        node = self.ask("show", "my room", "--store", "named")["node"]
        self.assertEqual(room, node["id"])
        self.assertEqual("lab", node["semantic_class"]["name"])
        log = self.ok("dsg", "log", "--store", "named", "--limit", "1")
        self.assertIn("dsg set", log)


if __name__ == "__main__":
    unittest.main()
