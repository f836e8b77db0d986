#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clients of the HTTP port that hold on to it: what others notice, and what memory it takes."""

import contextlib
import json
import select
import signal
import time
import unittest

import http_port
import support

LIST = "MapService/ListMaps"
TRACK = "QueryService/GetTrajectory"
MIB = 1 << 20
# 2 ms on an idle machine.
NEW_CALL_S = 0.5
MEMORY_BYTES = 64 * MIB


class Stall(support.ProgramsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with open(cls.path("long.csv"), "w", encoding="utf-8") as f:
            f.write("time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n")
            for i in range(60_000):
                f.write(f"{i * 10_000_000},robot,robot,{i * 0.01:.2f},{i % 7},0,0,0,0,1\n")
        cls.ingest("store", "long.csv")

    @contextlib.contextmanager
    def beside(self, hold, memory_bytes=MEMORY_BYTES):
        """Starts a server, lets `hold(port)` make its sockets, and checks a new caller."""
        with http_port.served(self, "store") as (process, port):
            port.ask(LIST, {})
            before = http_port.resident_bytes(process)
            with contextlib.ExitStack() as held:
                for made in hold(port):
                    held.callback(made.close)
                times = []
                for _ in range(5):
                    begin = time.monotonic()
                    self.assertEqual(200, port.ask(LIST, {})[0])
                    times.append(time.monotonic() - begin)
                self.assertLess(sorted(times)[2], NEW_CALL_S)
                self.assertLess(http_port.resident_bytes(process) - before, memory_bytes)
                yield process, port

    def test_a_hundred_idle_connections(self):
        def hold(port):
            for _ in range(100):
                made = port.socket()
                body = b"{}"
                made.sendall(port.head(LIST, length=2) + body)
                self.assertIn(b"200 OK", made.recv(1 << 16))
                yield made
        with self.beside(hold):
            pass

    def test_sixty_streams_that_nobody_reads(self):
        body = http_port.envelope(b'{"map": "office", "agent": "robot"}')

        def hold(port, count=60):
            for _ in range(count):
                made = port.socket(receive_bytes=4096)
                made.sendall(port.head(TRACK, http_port.STREAM_JSON, len(body),
                                       connect_timeout_ms=60_000) + body)
                yield made
            time.sleep(1)
        with self.beside(hold) as (process, port):
            # As many as there may be, and one more.
            more = list(hold(port, count=4))
            support.wait_until(lambda: port.ask(TRACK, body, http_port.STREAM_JSON)[0] == 429,
                               "the port to have as many streams as it takes")
            self.assertIsNone(process.poll())
            for made in more:
                made.close()

    def test_two_hundred_half_sent_heads(self):
        def hold(port):
            for _ in range(200):
                made = port.socket()
                made.sendall(port.head(LIST)[:-2])
                yield made
        with self.beside(hold) as (_, port):
            waiting = port.socket()
            waiting.sendall(b"POST / HT")
            begin = time.monotonic()
            self.assertEqual(408, http_port.status_of(http_port.read_all(waiting)))
            self.assertLess(time.monotonic() - begin, 15)
            waiting.close()

    def flood(self, head, piece):
        """Sends `piece` again and again; how many bytes until the server refused them, and how."""
        with http_port.served(self, "store") as (process, port):
            port.ask(LIST, {})
            before = http_port.resident_bytes(process)
            sent, answer = 0, b""
            with contextlib.closing(port.socket()) as made, contextlib.suppress(OSError):
                made.sendall(head(port))
                made.setblocking(False)
                while sent < 300 * MIB and not answer:
                    readable, writable, _ = select.select([made], [made], [], 60)
                    if readable:
                        answer = made.recv(1 << 16)
                    elif writable:
                        # Goes on in the piece where the last sending ended.
                        sent += made.send(piece[sent % len(piece):])
            self.assertLess(http_port.resident_bytes(process) - before, MEMORY_BYTES)
            self.assertEqual(200, port.ask(LIST, {})[0])
        return sent, http_port.status_of(answer)

    def test_a_line_of_the_head_without_end(self):
        sent, status = self.flood(lambda port: port.head(LIST)[:-4] + b"\r\nX-Long: ",
                                  b"y" * 65_536)
        self.assertEqual(431, status)
        self.assertLess(sent, 16 * MIB)

    def test_a_body_without_end(self):
        chunk = b"10000\r\n" + b"x" * 65_536 + b"\r\n"
        sent, status = self.flood(
            lambda port: port.head(LIST, length=None, transfer_encoding="chunked"), chunk)
        self.assertEqual(413, status)
        self.assertLess(sent, 16 * MIB)

    def test_a_line_of_a_chunk_without_end(self):
        sent, status = self.flood(
            lambda port: port.head(LIST, length=None, transfer_encoding="chunked") + b"1;",
            b"z" * 65_536)
        self.assertEqual(400, status)
        self.assertLess(sent, 16 * MIB)

    def test_more_connections_than_there_may_be(self):
        with http_port.served(self, "store") as (process, port):
            held = [port.socket() for _ in range(300)]
            answered = 0
            for made in held:
                with contextlib.suppress(OSError):
                    made.sendall(port.head(LIST, length=2) + b"{}")
                    answered += b"200 OK" in made.recv(1 << 16)
            self.assertEqual(256, answered)
            for made in held:
                made.close()
            support.wait_until(lambda: self.answers(port), "a place")
            self.assertIsNone(process.poll())

    @staticmethod
    def answers(port):
        try:
            return port.ask(LIST, {})[0] == 200
        except OSError:
            return False

    def test_bodies_that_never_come_whole(self):
        def hold(port):
            for _ in range(120):
                made = port.socket()
                made.sendall(port.head(LIST, length=MIB) + b"[" * (MIB - 65_536))
                yield made
        # Of 64, which are as many as may come at a time.
        with self.beside(hold, memory_bytes=160 * MIB):
            pass

    def test_a_server_that_stops_waits_for_no_reader(self):
        body = http_port.envelope(b'{"map": "office", "agent": "robot"}')
        with http_port.served(self, "store") as (process, port):
            held = [port.socket(receive_bytes=4096) for _ in range(8)]
            for made in held:
                made.sendall(port.head(TRACK, http_port.STREAM_JSON, len(body),
                                       connect_timeout_ms=60_000) + body)
                self.assertIn(b"200 OK", made.recv(1000))
            half = port.socket()
            half.sendall(port.head(LIST)[:-2])
            begin = time.monotonic()
            process.send_signal(signal.SIGTERM)
            self.assertEqual(b"", http_port.read_all(half))
            self.assertEqual(0, process.wait(timeout=support.TIMEOUT_S))
            self.assertLess(time.monotonic() - begin, 9)
            for made in held:
                # Without the end that a whole stream has.
                self.assertFalse(http_port.read_all(made).endswith(b"0\r\n\r\n"))
                made.close()
            half.close()

    def test_a_killed_reader_ends_its_stream(self):
        body = http_port.envelope(json.dumps({"map": "office", "agent": "robot"}).encode())
        with http_port.served(self, "store", "--log-level", "debug") as (_, port):
            made = port.socket(receive_bytes=4096)
            made.sendall(port.head(TRACK, http_port.STREAM_JSON, len(body),
                                   connect_timeout_ms=60_000) + body)
            self.assertIn(b"200 OK", made.recv(1000))
            made.close()

            def is_logged():
                with open(self.path("server.log"), encoding="utf-8") as log:
                    return any("method=GetTrajectory " in line and "CANCELLED" in line
                               for line in log)
            support.wait_until(is_logged, "the stream to end")


if __name__ == "__main__":
    unittest.main()
