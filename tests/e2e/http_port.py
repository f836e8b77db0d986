# SPDX-License-Identifier: Apache-2.0
"""The HTTP port of a dsg-server as its clients see it: bytes over sockets, no client library."""

import base64
import contextlib
import http.client
import json
import os
import re
import socket
import ssl
import struct
import urllib.parse

import support

TIMEOUT_S = 60
JSON = "application/json"
STREAM_JSON = "application/connect+json"
END_FLAG = 2


def envelope(message, flags=0):
    return struct.pack(">BI", flags, len(message)) + message


def split_envelopes(body):
    """[(flags, message)] of a whole stream."""
    found, at = [], 0
    while at < len(body):
        flags, length = struct.unpack_from(">BI", body, at)
        message = body[at + 5:at + 5 + length]
        if len(message) != length:
            raise AssertionError("the stream ends within an envelope")
        found.append((flags, message))
        at += 5 + length
    return found


def detail_of(error):
    """The dsg.v1.ErrorDetail of an error, as JSON; its bytes must be base64 without padding."""
    detail = error["details"][0]
    if detail["type"] != "dsg.v1.ErrorDetail" or "=" in detail["value"]:
        raise AssertionError(f"no such detail: {detail}")
    base64.b64decode(detail["value"] + "=" * (-len(detail["value"]) % 4), validate=True)
    return detail["debug"]


class UnixConnection(http.client.HTTPConnection):
    def __init__(self, path):
        super().__init__("localhost", timeout=TIMEOUT_S)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(TIMEOUT_S)
        self.sock.connect(self.path)


class Port:
    """A port by the URL that the server prints."""

    def __init__(self, url, folder):
        self.url, self.token, self.path = url, "", ""
        if url.startswith("unix:"):
            self.path = os.path.join(folder, url[len("unix:"):])
            self.host = "localhost"
            return
        parts = urllib.parse.urlsplit(url)
        self.is_encrypted = parts.scheme == "https"
        self.host, self.address = parts.netloc, (parts.hostname, parts.port)
        self.token = parts.fragment.removeprefix("token=")

    def connect(self):
        """A kept connection of the standard library's client."""
        if self.path:
            return UnixConnection(self.path)
        if self.is_encrypted:
            # Of a CA that the test has made.
            context = ssl._create_unverified_context()
            return http.client.HTTPSConnection(*self.address, timeout=TIMEOUT_S, context=context)
        return http.client.HTTPConnection(*self.address, timeout=TIMEOUT_S)

    def socket(self, receive_bytes=None):
        """A plain socket; `receive_bytes`: what the kernel keeps of what is not read."""
        family, to = ((socket.AF_UNIX, self.path) if self.path
                      else (socket.AF_INET, self.address))
        made = socket.socket(family)
        made.settimeout(TIMEOUT_S)
        if receive_bytes:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        made.connect(to)
        return made

    def fields(self, content_type=JSON, **more):
        """The fields of a call's head; more_words=value becomes More-Words."""
        fields = {"Content-Type": content_type}
        if self.token:
            fields["Authorization"] = "Bearer " + self.token
        fields.update({name.replace("_", "-").title(): str(value)
                       for name, value in more.items() if value is not None})
        return fields

    def send(self, connection, method, body, content_type=JSON, **more):
        """A call on a kept connection: its status, fields and body."""
        connection.request("POST", "/dsg.v1." + method, body, self.fields(content_type, **more))
        reply = connection.getresponse()
        return reply.status, reply, reply.read()

    def ask(self, method, request, content_type=JSON, **more):
        """A call on a connection of its own; `request` is a dict, or the body's bytes."""
        body = request if isinstance(request, bytes) else json.dumps(request).encode()
        if content_type == STREAM_JSON and not isinstance(request, bytes):
            body = envelope(body)
        with contextlib.closing(self.connect()) as connection:
            return self.send(connection, method, body, content_type, **more)

    def stream(self, method, request, **more):
        """The messages of a whole stream as bytes, and what it ended with."""
        status, reply, body = self.ask(method, request, STREAM_JSON, **more)
        if status != 200 or reply.headers["Content-Type"] != STREAM_JSON:
            raise AssertionError(f"{method}: {status} {body}")
        *messages, (flags, end) = split_envelopes(body)
        if flags != END_FLAG or any(flag for flag, _ in messages):
            raise AssertionError(f"{method}: wrong flags")
        return [message for _, message in messages], json.loads(end)

    def head(self, method, content_type=JSON, length=0, **more):
        """The bytes of a call's head."""
        fields = {"Host": self.host, **self.fields(content_type, **more)}
        if length is not None:
            fields["Content-Length"] = str(length)
        lines = [f"POST /dsg.v1.{method} HTTP/1.1"] + [f"{k}: {v}" for k, v in fields.items()]
        return ("\r\n".join(lines) + "\r\n\r\n").encode()

    def raw(self, request):
        """What comes back for these bytes, until the server closes the connection."""
        with contextlib.closing(self.socket()) as made:
            with contextlib.suppress(OSError):
                made.sendall(request)
            return read_all(made)


def read_all(made):
    received = b""
    with contextlib.suppress(OSError):
        while more := made.recv(1 << 16):
            received += more
    return received


def status_of(answer):
    found = re.match(rb"HTTP/1\.1 (\d{3}) ", answer)
    return int(found.group(1)) if found else 0


@contextlib.contextmanager
def served(test, store, *options, http="127.0.0.1:0", listen="unix:grpc.sock"):
    """A server with an HTTP port; yields the process and the port."""
    with test.server(store, listen, "--http", http, *options) as process:
        with open(test.path("server.log"), encoding="utf-8") as log:
            url = re.search(r"HTTP on (\S+)", log.read()).group(1)
        yield process, Port(url, test.folder)


def resident_bytes(process):
    with open(f"/proc/{process.pid}/statm", encoding="utf-8") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


class HttpTest(support.ProgramsTest):
    """A small office in the folder `store`."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ingest("store", cls.simulate("office", people=3, seconds=60))
        cls.epoch_ns = int(cls.ask("maps", "--store", "store")["maps"][0]["epoch_ns"])
