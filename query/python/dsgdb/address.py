# SPDX-License-Identifier: Apache-2.0
"""Where a server listens, as text: "unix:PATH", "http://127.0.0.1:8080#token=..."."""

from __future__ import annotations

import dataclasses
import http.client
import re
import socket
import ssl
import urllib.parse
from typing import Optional

from dsgdb.errors import InvalidArgument


@dataclasses.dataclass(frozen=True)
class Address:
    """`name` is for messages and has no token in it."""

    name: str
    scheme: str
    host: str = ""
    port: int = 0
    path: str = ""
    token: str = dataclasses.field(default="", repr=False)

    def connect(self, timeout_s: float) -> http.client.HTTPConnection:
        """A connection that is open. Raises OSError."""
        if self.scheme == "unix":
            connection: http.client.HTTPConnection = _UnixConnection(self.path, timeout_s)
        elif self.scheme == "https":
            connection = http.client.HTTPSConnection(self.host, self.port, timeout=timeout_s,
                                                     context=ssl.create_default_context())
        else:
            connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout_s)
        try:
            connection.connect()
        except BaseException:
            connection.close()
            raise
        return connection


class _UnixConnection(http.client.HTTPConnection):
    def __init__(self, path: str, timeout_s: float) -> None:
        super().__init__("localhost", timeout=timeout_s)
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self._path)


def parse(text: str, token: Optional[str]) -> Address:
    """`token`: where the text has none. Raises InvalidArgument."""
    place, _, fragment = text.partition("#")
    token = _token(fragment, place) or token or ""
    if not re.fullmatch(r"[\x21-\x7e]*", token):
        raise _refused(place, "is given a token that has blanks or no ASCII in it")
    if place.startswith("unix:"):
        if place == "unix:":
            raise _refused(place, "names no socket; write unix:PATH")
        return Address(place, "unix", path=place[len("unix:"):], token=token)
    try:
        url = urllib.parse.urlsplit(place)
        host, port = url.hostname or "", url.port
    except ValueError as error:
        raise _refused(place, f"is no URL ({error}); write http://127.0.0.1:8080") from None
    if url.scheme not in ("http", "https"):
        raise _refused(place, "is no address of a server; write http://HOST:PORT or unix:PATH")
    if not host or url.username is not None or url.path.strip("/") or url.query:
        raise _refused(place, f"is not of the form {url.scheme}://HOST:PORT#token=TOKEN")
    return Address(place.rstrip("/"), url.scheme, host, port or (443 if url.scheme == "https" else
                                                                 80), token=token)


def _token(fragment: str, place: str) -> str:
    if not fragment:
        return ""
    key, _, token = fragment.partition("=")
    if key != "token" or not token:
        raise _refused(place, "has something else than token=TOKEN behind the #")
    return token


def _refused(place: str, why: str) -> InvalidArgument:
    return InvalidArgument(f"\"{place}\" {why}", "FIELD_INVALID",
                           {"field": "where", "value": place})
