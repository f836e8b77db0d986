#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The server as a process: one address one server, clear refusals, answers during an ingest."""

import os
import signal
import socket
import subprocess
import time
import unittest

import support


class Server(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small = cls.simulate("small", people=3, seconds=60)
        cls.ingest("store", cls.small)

    def test_two_servers_never_share_a_port(self):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        address = f"127.0.0.1:{port}"
        with self.server("store", address):
            self.refused(2, [address], "dsg-server", "--store", "store", "--listen", address)

    def test_a_socket_left_by_a_killed_server_is_taken_over(self):
        address = "unix:left.sock"
        killed = support.start("dsg-server", "--store", "store", "--listen", address,
                               cwd=self.folder)
        support.wait_until(lambda: support.run("dsg", "version", "--server", address,
                                               cwd=self.folder).returncode == 0, "the server")
        killed.kill()
        killed.wait()
        with self.server("store", address):
            self.assertGreater(self.ask("stats", "--server", address)["head_revision"], "0")

    def test_wrong_starts_are_refused(self):
        a_file = os.path.join(self.small, "tracks.csv")
        self.refused(2, [a_file], "dsg-server", "--store", a_file, "--listen", "unix:a.sock")
        self.refused(2, ["unix:"], "dsg-server", "--store", "store", "--listen", "unix:")
        self.refused(2, ["--allow-remote"], "dsg-server", "--store", "store", "--listen",
                     "0.0.0.0:50051")
        self.refused(2, ["--reflection"], "dsg-server", "--store", "store", "--listen",
                     "unix:r.sock", "--reflection", "perhaps")

    def test_more_connections_than_descriptors_harm_nobody(self):
        address = "unix:few.sock"
        process = support.start("sh", "-c", 'ulimit -n 64; exec "$0" "$@"',
                                os.path.join(support.BIN, "dsg-server"), "--store", "store",
                                "--listen", address, "--log-level", "error", cwd=self.folder)
        try:
            ready = lambda: support.run("dsg", "version", "--server", address,
                                        cwd=self.folder).returncode == 0
            support.wait_until(ready, "the server")
            preface = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\x04" + b"\0" * 5
            held = []
            for _ in range(300):
                client = socket.socket(socket.AF_UNIX)
                try:
                    client.connect(os.path.join(self.folder, "few.sock"))
                    client.sendall(preface)
                except OSError:
                    pass
                held.append(client)
            self.assertIsNone(process.poll())
            for client in held:
                client.close()
            support.wait_until(ready, "the server after the flood")
        finally:
            process.terminate()
            self.assertEqual(0, process.wait())

    def test_no_server_is_said_at_once(self):
        self.refused(3, ["unix:none.sock"], "dsg", "stats", "--server", "unix:none.sock",
                     "--map", "office", "--timeout", "2")

    def test_answers_while_an_ingest_writes(self):
        large = self.simulate("large", people=40, seconds=600)
        self.ingest("busy", self.small)
        with self.server("busy", "unix:busy.sock"):
            heads = [self.head("unix:busy.sock")]
            writer = support.start("dsg-ingest", "--store", "busy", "--map", "office",
                                   "--agent-prefix", "b", large, cwd=self.folder)
            try:
                while writer.poll() is None:
                    heads.append(self.head("unix:busy.sock"))
                self.assertEqual(0, writer.returncode)
                heads.append(self.head("unix:busy.sock"))
            finally:
                writer.kill()
                writer.wait()
            self.assertEqual(heads, sorted(heads))
            self.assertGreater(heads[-1], heads[0])
            self.assertEqual(heads[-1], int(self.ask("stats", "--store", "busy")["head_revision"]))

    def head(self, address):
        return int(self.ask("stats", "--server", address, "--map", "office")["head_revision"])

    def test_a_watch_goes_on_over_a_restart(self):
        self.ingest("watched", self.small)
        said, seen = self.path("watch.err"), self.path("watch.out")

        def says(text):
            with open(said, encoding="utf-8") as f:
                return text in f.read()

        with open(said, "w", encoding="utf-8") as err, open(seen, "w", encoding="utf-8") as out:
            with self.server("watched", "unix:watch.sock"):
                before = self.head("unix:watch.sock")
                watch = subprocess.Popen(
                    ["dsg", "watch", "--server", "unix:watch.sock", "--after", str(before - 1),
                     "-n", "2"], cwd=self.folder, env=support.environment(), stdout=out,
                    stderr=err, stdin=subprocess.DEVNULL)
                self.addCleanup(watch.kill)
                support.wait_until(lambda: os.path.getsize(seen) > 0, "the first revision")
            support.wait_until(lambda: says("went away"), "the watch to miss the server")
            with self.server("watched", "unix:watch.sock"):
                support.wait_until(lambda: says(f"watching again after revision {before}"),
                                   "the watch to go on")
                self.ok("dsg-ingest", "--store", "watched", "--map", "office", "--agent-prefix",
                        "c", self.small)
                self.assertEqual(0, watch.wait(timeout=support.TIMEOUT_S))
        with open(seen, encoding="utf-8") as f:
            told = [line.split()[1] for line in f.read().splitlines()]
        self.assertEqual([str(before), str(before + 1)], told)

    def test_stops_in_order_on_interrupt_too(self):
        with self.server("store", "unix:int.sock") as process:
            process.send_signal(signal.SIGINT)
            self.assertEqual(0, process.wait(timeout=support.TIMEOUT_S))

    def test_stops_at_once_after_large_replies(self):
        with open(self.path("long.csv"), "w", encoding="utf-8") as f:
            f.write("time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n")
            for i in range(60_000):
                f.write(f"{i * 10_000_000},robot,robot,{i * 0.01:.2f},{i % 7},0,0,0,0,1\n")
        self.ingest("large", "long.csv")
        with self.server("large", "unix:large.sock") as process:
            # A reply that does not fit a socket at once.
            self.ok("dsg", "track", "robot", "--json", "--server", "unix:large.sock")
            begin = time.monotonic()
            process.send_signal(signal.SIGTERM)
            self.assertEqual(0, process.wait(timeout=support.TIMEOUT_S))
            self.assertLess(time.monotonic() - begin, 5)


if __name__ == "__main__":
    unittest.main()
