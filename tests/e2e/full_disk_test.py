#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A disk that fills under a server and a robot: nothing is lost, and forgetting makes room again.

Needs root and a file system of its own (a small tmpfs in a mount namespace); skipped otherwise.
"""

import json
import os
import subprocess
import sys
import unittest

import support

# A reserve of 16 MiB is made where four times as much is free.
DISK_MIB = 128
LEFT_MIB = 3
INSIDE = "DSG_INSIDE_NAMESPACE"


def may_mount():
    """Whether this process may make a mount namespace and a tmpfs in it."""
    tried = subprocess.run(["unshare", "-m", "true"], capture_output=True, check=False)
    return os.geteuid() == 0 and tried.returncode == 0


class FullDisk(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.disk = cls.path("disk")
        os.mkdir(cls.disk)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", cls.disk],
                       check=True)
        cls.addClassCleanup(subprocess.run, ["umount", "-l", cls.disk], check=False)
        cls.short = cls.simulate("short", people=4, seconds=60)
        # More than fits into what will be left.
        cls.long = cls.simulate("long", people=60, seconds=900)
        cls.store = os.path.join(cls.disk, "store")
        cls.filler = os.path.join(cls.disk, "filler")
        cls.address = "unix:" + cls.path("s")

    def fill(self, left_bytes):
        disk = os.statvfs(self.disk)
        with open(self.filler, "ab") as f:
            f.write(b"\0" * max(0, disk.f_bavail * disk.f_bsize - left_bytes))

    def robot(self, log, prefix, *where):
        return ("dsg-ingest", *where, "--map", "office", "--agent-prefix", prefix,
                "--commit-poses", "2000", log)

    def database_bytes(self):
        """Of the database and its log."""
        return sum(os.path.getsize(os.path.join(self.store, "office", name))
                   for name in ("graph.db", "graph.db-wal"))

    def answers(self, *where):
        head = json.loads(self.ok("dsg", "stats", *where, "--map", "office", "--json"))
        told = [self.ok("dsg", *question, *where, "--map", "office", "--json")
                for question in (("ls", "--layer", "rooms"), ("where", "robot", "--at", "+30s"),
                                 ("who", "--room", "R1", "--to", "+1m"))]
        return head["head_revision"], [json.loads(text) for text in told]

    def sound(self):
        self.assertIn(" 0 problems",
                      self.ok("dsg", "verify", "--store", self.store, "--map", "office"))

    def test_a_full_disk_refuses_writes_answers_questions_and_can_be_forgotten_on(self):
        where = ("--server", self.address)
        with self.server(self.store, self.address):
            self.ok(*self.robot(self.short, "", *where))
            self.assertGreater(os.path.getsize(os.path.join(self.store, "office", "reserve")), 0)
            self.fill(LEFT_MIB << 20)
            said = self.refused(1, ["RESOURCE_EXHAUSTED", "it goes on where it stopped"],
                                *self.robot(self.long, "b-", *where))
            self.assertIn("prune", said)
            # Full to the last page, and still: questions are answered, writes are refused.
            self.fill(0)
            before = self.answers(*where)
            self.refused(1, ["RESOURCE_EXHAUSTED"], *self.robot(self.long, "b-", *where))
            self.assertEqual(before, self.answers(*where))
            self.forget(*where)
            os.remove(self.filler)
            # With room again the same command goes on where it stopped.
            self.ok(*self.robot(self.long, "b-", *where))
            self.assertIn("nothing new", self.ok(*self.robot(self.long, "b-", *where)))
        self.assertIn(" 0 problems",
                      self.ok("dsg", "verify", "--store", self.store, "--map", "office"))

    def forget(self, *where):
        """Must work without another byte of room, by means of the reserve."""
        size = self.database_bytes()
        head = int(self.answers(*where)[0])
        self.ok("dsg", "prune", *where, "--map", "office", "--layer", "objects", "--retire",
                "--yes")
        self.assertGreater(int(self.answers(*where)[0]), head)
        self.ok("dsg", "compact", *where, "--map", "office")
        self.assertLess(self.database_bytes(), size)


if __name__ == "__main__":
    if not may_mount():
        print("skipped: a small file system of one's own needs root and mount namespaces")
    elif INSIDE not in os.environ:
        sys.exit(subprocess.run(["unshare", "-m", sys.executable, __file__],
                                env={**os.environ, INSIDE: "1"}, check=False).returncode)
    else:
        unittest.main()
