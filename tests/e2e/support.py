# SPDX-License-Identifier: Apache-2.0
"""Runs the built programs the way their users do: processes, files, exit codes.

Knows nothing of what the programs are made of; takes their folder from DSG_BIN.
"""

import contextlib
import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

# Missing, it fails here: the tests are about programs that have been built, and build none.
BIN = os.environ["DSG_BIN"]
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TIMEOUT_S = 120
READY_TIMEOUT_S = 30
NS_PER_S = 1_000_000_000


def environment():
    """The environment without what a developer may have set for dsg."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("DSG_")}
    kept["PATH"] = BIN + os.pathsep + kept.get("PATH", "")
    return kept


def run(*command, cwd=None):
    return subprocess.run([str(c) for c in command], cwd=cwd, env=environment(), text=True,
                          capture_output=True, stdin=subprocess.DEVNULL, timeout=TIMEOUT_S,
                          check=False)


def start(*command, cwd=None, log=None):
    return subprocess.Popen([str(c) for c in command], cwd=cwd, env=environment(), text=True,
                            stdin=subprocess.DEVNULL, stdout=log or subprocess.DEVNULL,
                            stderr=log or subprocess.DEVNULL)


def wait_until(condition, what):
    """Asks again and again; an answer ends the wait, not the clock."""
    deadline = time.monotonic() + READY_TIMEOUT_S
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"waited {READY_TIMEOUT_S} s for {what}")
        time.sleep(0.02)


def at(time_ns):
    """A time relative to the map's epoch, as the command line takes it."""
    return f"+{time_ns // NS_PER_S}.{time_ns % NS_PER_S:09d}s"


def without_incarnation(text):
    """JSON of a reply without what tells one map from another with the same content."""
    return re.sub(r'"incarnation": "[^"]*"', '"incarnation": ""', text)


def read_rows(path):
    with open(path, encoding="utf-8", newline="") as f:
        return list(csv.DictReader(f))


def python_with_grpc():
    """Debian's packages belong to Debian's Python, which need not be the first on the path."""
    for python in (sys.executable, "/usr/bin/python3"):
        done = subprocess.run([python, "-c", "import grpc"], capture_output=True, check=False)
        if done.returncode == 0:
            return python
    raise AssertionError("no Python here knows grpc; install python3-grpcio and python3-protobuf")


class ProgramsTest(unittest.TestCase):
    """A folder of its own for each class, and helpers that fail with what the program said."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="dsg-e2e-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)

    @classmethod
    def path(cls, *names):
        return os.path.join(cls.folder, *names)

    @classmethod
    def ok(cls, *command):
        """Standard output of a command that must succeed."""
        done = run(*command, cwd=cls.folder)
        if done.returncode != 0:
            raise AssertionError(f"{command} exited {done.returncode}:\n{done.stdout}{done.stderr}")
        return done.stdout

    @classmethod
    def ask(cls, *command):
        """The JSON that a command of dsg prints."""
        return json.loads(cls.ok("dsg", *command, "--json"))

    def refused(self, code, words, *command):
        """The command must exit with `code` and say `words` on standard error."""
        done = run(*command, cwd=self.folder)
        self.assertEqual(code, done.returncode, f"{command}:\n{done.stdout}{done.stderr}")
        for word in words:
            self.assertIn(word, done.stderr)
        return done.stderr

    @classmethod
    def simulate(cls, name, people, seconds, seed=7):
        """Makes the folder NAME with log/ and truth/; returns the log, as a relative path."""
        cls.ok("dsg-simulate", "tracks", "--out", name, "--seed", seed, "--people", people,
               "--seconds", seconds)
        return os.path.join(name, "log")

    @classmethod
    def ingest(cls, store, log, map_name="office"):
        cls.ok("dsg-ingest", "--store", store, "--map", map_name, log)

    @classmethod
    @contextlib.contextmanager
    def server(cls, store, listen, *options):
        """A server that is ready; it must stop in order when asked to. Its log is server.log."""
        log_path = cls.path("server.log")
        with open(log_path, "w", encoding="utf-8") as log:
            process = start("dsg-server", "--store", store, "--listen", listen, *options,
                            cwd=cls.folder, log=log)
        try:
            wait_until(lambda: process.poll() is not None or run(
                "dsg", "version", "--server", listen, cwd=cls.folder).returncode == 0,
                       "dsg-server to answer")
            yield process
            process.send_signal(signal.SIGTERM)
            status = process.wait(timeout=TIMEOUT_S)
            if status != 0:
                with open(log_path, encoding="utf-8") as log:
                    raise AssertionError(f"dsg-server exited {status}:\n{log.read()}")
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
