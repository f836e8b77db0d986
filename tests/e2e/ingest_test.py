#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What ingest promises: once is enough, one writer only, bad logs change nothing."""

import contextlib
import os
import signal
import sqlite3
import unittest

import support


class Ingest(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small = cls.simulate("small", people=3, seconds=60)

    def head(self, store, *more):
        return int(self.ask("stats", "--store", store, *more)["head_revision"])

    def test_the_same_log_again_adds_no_revision(self):
        self.ingest("again", self.small)
        before = self.ok("dsg", "log", "--store", "again", "--json")

        self.ingest("again", self.small)

        self.assertEqual(before, self.ok("dsg", "log", "--store", "again", "--json"))

    def answer(self, *question):
        return support.without_incarnation(self.ok("dsg", *question, "--json"))

    def test_two_stores_of_one_log_answer_alike(self):
        self.ingest("left", self.small)
        self.ingest("right", self.small)
        agent = support.read_rows(self.path(self.small, "tracks.csv"))[0]["agent"]
        for question in (["track", agent], ["ls"], ["who", "--room", "kitchen"]):
            self.assertEqual(self.answer(*question, "--store", "left"),
                             self.answer(*question, "--store", "right"))

    def test_through_a_server_is_as_good_as_into_a_store(self):
        self.ingest("direct", self.small)
        os.makedirs(self.path("served"))
        with self.server("served", "unix:w.sock"):
            self.ok("dsg-ingest", "--server", "unix:w.sock", "--map", "office", self.small)
            self.ok("dsg-ingest", "--server", "unix:w.sock", "--map", "office", self.small)
        agent = support.read_rows(self.path(self.small, "tracks.csv"))[0]["agent"]
        self.assertEqual(self.answer("track", agent, "--store", "direct"),
                         self.answer("track", agent, "--store", "served"))
        self.assertEqual(self.head("direct"), self.head("served"))

    def test_a_past_revision_answers_as_it_did_then(self):
        self.ingest("past", self.small)
        agent = support.read_rows(self.path(self.small, "tracks.csv"))[0]["agent"]
        head = self.head("past")
        then = self.ask("track", agent, "--store", "past")["poses"]
        later = self.simulate("later", people=2, seconds=60)
        self.ok("dsg-ingest", "--store", "past", "--map", "office", "--agent-prefix", "b",
                later)
        self.assertGreater(self.head("past"), head)
        self.assertEqual(then, self.ask("track", agent, "--store", "past", "--revision",
                                        head)["poses"])
        self.refused(1, ["dsg: "], "dsg", "track", "b" + agent, "--store", "past", "--revision",
                     head)

    def test_a_second_writer_is_refused_while_readers_go_on(self):
        large = self.simulate("large", people=60, seconds=900)
        first = support.start("dsg-ingest", "--store", "shared", "--map", "office", large,
                              cwd=self.folder)
        try:
            support.wait_until(lambda: self.has_a_revision("shared") or first.poll() is not None,
                               "the first revision")
            first.send_signal(signal.SIGSTOP)
            self.assertIsNone(first.poll(), "the first writer ended too early for this test")
            said = self.refused(3, ["UNAVAILABLE"], "dsg-ingest", "--store", "shared", "--map",
                                "office", self.small)
            self.assertIn(str(first.pid), said)
            self.assertGreater(self.head("shared"), 0)
            first.send_signal(signal.SIGCONT)
            self.assertEqual(0, first.wait(timeout=support.TIMEOUT_S))
        finally:
            first.kill()
            first.wait()

    def has_a_revision(self, store):
        done = support.run("dsg", "log", "--store", store, "--limit", "1", cwd=self.folder)
        return done.returncode == 0 and done.stdout.count("\n") > 1

    def test_bad_logs_are_named_and_change_nothing(self):
        self.ingest("kept", self.small)
        before = self.ok("dsg", "log", "--store", "kept", "--json")
        with open(self.path(self.small, "tracks.csv"), encoding="utf-8") as f:
            lines = f.read().split("\n")
        cases = {
            "empty": [],
            "cut": lines[:40] + [lines[40][:11]],
            "backward": lines[:1] + lines[1:60][::-1],
            "nan": lines[:10] + [lines[10].replace(lines[10].split(",")[3], "nan")],
            "columns": [lines[0] + ",mood"] + lines[1:20],
        }
        for name, content in cases.items():
            with self.subTest(name):
                os.makedirs(self.path(name))
                with open(self.path(name, "tracks.csv"), "w", encoding="utf-8") as f:
                    f.write("\n".join(content))
                self.refused(1, ["tracks.csv"], "dsg-ingest", "--store", "kept", "--map",
                             "office", "--agent-prefix", name, name)
                self.assertEqual(before, self.ok("dsg", "log", "--store", "kept", "--json"))

    def test_bad_names_and_missing_paths_are_refused(self):
        self.refused(2, ["../x"], "dsg-ingest", "--store", "s", "--map", "../x", self.small)
        self.assertFalse(os.path.exists(self.path("x")))
        done = support.run("dsg-ingest", "--store", "s", "--map", "office", "nowhere",
                           cwd=self.folder)
        self.assertNotEqual(0, done.returncode)
        self.assertIn("nowhere", done.stderr)

    def test_a_newer_format_is_refused_and_left_alone(self):
        self.ingest("newer", self.small)
        path = self.path("newer", "office", "graph.db")
        with contextlib.closing(sqlite3.connect(path)) as database:
            database.execute("PRAGMA user_version = 99")
        with open(path, "rb") as f:
            before = f.read()
        self.refused(2, ["99", "FORMAT_TOO_NEW"], "dsg", "stats", "--store", "newer", "--map",
                     "office")
        self.refused(1, ["99"], "dsg-ingest", "--store", "newer", "--map", "office", self.small)
        with open(path, "rb") as f:
            self.assertEqual(before, f.read())

    def test_a_flipped_byte_is_found_and_never_served(self):
        self.ingest("flipped", self.small)
        self.ok("dsg", "verify", "--store", "flipped")
        path = self.path("flipped", "office", "graph.db")
        with contextlib.closing(sqlite3.connect(path)) as database:
            slot, payload = database.execute(
                "SELECT id >> 42, payload FROM trajectory_segment ORDER BY id LIMIT 1").fetchone()
            key, = database.execute("SELECT agent FROM track WHERE slot = ?", (slot,)).fetchone()
        with open(path, "r+b") as f:
            at = f.read().index(payload[:100]) + 60
            f.seek(at)
            f.write(bytes([payload[60] ^ 0x10]))
        agent = f"{chr(key & 255)}{key >> 8}"
        self.refused(4, ["trajectory_segment"], "dsg", "track", agent, "--store", "flipped")
        done = support.run("dsg", "verify", "--store", "flipped", cwd=self.folder)
        self.assertEqual(4, done.returncode, done.stdout + done.stderr)
        self.assertIn("trajectory_segment", done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
