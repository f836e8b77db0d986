#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Requests that the HTTP port refuses before any call: other sites, other users, other forms."""

import contextlib
import json
import os
import random
import unittest

import http_port

LIST = "MapService/ListMaps"


def with_fields(port, *pairs, method="POST", target="/dsg.v1." + LIST, without=()):
    """A request for the maps with fields set, and others left out."""
    fields = {"Host": port.host, "Content-Type": "application/json",
              "Authorization": "Bearer " + port.token, "Content-Length": "2"}
    for name in without:
        del fields[name]
    lines = [f"{method} {target} HTTP/1.1"]
    lines += [f"{name}: {value}" for name, value in fields.items()
              if name not in [pair[0] for pair in pairs]]
    lines += [f"{name}: {value}" for name, value in pairs]
    return ("\r\n".join(lines) + "\r\n\r\n").encode() + b"{}"


def foreign_hosts(port):
    number = port.address[1]
    hosts = ["evil.example", f"evil.example:{number}", "127.0.0.1", "localhost",
             f"127.0.0.1:{number + 1}", f"localhost:{number}.evil.example", f"127.0.0.2:{number}",
             f"[::2]:{number}", "", f"http://127.0.0.1:{number}", f"localhost.:{number}"]
    return [(421, with_fields(port, ("Host", host))) for host in hosts] + [
        (421, with_fields(port, without=["Host"])),
        (400, with_fields(port, ("Host", port.host), ("Host", port.host))),
    ]


def foreign_origins(port):
    origins = ["null", "http://evil.example", "https://evil.example", "http://127.0.0.1",
               f"http://localhost:{port.address[1]}", f"ftp://{port.host}", f"http://{port.host}/",
               f"http://{port.host}.evil.example", "file://", ""]
    return [(403, with_fields(port, ("Origin", origin))) for origin in origins] + [
        (403, with_fields(port, ("Sec-Fetch-Site", site)))
        for site in ("cross-site", "same-site", "none, cross-site", "")]


def foreign_types(port):
    types = ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data",
             "application/json; charset=utf-8", "application/JSON", "application/connect+json",
             "application/grpc", "application/grpc-web+proto", "*/*", ""]
    return [(415, with_fields(port, ("Content-Type", one))) for one in types] + [
        (415, with_fields(port, without=["Content-Type"]))]


def foreign_methods(port):
    return [(405, with_fields(port, method=method))
            for method in ("PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "PROPFIND", "get")] + [
        # No Connect GET.
        (404, with_fields(port, method="GET", target=f"/dsg.v1.{LIST}?message=%7B%7D&encoding=json",
                          without=["Content-Length"])),
        (400, with_fields(port, method="GET")),
        (404, with_fields(port, target="/")),
        (404, with_fields(port, target="/dsg.v1.MapService/ListMaps?x=1")),
        (404, with_fields(port, target="/../dsg.v1.MapService/ListMaps")),
    ]


def foreign_tokens(port):
    token = port.token
    shown = ["", "Bearer", "Bearer ", "Bearer x", f"Bearer {token[:-1]}", f"Bearer {token}x",
             f"bearer {token}", token, f"Basic {token}", f"Bearer  {token}"]
    return [(401, with_fields(port, ("Authorization", one))) for one in shown] + [
        (401, with_fields(port, without=["Authorization"])),
        (401, with_fields(port, ("Cookie", f"token={token}"), without=["Authorization"])),
        (401, with_fields(port, target=f"/dsg.v1.{LIST}?token={token}",
                          without=["Authorization"])),
    ]


def malformed(port):
    good = with_fields(port)
    return [
        (400, b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\0" * 32 + b"\r\n\r\n"),
        (400, b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"),
        (400, good.replace(b"HTTP/1.1", b"HTTP/9.9")),
        (400, good.replace(b"Content-Length: 2", b"Content-Length: -2")),
        (400, good.replace(b"Content-Length: 2", b"Content-Length: 2\r\nContent-Length: 3")),
        (400, good.replace(b"Content-Length: 2",
                           b"Content-Length: 2\r\nTransfer-Encoding: chunked")),
        (400, good.replace(b"Content-Length: 2",
                           b"Transfer-Encoding: chunked\r\nContent-Length: 2")),
        (501, good.replace(b"Content-Length: 2", b"Transfer-Encoding: gzip")),
        (400, good.replace(b"Content-Length: 2\r\n\r\n{}",
                           b"Transfer-Encoding: chunked\r\n\r\nzz\r\n")),
        (413, good.replace(b"Content-Length: 2", b"Content-Length: 99999999999")),
        (413, good.replace(b"Content-Length: 2", b"Content-Length: 1048577")),
        (414, with_fields(port, target="/" + "x" * 2048)),
        (431, with_fields(port, ("X-Long", "y" * 20_000))),
        (431, with_fields(port, *[(f"X-{i}", "y") for i in range(5_000)])),
        (501, with_fields(port, ("Content-Encoding", "gzip"))),
    ]


def good_requests(port):
    where = b'{"map": "office", "agent": "alice", "at_ns": 20000000000}'
    track = http_port.envelope(b'{"map": "office", "agent": "alice"}')
    return [
        port.head("QueryService/LocateAgent", length=len(where)) + where,
        port.head("QueryService/GetTrajectory", http_port.STREAM_JSON, len(track)) + track,
        port.head(LIST, length=None, transfer_encoding="chunked") + b"2\r\n{}\r\n0\r\n\r\n",
        port.head("IngestService/Commit", "application/proto", 60) + b"\x0a\x3a" + b"\x52\0" * 29,
        b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
    ]


def mutated(requests, dice):
    """One to three requests in a row, with bytes changed, left out and repeated."""
    text = bytearray(b"".join(dice.choice(requests) for _ in range(dice.randint(1, 3))))
    for _ in range(dice.choice([0, 1, 2, 8])):
        at = dice.randrange(len(text))
        what = dice.randrange(3)
        if what == 0:
            text[at] = dice.randrange(256)
        elif what == 1:
            del text[at + 1:at + dice.randrange(20)]
        else:
            text[at:at] = text[dice.randrange(len(text)):][:40]
    return bytes(text)


class Hostile(http_port.HttpTest):
    def test_foreign_requests_are_refused_and_nothing_is_asked(self):
        refused_count = 0
        with http_port.served(self, "store", "--log-level", "debug") as (_, port):
            self.assertIn(b"HTTP/1.1 200 ", port.raw(with_fields(port, ("Connection", "close"))))
            for family in (foreign_hosts, foreign_origins, foreign_types, foreign_methods,
                           foreign_tokens, malformed):
                for expected, request in family(port):
                    with self.subTest(family=family.__name__, request=request[:200]):
                        answer = port.raw(request)
                        self.assertEqual(expected, http_port.status_of(answer), answer[:300])
                        self.check_refusal(answer)
                        refused_count += 1
            self.assertIn(b"HTTP/1.1 200 ", port.raw(with_fields(port, ("Connection", "close"))))
        self.assertGreaterEqual(refused_count, 60)
        # The log has a line for each call: the two that were good, and those that asked whether the
        # server is ready.
        with open(self.path("server.log"), encoding="utf-8") as log:
            calls = [line for line in log if "method=ListMaps " in line]
        self.assertEqual(2, len(calls), calls)

    def check_refusal(self, answer):
        head, _, body = answer.partition(b"\r\n\r\n")
        self.assertNotIn(b"access-control", head.lower())
        for field in (b"Content-Security-Policy: default-src 'none'", b"no-store",
                      b"X-Content-Type-Options: nosniff", b"Connection: close"):
            self.assertIn(field, head)
        self.assertTrue(json.loads(body)["message"])

    def test_mutated_requests_harm_nobody(self):
        seed = int(os.environ.get("DSG_SEED", random.randrange(1 << 32)))
        print(f"DSG_SEED={seed}")
        dice = random.Random(seed)
        with http_port.served(self, "store", "--http-write", "--log-level", "error",
                              http="unix:mutated.http") as (process, port):
            for _ in range(3000):
                request = mutated(good_requests(port), dice)
                with contextlib.closing(port.socket()) as made, contextlib.suppress(OSError):
                    made.settimeout(dice.choice([0.001, 0.01]))
                    half = dice.randrange(len(request) + 1)
                    made.sendall(request[:half])
                    made.sendall(request[half:])
                    made.recv(4096)
            self.assertIsNone(process.poll())
            self.assertEqual(200, port.ask(LIST, {})[0])
            self.assertLess(http_port.resident_bytes(process), 200 << 20)

    def test_names_of_a_proxy_are_taken_if_told(self):
        with http_port.served(self, "store", "--http-host", "maps.example.org", "--http-host",
                              "other:8443") as (_, port):
            for host, expected in (("maps.example.org", 200), ("MAPS.example.org", 200),
                                   ("other:8443", 200), ("other", 421),
                                   ("evil.example.org", 421), (port.host, 200)):
                request = with_fields(port, ("Host", host), ("Connection", "close"))
                self.assertEqual(expected, http_port.status_of(port.raw(request)), host)
            request = with_fields(port, ("Host", "maps.example.org"), ("Connection", "close"),
                                  ("Origin", "https://maps.example.org"))
            self.assertEqual(200, http_port.status_of(port.raw(request)))

    def test_errors_hide_what_is_not_the_callers(self):
        with http_port.served(self, "store") as (_, port):
            status, reply, body = port.ask("MapService/GetMapStats",
                                           {"map": "x\r\nSet-Cookie: a=b\u0000<script>"})
            self.assertEqual(400, status)
            self.assertIsNone(reply.headers["Set-Cookie"])
            self.assertNotIn(self.folder, body.decode())


if __name__ == "__main__":
    unittest.main()
