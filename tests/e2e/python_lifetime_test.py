#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A private server lives as long as the Python process that opened the folder, and not longer."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
from unittest import mock

import python_support
import support

import dsgdb

OPEN_AND_SAY = """
import sys, time
import dsgdb
db = dsgdb.open(sys.argv[1])
print(db._server._process.pid, db._server.folder, db.maps(), flush=True)
{}
"""


def is_running(pid):
    """A zombie is none: who waits for it is not our affair."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as f:
            return f.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


class Lifetime(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=3, seconds=60))

    def start(self, rest):
        """A process that opens the store: the process, its server and the folder of that."""
        environment = dict(os.environ, PYTHONPATH=python_support.PACKAGE)
        process = subprocess.Popen([sys.executable, "-c", OPEN_AND_SAY.format(rest),
                                    self.path("store")], env=environment, text=True,
                                   stdout=subprocess.PIPE)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        pid, folder, maps = process.stdout.readline().split()
        self.assertEqual("['office']", maps)
        return process, int(pid), folder

    def expect_gone(self, pid, folder):
        support.wait_until(lambda: not is_running(pid), "the private server to end")
        support.wait_until(lambda: not os.path.exists(folder), "its folder to go")

    def test_close_ends_it(self):
        db = dsgdb.open(self.path("store"))
        pid, folder = db._server._process.pid, db._server.folder
        self.assertEqual(0o700, os.stat(folder).st_mode & 0o777)
        self.assertEqual(["office"], db.maps())
        db.close()
        self.assertFalse(is_running(pid))
        self.assertFalse(os.path.exists(folder))
        db.close()
        with self.assertRaises(dsgdb.FailedPrecondition):
            db.maps()

    def test_the_end_of_the_process_ends_it(self):
        process, pid, folder = self.start("")
        self.assertEqual(0, process.wait(support.TIMEOUT_S))
        self.expect_gone(pid, folder)

    def test_a_killed_process_ends_it(self):
        process, pid, folder = self.start("time.sleep(600)")
        self.assertTrue(is_running(pid))
        process.kill()
        self.expect_gone(pid, folder)

    def test_an_interrupted_process_ends_it(self):
        process, pid, folder = self.start("""
try:
    time.sleep(600)
except KeyboardInterrupt:
    pass
""")
        process.send_signal(signal.SIGINT)
        self.expect_gone(pid, folder)

    def test_it_outlives_the_thread_that_opened_it(self):
        opened = []
        thread = threading.Thread(target=lambda: opened.append(dsgdb.open(self.path("store"))))
        thread.start()
        thread.join()
        with opened[0] as db:
            self.assertEqual(["office"], db.maps())

    def test_a_forked_child_asks_and_leaves_it_alone(self):
        process, pid, folder = self.start("""
import os
for _ in range(3):
    child = os.fork()
    if child == 0:
        assert db.maps() == ["office"]
        db.close()
        sys.exit(0)
    assert os.waitpid(child, 0)[1] == 0
print(db.maps(), flush=True)
time.sleep(600)
""")
        self.assertEqual("['office']\n", process.stdout.readline())
        self.assertTrue(is_running(pid))
        process.kill()
        self.expect_gone(pid, folder)

    def test_close_does_not_wait_for_forked_children(self):
        process, pid, folder = self.start("""
import os
child = os.fork()
if child == 0:
    time.sleep(600)
db.close()
print(child, flush=True)
time.sleep(600)
""")
        child = int(process.stdout.readline())
        try:
            self.expect_gone(pid, folder)
        finally:
            os.kill(child, signal.SIGKILL)

    def test_a_server_that_died_is_named(self):
        with dsgdb.open(self.path("store")) as db:
            self.assertEqual(["office"], db.maps())
            os.kill(db._server._process.pid, signal.SIGKILL)
            db._server._process.wait()
            with self.assertRaises(dsgdb.Unavailable) as caught:
                db.maps()
            self.assertIn("has ended with status -9", str(caught.exception))
            self.assertIn(self.path("store"), str(caught.exception))

    def test_what_cannot_start_is_said(self):
        with self.assertRaises(dsgdb.NotFound) as caught:
            dsgdb.open(self.path("elsewhere"))
        self.assertIn(self.path("elsewhere"), str(caught.exception))
        self.assertFalse(os.path.exists(self.path("elsewhere")))
        for change, words in (({"DSGDB_SERVER": self.path("no-program")}, "DSGDB_SERVER"),
                              ({"DSGDB_SERVER": "", "PATH": self.folder}, "not on PATH")):
            with mock.patch.dict(os.environ, change), self.assertRaises(dsgdb.NotFound) as caught:
                dsgdb.open(self.path("store"))
            self.assertIn(words, str(caught.exception))
        os.mkdir(self.path("tmp"))
        with mock.patch.object(tempfile, "tempdir", self.path("tmp")), \
                mock.patch.dict(os.environ, {"DSGDB_SERVER": os.path.join(support.BIN, "dsg")}), \
                self.assertRaises(dsgdb.FailedPrecondition) as caught:
            dsgdb.open(self.path("store"))
        self.assertIn("did not start", str(caught.exception))
        self.assertIn("it said: dsg: options come after the verb", str(caught.exception))
        self.assertEqual([], os.listdir(self.path("tmp")))


if __name__ == "__main__":
    unittest.main()
