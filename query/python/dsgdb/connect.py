# SPDX-License-Identifier: Apache-2.0
"""Calls of a server by the Connect protocol: JSON over HTTP/1.1, with the standard library.

A unary call is a POST of one JSON message. A stream comes in envelopes, five bytes of flags and
length before each message; the last envelope says how it ended.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import random
import select
import socket
import struct
import threading
import time
from typing import Any, Callable, Generator, Iterator, Mapping, Optional, TypeVar

from dsgdb import errors, json_codec
from dsgdb.address import Address

Message = TypeVar("Message")
Result = TypeVar("Result")
Json = Mapping[str, Any]

# Reads are repeated when the server cannot be reached: so often, and within so long.
_REPEATS_MAX = 3
_REPEAT_S_MAX = 2.0
# Of a stream that ends by itself; it lasts as long as its reader takes.
_STREAM_TIMEOUT_S = 600.0
# A watch sends signs of life; without three of them it is given up.
_WATCH_IDLE_NS = 5_000_000_000
_CONNECT_S_MAX = 10.0
_IDLE_CONNECTIONS_MAX = 8
_ENVELOPE = struct.Struct(">BI")
_COMPRESSED, _END = 1, 2
_MESSAGE_BYTES_MAX = 1 << 28
# Answers that are no Connect errors come from something between: a proxy, another server.
_CODE_OF_HTTP = {400: "internal", 401: "unauthenticated", 403: "permission_denied",
                 404: "unimplemented", 429: "unavailable", 502: "unavailable",
                 503: "unavailable", 504: "unavailable"}


class Channel:
    """The connections to one server.

    Threads: any number may call at a time, each on a connection of its own. A process that was
    forked opens new ones.
    """

    def __init__(self, address: Address, timeout_s: float,
                 explain: Callable[[], str] = lambda: "") -> None:
        """timeout_s: deadline of calls that name none. explain: what to add when the server cannot
        be reached.
        """
        self.address = address
        self.timeout_s = timeout_s
        self._explain = explain
        self._lock = threading.Lock()
        self._idle: list[http.client.HTTPConnection] = []
        self._pid = os.getpid()
        self._is_closed = False

    def close(self) -> None:
        """Closes what is idle; calls that run end by themselves."""
        with self._lock:
            self._is_closed = True
            connections, self._idle = self._idle, []
        for connection in connections:
            connection.close()

    def __del__(self) -> None:
        for connection in self._idle:
            connection.close()

    def unary(self, path: str, request: Json, timeout_s: Optional[float], reads: bool) -> Json:
        """The reply of a call, as JSON. Only calls that read are repeated."""
        deadline = time.monotonic() + (self.timeout_s if timeout_s is None else timeout_s)
        body = _dumped(request)
        return _repeat(lambda: self._unary(path, body, deadline), deadline, reads)

    def stream(self, path: str, request: Json, timeout_s: Optional[float], reads: bool,
               lifetime: str) -> Generator[Json, None, None]:
        """The messages of a stream, as JSON. Leaving the generator ends the call."""
        silence_s = None
        if lifetime == "watch":
            idle_ns = int(request.get("idle_period_ns", 0)) or _WATCH_IDLE_NS
            silence_s = 10.0 + 3e-9 * idle_ns
        if timeout_s is None and lifetime == "answer":
            timeout_s = max(self.timeout_s, _STREAM_TIMEOUT_S)
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        for data in self._messages(path, "json", _dumped(request), deadline, silence_s, reads):
            yield _parsed(bytes(data), path)

    def binary_stream(self, path: str, request: bytes) -> Generator[memoryview, None, None]:
        """The messages of a stream that reads and ends by itself, in protobuf's wire format."""
        deadline = time.monotonic() + max(self.timeout_s, _STREAM_TIMEOUT_S)
        return self._messages(path, "proto", request, deadline, None, True)

    def _messages(self, path: str, codec: str, data: bytes, deadline: Optional[float],
                  silence_s: Optional[float], reads: bool) -> Generator[memoryview, None, None]:
        body = _ENVELOPE.pack(0, len(data)) + data

        def begin() -> tuple[_Stream, Optional[memoryview]]:
            call = _Stream(self, path, codec, body, deadline, silence_s)
            return call, call.next()

        # Once a message was given, nothing is repeated.
        call, message = _repeat(begin, deadline, reads)
        with contextlib.closing(call):
            while message is not None:
                yield message
                message = call.next()

    def _unary(self, path: str, body: bytes, deadline: float) -> Json:
        connection = self.take(deadline)
        with self.failures(path, connection):
            response = self.post(connection, path, "application/json", body, deadline)
            data = response.read()
        self.give_back(connection, response)
        if response.status != 200:
            raise _error_of(response.status, data, self.address.name)
        return _parsed(data, path)

    def take(self, deadline: Optional[float]) -> http.client.HTTPConnection:
        """An idle connection that the server has not closed, or a new one."""
        while True:
            with self._lock:
                if self._is_closed:
                    raise errors.FailedPrecondition("this database is closed; open it again")
                if self._pid != os.getpid():
                    self._idle, self._pid = [], os.getpid()
                if not self._idle:
                    break
                connection = self._idle.pop()
            poll = select.poll()
            poll.register(connection.sock, select.POLLIN)
            if not poll.poll(0):
                return connection
            # The server has nothing to say but that it closes.
            connection.close()
        with self.failures("", None):
            return self.address.connect(min(_CONNECT_S_MAX, _left(deadline) or _CONNECT_S_MAX))

    def give_back(self, connection: http.client.HTTPConnection,
                  response: http.client.HTTPResponse) -> None:
        with self._lock:
            keep = (not response.will_close and not self._is_closed
                    and len(self._idle) < _IDLE_CONNECTIONS_MAX)
            if keep:
                self._idle.append(connection)
        if not keep:
            connection.close()

    def post(self, connection: http.client.HTTPConnection, path: str, content_type: str,
             body: bytes, deadline: Optional[float]) -> http.client.HTTPResponse:
        headers = {"Content-Type": content_type, "Connect-Protocol-Version": "1"}
        if self.address.token:
            headers["Authorization"] = f"Bearer {self.address.token}"
        left_s = _left(deadline)
        if left_s is not None:
            headers["Connect-Timeout-Ms"] = str(max(1, int(left_s * 1000)))
        # The server knows the deadline too, and says what was late.
        connection.sock.settimeout(None if left_s is None else left_s + 1.0)
        connection.request("POST", f"/{path}", body, headers)
        return connection.getresponse()

    @contextlib.contextmanager
    def failures(self, path: str,
                 connection: Optional[http.client.HTTPConnection]) -> Iterator[None]:
        """Says what failed of the transport as an error of ours; the connection is closed then."""
        try:
            yield
        except BaseException as error:
            if connection is not None:
                connection.close()
            # Some of ours are errors of the system too.
            if isinstance(error, errors.Error):
                raise
            if isinstance(error, socket.timeout):
                raise errors.DeadlineExceeded(
                    f"dsg-server at {self.address.name} did not answer {path or 'a connection'} in "
                    "time; ask for less or allow more time") from None
            if isinstance(error, (OSError, http.client.HTTPException)):
                raise self._unavailable(path, error) from error
            raise

    def _unavailable(self, path: str, error: Exception) -> errors.Unavailable:
        what = str(error) or type(error).__name__
        # Frames of HTTP/2, which gRPC begins with.
        if isinstance(error, http.client.BadStatusLine) and "\0" in what:
            return errors.Unavailable(
                f"{self.address.name} does not speak HTTP/1.1; if it is dsg-server's address for "
                "gRPC, start it with --http ADDRESS besides, and open that one")
        if path:
            return errors.Unavailable(f"the connection to dsg-server at {self.address.name} broke "
                                      f"while it answered {path} ({what}){self._explain()}")
        return errors.Unavailable(
            self._explain().lstrip("; ") or
            f"no dsg-server answers at {self.address.name} ({what}); start one with: dsg-server "
            f"--store DIR --http {self.address.name.rpartition('//')[2]}")


class _Memory:
    """Memory for the messages of a stream. That of a message is used again as soon as nobody looks
    at it, since new memory of a megabyte costs as much as reading that from the socket.
    """

    _KEPT_MAX = 4

    def __init__(self) -> None:
        self._kept: list[bytearray] = []

    def take(self, size: int) -> memoryview:
        for kept in self._kept:
            try:
                # Refused while a memoryview, or an array of numpy on one, is there.
                kept.append(0)
            except BufferError:
                continue
            if len(kept) < size:
                kept.extend(bytes(size - len(kept)))
            return memoryview(kept)[:size]
        made = bytearray(size)
        if len(self._kept) < self._KEPT_MAX:
            self._kept.append(made)
        return memoryview(made)


class _Stream:
    """One stream from its request to its end."""

    def __init__(self, channel: Channel, path: str, codec: str, body: bytes,
                 deadline: Optional[float], silence_s: Optional[float]) -> None:
        self._channel = channel
        self._path = path
        self._deadline = deadline
        self._silence_s = silence_s
        self._connection = channel.take(deadline)
        self._socket = self._connection.sock
        self._is_over = False
        self._memory = _Memory()
        with channel.failures(path, self._connection):
            self._response = channel.post(self._connection, path, f"application/connect+{codec}",
                                          body, deadline)
            if self._response.status != 200:
                raise _error_of(self._response.status, self._response.read(), channel.address.name)

    def close(self) -> None:
        """Ends the call, if it has not ended; the server notices that nobody listens."""
        if not self._is_over:
            self._connection.close()

    def next(self) -> Optional[memoryview]:
        """The next message, or None at the end. Raises the error that the stream ended with."""
        with self._channel.failures(self._path, self._connection):
            flags, data = self._envelope()
            if flags & _COMPRESSED:
                raise errors.Internal(f"the server compressed a message of {self._path}, which was "
                                      "not asked for")
            if not flags & _END:
                return data
            # Its end is JSON in any codec.
            end = _parsed(bytes(data), self._path)
            self._response.read()
        # From here on the connection may be another call's.
        self._is_over = True
        self._channel.give_back(self._connection, self._response)
        if end.get("error"):
            with reading(self._path):
                raise _error_from(end["error"])
        return None

    def _envelope(self) -> tuple[int, memoryview]:
        left_s, silence_s = _left(self._deadline), self._silence_s
        is_silence = silence_s is not None and (left_s is None or silence_s < left_s)
        try:
            self._socket.settimeout(silence_s if is_silence else left_s)
            flags, size = _ENVELOPE.unpack(self._exactly(_ENVELOPE.size))
            if size > _MESSAGE_BYTES_MAX:
                raise errors.Internal(f"a message of {self._path} of {size} bytes is too large")
            return flags, self._exactly(size)
        except socket.timeout:
            if is_silence:
                raise ConnectionError("no sign of life for too long") from None
            raise

    def _exactly(self, size: int) -> memoryview:
        data = self._memory.take(size)
        count = 0
        while count < size:
            more = self._response.readinto(data[count:])
            if not more:
                raise http.client.IncompleteRead(bytes(data[:count]), size - count)
            count += more
        return data


class Caller:
    """What the generated `Api` calls with."""

    def __init__(self, channel: Channel) -> None:
        self.channel = channel

    def _unary(self, path: str, request: Any, reply: type[Message], timeout: Optional[float], *,
               reads: bool) -> Message:
        data = self.channel.unary(path, _request(request), timeout, reads)
        with reading(path):
            return json_codec.from_json(reply, data)

    def _stream(self, path: str, request: Any, reply: type[Message], timeout: Optional[float], *,
                reads: bool, lifetime: str) -> Iterator[Message]:
        stream = self.channel.stream(path, _request(request), timeout, reads, lifetime)
        with contextlib.closing(stream):
            for data in stream:
                with reading(path):
                    message = json_codec.from_json(reply, data)
                yield message

    @contextlib.contextmanager
    def binary_stream(self, path: str, request: bytes) -> Iterator[Iterator[memoryview]]:
        """The messages of a stream that reads, in protobuf's wire format; `request` is an encoded
        message.
        """
        stream = self.channel.binary_stream(path, request)
        with contextlib.closing(stream), reading(path):
            yield stream


def _request(request: Any) -> dict[str, Any]:
    try:
        return json_codec.to_json(request)
    except (TypeError, ValueError) as error:
        raise errors.InvalidArgument(str(error), "FIELD_INVALID") from None


@contextlib.contextmanager
def reading(path: str) -> Iterator[None]:
    """What is read from a reply must be what the protocol says; else it is an error of ours."""
    try:
        yield
    except errors.Error:
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise errors.Internal(f"what the server sent in reply to {path} is not what the protocol "
                              f"says ({error!r}); is it of another version?") from error


def _dumped(request: Json) -> bytes:
    return json.dumps(request, separators=(",", ":")).encode()


def _parsed(data: bytes, path: str) -> Json:
    try:
        found = json.loads(data)
    except (RecursionError, ValueError) as error:
        found = error
    if isinstance(found, dict):
        return found
    raise errors.Internal(f"what the server sent in reply to {path} is no JSON object "
                          f"({data[:80]!r}); is it a dsg-server?")


def _error_of(status: int, data: bytes, name: str) -> errors.Error:
    """The error in the body of an answer that is not 200."""
    try:
        found = json.loads(data)
    except (RecursionError, ValueError):
        found = None
    if isinstance(found, dict) and isinstance(found.get("code"), str):
        with reading(name):
            return _error_from(found)
    kind = errors.BY_CODE.get(_CODE_OF_HTTP.get(status, ""), errors.Error)
    return kind(f"{name} answered with HTTP status {status} and no reason a dsg-server gives; is "
                "it one, and is the address right?")


def _error_from(found: Json) -> errors.Error:
    code = str(found.get("code", ""))
    kind = errors.BY_CODE.get(code, errors.Error)
    reason, metadata = "", {}
    details = found.get("details")
    for detail in details if isinstance(details, list) else ():
        if isinstance(detail, dict) and detail.get("type") == "dsg.v1.ErrorDetail":
            debug = detail.get("debug") or {}
            reason = str(debug.get("reason", "")).replace("REASON_UNSPECIFIED", "")
            metadata = {str(k): str(v) for k, v in (debug.get("metadata") or {}).items()}
    return kind(str(found.get("message") or code or "the server gives no reason"), reason, metadata)


def _left(deadline: Optional[float]) -> Optional[float]:
    """Seconds, never 0, which would mean not to wait at all."""
    return None if deadline is None else max(0.001, deadline - time.monotonic())


def _repeat(attempt: Callable[[], Result], deadline: Optional[float], reads: bool) -> Result:
    end = time.monotonic() + _REPEAT_S_MAX
    end = end if deadline is None else min(end, deadline)
    for repeats in range(_REPEATS_MAX + 1):
        # Callers that were cut off together do not come back together.
        pause_s = random.uniform(0.5, 1.0) * 0.1 * 2 ** repeats
        try:
            return attempt()
        except errors.Unavailable:
            if not reads or repeats == _REPEATS_MAX or time.monotonic() + pause_s > end:
                raise
        time.sleep(pause_s)
    raise AssertionError("unreachable")
