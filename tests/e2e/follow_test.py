#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A log that is read while it is written: seen soon, stopped and taken up, the same in the end."""

import contextlib
import json
import os
import signal
import struct
import subprocess
import time
import unittest

import support

HEADER = "time,id,x,y\n"
EPOCH_S = 1_600_000_000
# How late a pose may be seen after it was appended.
LATE_S_MAX = 5.0


def rows(first, last):
    return "".join(f"{EPOCH_S + i}.5,{name},{i * 0.25},{y}\n"
                   for i in range(first, last) for name, y in (("bob", 1), ("alice", 2)))


def text(string):
    encoded = string.encode()
    return struct.pack("<I", len(encoded)) + encoded


def record(kind, content):
    return struct.pack("<BQ", kind, len(content)) + content


def recording_head():
    """An MCAP file without chunks, up to its first message: /tf of ROS 2."""
    return (b"\x89MCAP0\r\n" + record(1, text("ros2") + text("test")) +
            record(3, struct.pack("<H", 1) + text("tf2_msgs/msg/TFMessage") + text("ros2msg") +
                   text("")) +
            record(4, struct.pack("<HH", 1, 1) + text("/tf") + text("cdr") + text("")))


def transform(parent, child, second, x):
    """One message: `child` is `x` metres ahead in `parent`."""
    body = struct.pack("<III", 1, EPOCH_S + second, support.NS_PER_S // 2)
    for frame in (parent, child):
        body += b"\0" * (-len(body) % 4) + text(frame + "\0")
    body += b"\0" * (-len(body) % 8) + struct.pack("<7d", x, 0, 0, 0, 0, 0, 1)
    log_ns = (EPOCH_S + second) * support.NS_PER_S + support.NS_PER_S // 2
    head = struct.pack("<HIQQ", 1, second, log_ns, log_ns)
    return record(5, head + b"\x00\x01\x00\x00" + body)


def drive(first, last):
    """The robot drives in the odometry, which is a tenth of a metre off in the map."""
    return b"".join(transform("map", "odom", s, 0.1) + transform("odom", "base_link", s, s * 0.25)
                    for s in range(first, last))


class Follow(support.ProgramsTest):
    def append(self, name, text):
        with open(self.path(name), "a", encoding="utf-8") as f:
            f.write(text)

    def append_bytes(self, name, data):
        with open(self.path(name), "ab") as f:
            f.write(data)

    def poses_so_far(self, store, agent):
        """Empty while there is no map, or no such agent."""
        done = support.run("dsg", "track", agent, "--store", store, "--map", "m", "--json",
                           cwd=self.folder)
        return json.loads(done.stdout)["poses"] if done.returncode == 0 else []

    def follow(self, store, log, *more):
        return support.start("dsg-ingest", "--store", store, "--map", "m", "--quiet", "--follow",
                             log, *more, cwd=self.folder)

    @contextlib.contextmanager
    def following(self, *arguments):
        process = self.follow(*arguments)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()
            process.wait()

    def sees(self, store, agent, second):
        done = support.run("dsg", "where", agent, "--store", store, "--map", "m", "--at",
                           (EPOCH_S + second) * support.NS_PER_S + support.NS_PER_S // 2, "--json",
                           cwd=self.folder)
        if done.returncode != 0:
            return False
        pose = json.loads(done.stdout).get("pose")
        return pose is not None and abs(pose["position"]["x"] - second * 0.25) < 1e-3

    def answers(self, store):
        return [self.poses(store, agent) for agent in ("alice", "bob")]

    def poses(self, store, agent):
        return self.ask("track", agent, "--store", store, "--map", "m")["poses"]

    def stop(self, process, number=signal.SIGINT):
        process.send_signal(number)
        return process.wait(timeout=support.TIMEOUT_S)

    def test_what_is_appended_is_seen_within_seconds(self):
        self.append("live.csv", HEADER + rows(0, 3))
        with self.following("live", "live.csv") as process:
            support.wait_until(lambda: self.sees("live", "alice", 2), "the first rows")
            for second in range(3, 6):
                self.append("live.csv", rows(second, second + 1))
                begin = time.monotonic()
                support.wait_until(lambda s=second: self.sees("live", "alice", s), "a pose")
                self.assertLess(time.monotonic() - begin, LATE_S_MAX)
            # A row without its end is none.
            self.append("live.csv", f"{EPOCH_S + 6}.5,alice,1.")
            time.sleep(2)
            self.assertEqual(6, len(self.poses("live", "alice")))
            self.append("live.csv", "5,2\n")
            support.wait_until(lambda: self.sees("live", "alice", 6), "the rest of a row")
            self.assertEqual(0, self.stop(process))

    def test_a_log_that_was_stopped_or_killed_goes_on(self):
        self.append("cut.csv", HEADER + rows(0, 4))
        for step, number in enumerate((signal.SIGINT, signal.SIGKILL, signal.SIGTERM)):
            last = 4 * (step + 1)
            with self.following("cut", "cut.csv") as process:
                support.wait_until(lambda s=last: self.sees("cut", "bob", s - 1), "poses")
                status = self.stop(process, number)
            self.assertEqual(-signal.SIGKILL if number == signal.SIGKILL else 0, status)
            self.append("cut.csv", rows(last, last + 4))
        end = ["dsg-ingest", "--store", "cut", "--map", "m", "--follow", "--follow-timeout", "0",
               "cut.csv"]
        self.ok(*end)
        head = self.ask("stats", "--store", "cut", "--map", "m")["head_revision"]
        self.ok(*end)
        self.assertEqual(head, self.ask("stats", "--store", "cut", "--map", "m")["head_revision"])
        self.ok("dsg-ingest", "--store", "whole", "--map", "m", "cut.csv")
        self.assertEqual(self.answers("whole"), self.answers("cut"))
        self.assertEqual(16, len(self.answers("cut")[0]))
        # The finished file, taken as a whole, adds nothing either.
        self.ok("dsg-ingest", "--store", "cut", "--map", "m", "cut.csv")
        self.assertEqual(head, self.ask("stats", "--store", "cut", "--map", "m")["head_revision"])

    def test_through_a_server_it_goes_on_too(self):
        self.append("served.csv", HEADER + rows(0, 5))
        os.makedirs(self.path("served"))
        with self.server("served", "unix:f.sock"):
            for last in (5, 9):
                process = support.start("dsg-ingest", "--server", "unix:f.sock", "--map", "m",
                                        "--follow", "served.csv", cwd=self.folder)
                try:
                    support.wait_until(lambda s=last: self.sees("served", "alice", s - 1), "poses")
                    self.assertEqual(0, self.stop(process, signal.SIGTERM))
                finally:
                    process.kill()
                    process.wait()
                self.append("served.csv", rows(last, last + 4))
        self.assertEqual(9, len(self.poses("served", "alice")))

    def test_it_ends_by_itself_when_told_to(self):
        self.append("timed.csv", HEADER + rows(0, 3))
        begin = time.monotonic()
        self.ok("dsg-ingest", "--store", "timed", "--map", "m", "--follow", "--follow-timeout",
                "1.5", "timed.csv")
        self.assertGreater(time.monotonic() - begin, 1.4)
        self.assertEqual(3, len(self.poses("timed", "alice")))

    def test_a_file_that_changes_otherwise_is_refused_and_its_poses_stay(self):
        self.append("shrunk.csv", HEADER + rows(0, 8))
        with open(self.path("log"), "w+", encoding="utf-8") as log:
            process = subprocess.Popen(
                ["dsg-ingest", "--store", "shrunk", "--map", "m", "--follow", "shrunk.csv"],
                cwd=self.folder, env=support.environment(), stdin=subprocess.DEVNULL, stdout=log,
                stderr=log)
            try:
                support.wait_until(lambda: self.sees("shrunk", "alice", 7), "poses")
                os.truncate(self.path("shrunk.csv"), 40)
                self.assertEqual(1, process.wait(timeout=support.TIMEOUT_S))
            finally:
                process.kill()
                process.wait()
            log.seek(0)
            said = log.read()
        self.assertIn("has shrunk from", said)
        self.assertEqual(8, len(self.poses("shrunk", "alice")))

    def test_transforms_of_a_recording_are_seen_while_it_is_written(self):
        def robot_at(second, x):
            poses = [p for p in self.poses_so_far("bag", "body")
                     if int(p["time_ns"]) // support.NS_PER_S == EPOCH_S + second]
            return bool(poses) and abs(poses[0]["pose"]["position"]["x"] - x) < 1e-3

        self.append_bytes("drive.mcap", recording_head() + drive(0, 6))
        with open(self.path("log"), "w+", encoding="utf-8") as log:
            process = support.start("dsg-ingest", "--store", "bag", "--map", "m", "--follow",
                                    "--follow-timeout", "6", "drive.mcap", cwd=self.folder, log=log)
            try:
                support.wait_until(lambda: robot_at(5, 1.35), "the poses so far")
                self.append_bytes("drive.mcap", drive(6, 8))
                support.wait_until(lambda: robot_at(7, 1.85), "poses that were appended")
                # Space that is set aside, and of which nothing comes.
                self.append_bytes("drive.mcap", b"\0" * 5000)
                self.assertEqual(0, process.wait(timeout=support.TIMEOUT_S))
            finally:
                process.kill()
                process.wait()
            log.seek(0)
            said = log.read()
        size = os.path.getsize(self.path("drive.mcap"))
        rest = f"the 5000 bytes from byte {size - 5000} on are no whole record (zeros"
        self.assertEqual(2, said.count(rest), said)
        self.assertIn("waiting for what is to stand there", said)
        self.assertEqual(8, len(self.poses("bag", "body")))

    def test_what_cannot_be_followed_is_said(self):
        self.append("one.csv", HEADER + rows(0, 1))
        follow = ["dsg-ingest", "--store", "none", "--map", "m", "--follow"]
        self.refused(2, ["standard input"], *follow, "-")
        self.refused(2, ["is a folder"], *follow, ".")
        self.refused(2, ["takes one log"], *follow, "one.csv", "one.csv")
        self.refused(2, ["--follow"], "dsg-ingest", "--store", "none", "--map", "m",
                     "--follow-timeout", "1", "one.csv")
        self.assertFalse(os.path.exists(self.path("none")))


if __name__ == "__main__":
    unittest.main()
