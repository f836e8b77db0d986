#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Robots that send their logs over bad links: nothing is lost, nothing comes twice.

Four robots at once, each to a map of its own, through links that cut, reset, half-close, dribble,
swallow and refuse; robots and the server are killed meanwhile. DSG_HOLE_S is the length of a black
hole (2 by default), DSG_FAULTS the faults a robot (12), DSG_SEED repeats a run.
"""

import collections
import contextlib
import json
import os
import random
import signal
import subprocess
import threading
import time
import unittest

import chaos_proxy
import support

HOLE_S = float(os.environ.get("DSG_HOLE_S", "2"))
FAULT_COUNT = int(os.environ.get("DSG_FAULTS", "12"))
SEED = int(os.environ.get("DSG_SEED", "7"))
ROBOT_COUNT = 4
COMMIT_POSES = "40"


def ingest_command(log, map_name, *where):
    return ["dsg-ingest", *where, "--map", map_name, "--commit-poses", COMMIT_POSES, log]


def revisions_of(*where):
    """(session, sequence, digest) of every revision, oldest first."""
    done = support.run("dsg", "log", *where, "--json", "--limit", "1000000")
    if done.returncode != 0:
        raise AssertionError(f"dsg log {where}: {done.stderr}")
    listed = json.loads(done.stdout).get("revisions", [])
    return [(r["session_id"], int(r["sequence"]), r["digest"]) for r in reversed(listed)]


def duplicates_and_gaps(revisions):
    """Sequences that came twice, and sequences that are missing."""
    by_session = collections.defaultdict(list)
    for session, sequence, _ in revisions:
        by_session[session].append(sequence)
    duplicates = gaps = 0
    for sequences in by_session.values():
        duplicates += len(sequences) - len(set(sequences))
        gaps += len(set(range(1, max(sequences) + 1)) - set(sequences))
    return duplicates, gaps


class RestartableServer:
    """A server that can be killed and started again on the same address."""

    def __init__(self, folder, store, address):
        self.folder, self.store, self.address = folder, store, address
        self.log = os.path.join(folder, "links-server.log")
        self.process = None
        self.kill_count = 0
        self.start()

    def start(self):
        with open(self.log, "a", encoding="utf-8") as log:
            self.process = support.start("dsg-server", "--store", self.store, "--listen",
                                         self.address, cwd=self.folder, log=log)
        support.wait_until(lambda: self.process.poll() is not None or support.run(
            "dsg", "version", "--server", self.address).returncode == 0, "dsg-server to answer")

    def kill_and_restart(self):
        self.process.kill()
        self.process.wait()
        self.kill_count += 1
        self.start()

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(timeout=support.TIMEOUT_S)
        if status != 0:
            raise AssertionError(f"dsg-server exited {status}")


class Robot(threading.Thread):
    """Sends one log until it is through; its link and its process misbehave by a seeded plan."""

    def __init__(self, number, log, folder, server_address):
        super().__init__(daemon=True)
        self.map_name = f"robot{number}"
        self.log, self.folder = log, folder
        self.random = random.Random(SEED * 1000 + number)
        self.proxy = chaos_proxy.ChaosProxy(server_address)
        self.notes_path = os.path.join(folder, f"{self.map_name}.err")
        self.kill_count = self.start_count = 0
        self.exit_code = None
        self.error = None

    def launch(self):
        self.start_count += 1
        with open(self.notes_path, "a", encoding="utf-8") as notes:
            return subprocess.Popen(
                ingest_command(self.log, self.map_name, "--server", self.proxy.address,
                               "--retry-for", "5m"),
                env=support.environment(), cwd=self.folder, stdin=subprocess.DEVNULL,
                stdout=notes, stderr=notes)

    def misbehave(self, process):
        """Faults until they are used up or the program has ended; the program that runs then."""
        holes = 1
        for _ in range(FAULT_COUNT):
            time.sleep(self.random.uniform(0.02, 0.3))
            if process.poll() is not None:
                break
            name = self.random.choice(chaos_proxy.ChaosProxy.FAULTS + ("kill",))
            if name == "kill":
                process.kill()
                process.wait()
                self.kill_count += 1
                process = self.launch()
            elif name == "black_hole":
                self.proxy.fault(name, HOLE_S if holes > 0 else 0.3, self.random)
                holes -= 1
            else:
                self.proxy.fault(name, 0.4, self.random)
        return process

    def run(self):
        try:
            process = self.misbehave(self.launch())
            self.exit_code = process.wait(timeout=600)
        except Exception as error:  # pylint: disable=broad-except
            self.error = error
        finally:
            self.proxy.close()

    def notes(self):
        with open(self.notes_path, encoding="utf-8") as f:
            return f.read()


class Links(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        print(f"seed {SEED}, black holes of {HOLE_S:g} s")
        cls.logs = [
            os.path.join(cls.folder, cls.simulate(f"log{i}", people=8, seconds=240, seed=i))
            for i in range(1, ROBOT_COUNT + 1)
        ]

    def local_digests(self, number):
        store = self.path("local")
        name = f"robot{number}"
        self.ok(*ingest_command(self.logs[number - 1], name, "--store", store))
        return revisions_of("--store", store, "--map", name)

    def test_four_robots_lose_nothing_over_bad_links(self):
        server = RestartableServer(self.folder, self.path("remote"), "unix:" + self.path("s"))
        robots = [Robot(i + 1, log, self.folder, server.address)
                  for i, log in enumerate(self.logs)]
        for robot in robots:
            robot.start()
        rng = random.Random(SEED)
        while any(robot.is_alive() for robot in robots):
            time.sleep(rng.uniform(0.5, 3.0))
            if server.kill_count < 3 and any(robot.is_alive() for robot in robots):
                server.kill_and_restart()
        faults = collections.Counter()
        for number, robot in enumerate(robots, 1):
            if robot.error is not None:
                raise robot.error
            self.assertEqual(0, robot.exit_code, robot.notes())
            found = revisions_of("--server", server.address, "--map", robot.map_name)
            duplicates, gaps = duplicates_and_gaps(found)
            self.assertEqual((0, 0), (duplicates, gaps))
            self.assertEqual(self.local_digests(number), found,
                             f"{robot.map_name} holds something else than a local ingest")
            faults.update(robot.proxy.counts)
            faults["robot killed"] += robot.kill_count
        faults["server killed"] = server.kill_count
        server.stop()
        for robot in robots:
            self.assertIn(" 0 problems", self.ok("dsg", "verify", "--store", self.path("remote"),
                                                 "--map", robot.map_name))
        told = ", ".join(f"{name} {count}" for name, count in sorted(faults.items()))
        print(f"4 robots, {sum(faults.values())} faults ({told}): 0 duplicates, 0 gaps, content "
              "equal to that of local ingests")
        self.assertGreater(sum(faults.values()), FAULT_COUNT)

    def test_says_at_once_what_it_waits_for_and_goes_on_when_the_server_comes(self):
        address = "unix:" + self.path("late")
        notes_path = self.path("late.err")
        with open(notes_path, "w", encoding="utf-8") as notes:
            robot = support.start(*ingest_command(self.logs[0], "late", "--server", address),
                                  cwd=self.folder, log=notes)

        def notes_now():
            with open(notes_path, encoding="utf-8") as f:
                return f.read()

        try:
            support.wait_until(lambda: "waiting for server" in notes_now(), "the first note")
            self.assertIn(address, notes_now())
            self.assertIsNone(robot.poll())
            with self.server(self.path("late-store"), address):
                self.assertEqual(0, robot.wait(timeout=support.TIMEOUT_S), notes_now())
            self.assertIn("answers again", notes_now())
        finally:
            robot.kill()
            robot.wait()

    def test_gives_up_when_the_time_is_over_and_says_how_to_go_on(self):
        said = self.refused(3, ["unix:nobody.sock", "run the same again"],
                            *ingest_command(self.logs[0], "none", "--server", "unix:nobody.sock",
                                            "--retry-for", "500ms"))
        self.assertIn("waiting for server", said)

    def test_a_duration_that_is_none_is_refused(self):
        for text in ("soon", "-3s", ""):
            self.refused(2, ["--retry-for"],
                         *ingest_command(self.logs[0], "none", "--server", "unix:x",
                                         "--retry-for", text))

    def test_memory_does_not_grow_while_the_link_is_down(self):
        """The log waits: what was read and not sent is one delta."""
        with contextlib.ExitStack() as stack:
            address = "unix:" + self.path("down")
            stack.enter_context(self.server(self.path("down-store"), address))
            proxy = chaos_proxy.ChaosProxy(address)
            stack.callback(proxy.close)
            robot = support.start(*ingest_command(self.logs[1], "down", "--server",
                                                  proxy.address), cwd=self.folder)
            stack.callback(robot.wait)
            stack.callback(robot.kill)
            support.wait_until(lambda: head_of(address, "down") > 20, "the first revisions")
            proxy.fault("black_hole", 0.5)
            before = resident_mib(robot.pid)
            proxy.fault("black_hole", HOLE_S)
            self.assertLess(resident_mib(robot.pid) - before, 8)
            self.assertEqual(0, robot.wait(timeout=support.TIMEOUT_S))


def head_of(address, map_name):
    done = support.run("dsg", "stats", "--server", address, "--map", map_name, "--json")
    return int(json.loads(done.stdout)["head_revision"]) if done.returncode == 0 else 0


def resident_mib(pid):
    with open(f"/proc/{pid}/statm", encoding="ascii") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


if __name__ == "__main__":
    unittest.main()
