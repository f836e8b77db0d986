#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From a generated log to answers: the truth is met, and store and server say the same bytes."""

import bisect
import math
import unittest

import support

# Five times the simulator's noise on each axis, and the sag of a curve between two samples.
MAX_ERROR_M = 0.15
MEAN_ERROR_M = 0.06
# Shorter visits may be swallowed by the hysteresis at the walls.
LONG_VISIT_NS = 6 * support.NS_PER_S


def truth_by_agent(path):
    tracks = {}
    for row in support.read_rows(path):
        tracks.setdefault(row["agent"], []).append(
            (int(row["time_ns"]), [float(row[axis]) for axis in "xyz"]))
    return tracks


def position_at(track, time_ns):
    """Linear between the true positions; None outside."""
    after = bisect.bisect_left(track, (time_ns,))
    if after == len(track) or (after == 0 and track[0][0] != time_ns):
        return None
    if after == 0 or track[after][0] == time_ns:
        return track[after][1]
    (t0, p0), (t1, p1) = track[after - 1], track[after]
    part = (time_ns - t0) / (t1 - t0)
    return [a + part * (b - a) for a, b in zip(p0, p1)]


class Answers(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=6, seconds=120))
        cls.common = ["--store", "store", "--map", "office"]
        cls.truth = truth_by_agent(cls.path("office", "truth", "tracks.csv"))
        cls.epoch_ns = int(cls.ask("maps", "--store", "store")["maps"][0]["epoch_ns"])

    def test_files_from_store_and_server_are_the_same(self):
        def files(place, *where):
            options = []
            for option, name in (("--ply", "m.ply"), ("--graph-ply", "g.ply"),
                                 ("--gltf", "a.glb")):
                options += [option, f"{place}-{name}"]
            self.ok("dsg", "export", *options, *where, "--map", "office")
            self.ok("dsg", "map", "--png", f"{place}-a.png", *where, "--map", "office")
            content = []
            for name in ("m.ply", "g.ply", "a.glb", "a.png"):
                with open(self.path(f"{place}-{name}"), "rb") as file:
                    content.append(file.read())
            return content

        local = files("store", "--store", "store")
        with self.server("store", "unix:dsg.sock"):
            self.assertEqual(local, files("server", "--server", "unix:dsg.sock"))

    def test_store_and_server_answer_with_the_same_bytes(self):
        agent = sorted(self.truth)[0]
        questions = [["where", agent, "--at", "+30s"], ["where", agent, "--at", "+61.25s"],
                     ["track", agent], ["track", agent, "--from", "+10s", "--to", "+20s"],
                     ["track", agent, "--every", "0.5s"],
                     ["who", "--room", "kitchen", "--from", "+0s", "--to", "+120s"],
                     ["who", "--box", "0,0,-1,8,8,3", "--from", "+0s", "--to", "+60s"],
                     ["ls"], ["ls", "--kind", "room"], ["log"], ["stats"],
                     ["met", "--line-of-sight"], ["met", "--for", "2s", "--within", "1"],
                     ["picked", "--all"], ["predict", agent, "--at", "+60s"],
                     ["find", "cup on table", "--explain"], ["find", "chair in kitchen"],
                     ["path", agent, "nearest fridge", "--at", "+30s", "--check"],
                     ["near", "3,2,0", "--k", "9"], ["around", "R0"], ["subgraph", "R0"],
                     ["diff", "0", "1"]]
        with self.server("store", "unix:dsg.sock"):
            for question in questions:
                with self.subTest(question=question):
                    local = self.ok("dsg", *question, *self.common, "--json")
                    remote = self.ok("dsg", *question, "--server", "unix:dsg.sock", "--map",
                                     "office", "--json")
                    self.assertEqual(local, remote)
                    self.assertGreater(len(local), 20)

    def test_errors_are_the_same_from_store_and_server(self):
        with self.server("store", "unix:dsg.sock"):
            for question in (["where", "nobody", "--at", "+30s"],
                             ["where", sorted(self.truth)[0], "--at", "+3000s"],
                             ["show", "R99"], ["stats", "--revision", "99"]):
                with self.subTest(question=question):
                    local = self.refused(1, ["dsg: "], "dsg", *question, *self.common)
                    remote = self.refused(1, ["dsg: "], "dsg", *question, "--server",
                                          "unix:dsg.sock", "--map", "office")
                    self.assertEqual(local, remote)

    def test_tracks_follow_the_truth_within_the_noise(self):
        errors = []
        for agent, track in self.truth.items():
            reply = self.ask("track", agent, "--every", "1s", *self.common)
            for pose in reply["poses"]:
                true = position_at(track, int(pose["time_ns"]) - self.epoch_ns)
                self.assertIsNotNone(true, f"{agent} at {pose['time_ns']} was not there")
                said = pose["pose"]["position"]
                errors.append(math.dist(true, [said.get(axis, 0.0) for axis in "xyz"]))
        self.assertGreater(len(errors), 60 * len(self.truth))
        self.assertLess(max(errors), MAX_ERROR_M)
        self.assertLess(sum(errors) / len(errors), MEAN_ERROR_M)

    def test_presence_in_all_rooms_agrees_with_where(self):
        rooms = [n["id"] for n in self.ask("ls", "--kind", "room", *self.common)["nodes"]]
        self.assertGreater(len(rooms), 5)
        checked = 0
        for room in rooms:
            for stay in self.ask("who", "--room", room, "--from", "+0s", "--to", "+120s",
                                 *self.common)["intervals"]:
                enter_ns, exit_ns = int(stay["enter_ns"]), int(stay["exit_ns"])
                self.assertLess(enter_ns, exit_ns)
                place = self.ask("where", stay["agent_id"], "--at",
                                 f"{(enter_ns + exit_ns) // 2}ns", *self.common)
                self.assertEqual(room, place["room_id"])
                checked += 1
        self.assertGreater(checked, len(self.truth))

    def test_rooms_agree_with_the_truth_away_from_doors(self):
        checked = 0
        for visit in support.read_rows(self.path("office", "truth", "presence.csv")):
            enter_ns, exit_ns = int(visit["enter_ns"]), int(visit["exit_ns"])
            if exit_ns - enter_ns < LONG_VISIT_NS:
                continue
            place = self.ask("where", visit["agent"], "--at",
                             support.at((enter_ns + exit_ns) // 2), *self.common)
            if place["quality"] == "IN_GAP":
                continue
            self.assertEqual(visit["room_id"], place["room_id"], str(visit))
            checked += 1
        self.assertGreater(checked, len(self.truth))

    def test_stats_count_what_the_log_holds(self):
        rows = support.read_rows(self.path("office", "log", "tracks.csv"))
        stats = self.ask("stats", *self.common)
        self.assertEqual(len(rows), int(stats["pose_count"]))
        self.assertEqual(len({row["agent"] for row in rows}), int(stats["agent_count"]))
        self.assertGreater(int(stats["head_revision"]), 0)
        self.assertEqual(int(stats["node_count"]),
                         sum(int(layer["node_count"]) for layer in stats["layers"]))


if __name__ == "__main__":
    unittest.main()
