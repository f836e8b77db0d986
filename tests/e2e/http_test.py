#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The HTTP port: the bytes of `dsg --json`, the Connect protocol by hand, files, orderly ends."""

import contextlib
import http.client
import json
import os
import signal
import stat
import struct
import time
import unittest

import http_port
import support

WHERE = "QueryService/LocateAgent"
TRACK = "QueryService/GetTrajectory"
WATCH = "MapService/WatchMap"


class Contract(http_port.HttpTest):
    def questions(self):
        """(arguments of dsg, method, request) of verbs that make one call."""
        at_ns = self.epoch_ns + 20 * support.NS_PER_S
        head = int(self.ask("stats", "--store", "store")["head_revision"])
        return [
            (["maps"], "MapService/ListMaps", {}),
            (["stats", "--map", "office"], "MapService/GetMapStats", {"map": "office"}),
            (["where", "alice", "--at", "+20s"], WHERE,
             {"map": "office", "agent": "alice", "at_ns": str(at_ns)}),
            (["where", "H1", "--at", "+20s", "--revision", str(head)], WHERE,
             {"map": "office", "agent": "H1", "at_ns": at_ns, "read_at": {"exact_revision": head}}),
            (["show", "R0"], "QueryService/GetNode",
             {"map": "office", "id": "R0", "view": "NODE_VIEW_FULL"}),
            (["near", "1,2,0", "-k", "5"], "QueryService/ListNearestNodes",
             {"map": "office", "position": {"x": 1, "y": 2}, "k": 5}),
            (["tag"], "MaintenanceService/ListTags", {"map": "office"}),
        ]

    def test_unary_answers_are_what_dsg_prints(self):
        with http_port.served(self, "store") as (_, port):
            for arguments, method, request in self.questions():
                with self.subTest(verb=arguments):
                    printed = self.ok("dsg", *arguments, "--json", "--store", "store")
                    status, reply, body = port.ask(method, request)
                    self.assertEqual((200, printed), (status, body.decode()))
                    self.assertEqual("application/json", reply.headers["Content-Type"])
                    self.assertEqual("no-store", reply.headers["Cache-Control"])

    def test_streams_are_what_dsg_prints(self):
        with http_port.served(self, "store") as (_, port):
            printed = self.ask("track", "alice", "--store", "store", "--limit", "1000000")
            messages, end = port.stream(TRACK, {"map": "office", "agent": "alice"})
            parts = [json.loads(message) for message in messages]
            self.assertEqual({}, end)
            self.assertEqual(printed["poses"], [p for part in parts for p in part["poses"]])
            self.assertEqual((printed["header"], printed["agent_id"]),
                             (parts[0]["header"], parts[0]["agent_id"]))
            lines = self.ok("dsg", "watch", "--after", "0", "-n", "2", "--json", "--server",
                            "unix:grpc.sock")
            with contextlib.closing(Stream(port, WATCH, {"map": "office",
                                                         "after_revision": "0"})) as watch:
                seen = [watch.next()[1].decode() for _ in range(len(lines.splitlines()))]
            self.assertEqual(lines, "".join(seen))

    def test_errors_are_those_of_grpc(self):
        wrong = {"map": "office", "agent": "nobody-of-that-name", "at_ns": "0"}
        with http_port.served(self, "store") as (_, port):
            status, reply, body = port.ask(WHERE, wrong)
            error = json.loads(body)
            self.assertEqual((404, "not_found"), (status, error["code"]))
            self.assertIn("nobody-of-that-name", error["message"])
            self.assertEqual("application/json", reply.headers["Content-Type"])
            detail = http_port.detail_of(error)
            self.assertEqual(("AGENT_UNKNOWN", "dsg"), (detail["reason"], detail["domain"]))
            standard = error["details"][1]
            self.assertEqual("google.rpc.ErrorInfo", standard["type"])
            self.assertEqual(("AGENT_UNKNOWN", "dsgdb", detail["metadata"]),
                             tuple(standard["debug"][key]
                                   for key in ("reason", "domain", "metadata")))
            said = self.refused(1, [], "dsg", "where", wrong["agent"], "--at", "+0s", "--server",
                                "unix:grpc.sock")
            self.assertIn(error["message"][:60], said)
            messages, end = port.stream(TRACK, {"map": "office", "agent": wrong["agent"]})
            self.assertEqual(([], "not_found"), (messages, end["error"]["code"]))
            self.assertEqual(end["error"]["details"][0]["value"],
                             end["metadata"]["dsg-error-bin"][0])
            for body in (b"{", b"[]", b'{"map": 5}', b'{"no_such_field": 1}', b"\xff", b""):
                status, _, answer = port.ask(WHERE, body)
                self.assertEqual((400, "invalid_argument"), (status, json.loads(answer)["code"]))

    def test_binary_messages_too(self):
        with http_port.served(self, "store") as (_, port):
            name = b"\x0a\x06office"
            status, reply, body = port.ask("MapService/GetMapStats", name, "application/proto")
            self.assertEqual((200, "application/proto"), (status, reply.headers["Content-Type"]))
            self.assertIn(b"office", body)
            request = http_port.envelope(name + b"\x1a\x05alice")
            status, _, body = port.ask(TRACK, request, "application/connect+proto")
            *messages, (flags, end) = http_port.split_envelopes(body)
            self.assertEqual((200, 2, b"{}"), (status, flags, end))
            self.assertGreater(len(messages), 0)
            self.assertTrue(b"H0" in messages[0][1])
            status, _, body = port.ask(WHERE, b"\xff\xff", "application/proto")
            self.assertEqual((400, "invalid_argument"), (status, json.loads(body)["code"]))

    def test_one_connection_takes_many_calls(self):
        at_ns = self.epoch_ns + 20 * support.NS_PER_S
        body = json.dumps({"map": "office", "agent": "alice", "at_ns": at_ns}).encode()
        with http_port.served(self, "store") as (_, port):
            with contextlib.closing(port.connect()) as connection:
                answers = {port.send(connection, WHERE, body)[2] for _ in range(50)}
                self.assertEqual(1, len(answers))
            # Requests that are sent ahead are answered in their order.
            request = port.head(WHERE, length=len(body)) + body
            last = port.head("MapService/ListMaps", length=2, connection="close") + b"{}"
            answer = port.raw(request * 3 + last)
            self.assertEqual(4, answer.count(b"HTTP/1.1 200 OK"))
            self.assertIn(b'"maps"', answer[answer.rindex(b"HTTP/1.1"):])


class Stream:
    """A stream that is read message by message."""

    def __init__(self, port, method, request, **more):
        self.connection = port.connect()
        self.connection.request("POST", "/dsg.v1." + method,
                                http_port.envelope(json.dumps(request).encode()),
                                port.fields(http_port.STREAM_JSON, **more))
        self.reply = self.connection.getresponse()

    def next(self):
        flags, length = struct.unpack(">BI", self.reply.read(5))
        return flags, self.reply.read(length)

    def close(self):
        self.connection.close()


class Connect(http_port.HttpTest):
    def test_types_versions_and_encodings(self):
        with http_port.served(self, "store") as (_, port):
            cases = [
                (415, WHERE, {"content_type": "text/plain"}),
                (415, WHERE, {"content_type": http_port.STREAM_JSON}),
                (415, TRACK, {"content_type": "application/json"}),
                (404, "QueryService/NoSuchMethod", {}),
                (400, WHERE, {"connect_protocol_version": "2"}),
                (400, WHERE, {"connect_timeout_ms": "soon"}),
                (501, WHERE, {"content_encoding": "gzip"}),
                (403, "MapService/CreateMap", {}),
            ]
            for expected, method, more in cases:
                with self.subTest(method=method, more=more):
                    status, reply, body = port.ask(method, b"{}", **more)
                    self.assertEqual(expected, status)
                    self.assertTrue(json.loads(body)["message"])
                    self.assertEqual("application/json", reply.headers["Content-Type"])

    def test_requests_of_streams_are_one_envelope(self):
        with http_port.served(self, "store") as (_, port):
            good = b'{"map": "office", "agent": "alice"}'
            for body in (b"", good, http_port.envelope(good, flags=1),
                         http_port.envelope(good) + b"x", http_port.envelope(good)[:-1],
                         http_port.envelope(good) * 2):
                messages, end = port.stream(TRACK, body)
                self.assertEqual(([], "invalid_argument"), (messages, end["error"]["code"]))

    def test_timeouts_end_calls(self):
        with http_port.served(self, "store") as (_, port):
            status, _, body = port.ask("MapService/ListMaps", {}, connect_timeout_ms=0)
            self.assertEqual((504, "deadline_exceeded"), (status, json.loads(body)["code"]))
            begin = time.monotonic()
            watch = {"map": "office", "idle_period_ns": "100000000"}
            messages, end = port.stream(WATCH, watch, connect_timeout_ms=1000)
            self.assertEqual("deadline_exceeded", end["error"]["code"])
            self.assertGreater(len(messages), 2)
            self.assertLess(time.monotonic() - begin, 10)

    def test_bodies_in_chunks_and_old_clients(self):
        with http_port.served(self, "store") as (_, port):
            chunked = port.head(WHERE, length=None, transfer_encoding="chunked",
                                connection="close") + b"1\r\n{\r\n1\r\n}\r\n0\r\n\r\n"
            self.assertEqual(400, http_port.status_of(port.raw(chunked)))
            chunked = chunked.replace(WHERE.encode(), b"MapService/ListMaps")
            self.assertEqual(200, http_port.status_of(port.raw(chunked)))
            body = http_port.envelope(b'{"map": "office", "agent": "alice"}')
            old = (port.head(TRACK, http_port.STREAM_JSON, len(body)) + body).replace(
                b"HTTP/1.1", b"HTTP/1.0")
            head, _, answer = port.raw(old).partition(b"\r\n\r\n")
            self.assertNotIn(b"chunked", head)
            self.assertEqual(2, http_port.split_envelopes(answer)[-1][0])

    def test_maps_change_only_if_the_server_lets_them(self):
        request = {"map": {"name": "fresh"}}
        with http_port.served(self, "store") as (_, port):
            status, _, body = port.ask("MapService/CreateMap", request)
            self.assertEqual((403, "permission_denied"), (status, json.loads(body)["code"]))
            self.assertIn("--http-write", json.loads(body)["message"])
        self.assertEqual(1, len(self.ask("maps", "--store", "store")["maps"]))
        with http_port.served(self, "fresh", "--http-write") as (_, port):
            self.assertEqual(200, port.ask("MapService/CreateMap", request)[0])
        self.assertEqual(1, len(self.ask("maps", "--store", "fresh")["maps"]))

    def test_files_tell_what_answers(self):
        with http_port.served(self, "store") as (_, port):
            with contextlib.closing(port.connect()) as connection:
                def get(path, method="GET", **fields):
                    connection.request(method, path, headers=fields)
                    reply = connection.getresponse()
                    return reply, reply.read()
                reply, page = get("/")
                self.assertEqual((200, "text/html; charset=utf-8"),
                                 (reply.status, reply.headers["Content-Type"]))
                self.assertIn(b"proto/dsg/v1", page)
                self.assertIn("default-src 'none'", reply.headers["Content-Security-Policy"])
                self.assertEqual("nosniff", reply.headers["X-Content-Type-Options"])
                etag = reply.headers["ETag"]
                self.assertEqual((304, b""), (lambda r: (r[0].status, r[1]))(
                    get("/", **{"If-None-Match": etag})))
                reply, nothing = get("/index.html", "HEAD")
                self.assertEqual((200, b"", str(len(page))),
                                 (reply.status, nothing, reply.headers["Content-Length"]))
                reply, _ = get("/none")
                self.assertEqual(404, reply.status)


class Process(http_port.HttpTest):
    def test_the_token_is_printed_once_and_never_logged(self):
        with http_port.served(self, "store", "--log-level", "debug") as (_, port):
            self.assertEqual(43, len(port.token))
            self.assertEqual(200, port.ask("MapService/ListMaps", {})[0])
            token, port.token = port.token, "wrong"
            self.assertEqual(401, port.ask("MapService/ListMaps", {})[0])
            port.token = ""
            status, reply, _ = port.ask("MapService/ListMaps", {})
            self.assertEqual((401, "Bearer"), (status, reply.headers["WWW-Authenticate"]))
        with open(self.path("server.log"), encoding="utf-8") as log:
            text = log.read()
        self.assertEqual(1, text.count(token))
        self.assertIn("method=ListMaps ", text)
        with http_port.served(self, "store", "--http-no-token") as (_, port):
            self.assertEqual("", port.token)
            self.assertEqual(200, port.ask("MapService/ListMaps", {})[0])

    def test_a_unix_socket_is_its_users_alone(self):
        with http_port.served(self, "store", http="unix:web.sock") as (_, port):
            mode = os.stat(self.path("web.sock")).st_mode
            self.assertEqual((True, 0o600), (stat.S_ISSOCK(mode), stat.S_IMODE(mode)))
            printed = self.ok("dsg", "maps", "--json", "--store", "store")
            self.assertEqual(printed.encode(), port.ask("MapService/ListMaps", {})[2])
            messages, end = port.stream(TRACK, {"map": "office", "agent": "alice"})
            self.assertEqual((True, {}), (len(messages) > 0, end))
            self.refused(2, ["web.sock"], "dsg-server", "--store", "store", "--listen",
                         "unix:other.sock", "--http", "unix:web.sock")
        self.assertFalse(os.path.exists(self.path("web.sock")))

    def test_wrong_starts_are_refused(self):
        def start(*options):
            return ["dsg-server", "--store", "store", "--listen", "unix:wrong.sock", *options]
        self.refused(2, ["--allow-remote"], *start("--http", "0.0.0.0:0"))
        self.refused(2, ["HOST:PORT"], *start("--http", "8080"))
        self.refused(2, ["--http"], *start("--http-write"))
        for name in ("", "http://example.org", "a b"):
            self.refused(2, ["--http-host"], *start("--http", "127.0.0.1:0", "--http-host", name))
        with http_port.served(self, "store") as (_, port):
            self.refused(2, [port.host], *start("--http", port.host))

    def test_no_port_unless_asked_for(self):
        with self.server("store", "unix:plain.sock"):
            pass
        with open(self.path("server.log"), encoding="utf-8") as log:
            self.assertNotIn("HTTP", log.read())

    def test_stops_in_order_in_mid_stream(self):
        with http_port.served(self, "store") as (process, port):
            idle = port.socket()
            watch = Stream(port, WATCH, {"map": "office", "after_revision": "0"})
            self.assertEqual(0, watch.next()[0])
            begin = time.monotonic()
            process.send_signal(signal.SIGTERM)
            while True:
                flags, message = watch.next()
                if flags:
                    break
            error = json.loads(message)["error"]
            self.assertEqual("unavailable", error["code"])
            self.assertEqual("SHUTTING_DOWN", http_port.detail_of(error)["reason"])
            self.assertEqual(b"", idle.recv(1))
            idle.close()
            watch.close()
            self.assertEqual(0, process.wait(timeout=support.TIMEOUT_S))
            self.assertLess(time.monotonic() - begin, 4)

    def test_a_stream_of_a_killed_server_has_no_end(self):
        process = support.start("dsg-server", "--store", "store", "--listen", "unix:killed.sock",
                                "--http", "unix:killed.http", cwd=self.folder)
        port = http_port.Port("unix:killed.http", self.folder)
        self.addCleanup(process.kill)
        support.wait_until(lambda: os.path.exists(port.path), "the server")
        watch = Stream(port, WATCH, {"map": "office", "after_revision": "0"})
        self.assertEqual(0, watch.next()[0])
        process.kill()
        process.wait()
        # Never an envelope that looks like the end.
        with self.assertRaises((http.client.IncompleteRead, struct.error)):
            while watch.next()[0] == 0:
                pass
            self.fail("the stream has an end")
        watch.close()

    def test_a_client_that_is_killed_leaves_nothing(self):
        with http_port.served(self, "store", "--max-watches", "1") as (_, port):
            watch = {"map": "office", "idle_period_ns": "100000000"}
            first = Stream(port, WATCH, watch)
            first.next()
            _, end = port.stream(WATCH, watch, connect_timeout_ms=5000)
            self.assertEqual("resource_exhausted", end["error"]["code"])
            first.close()

            def is_free():
                _, end = port.stream(WATCH, watch, connect_timeout_ms=300)
                return end["error"]["code"] == "deadline_exceeded"
            support.wait_until(is_free, "the place of the first watch")


if __name__ == "__main__":
    unittest.main()
