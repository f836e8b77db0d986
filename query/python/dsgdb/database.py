# SPDX-License-Identifier: Apache-2.0
"""`open`: a store folder or a server, and the maps of it."""

from __future__ import annotations

import os
from types import TracebackType
from typing import Optional, Union

from dsgdb import address as addresses
from dsgdb import v1
from dsgdb.connect import Channel
from dsgdb.errors import InvalidArgument, NotFound
from dsgdb.map import Map
from dsgdb.private_server import PrivateServer

_TIMEOUT_S = 10.0


class Database:
    """The maps of one store.

    api: every RPC of the server with its own messages (`dsgdb.v1`), for what the methods of `Map`
    do not do, such as pruning, merging and reverting.

    Threads: any number may ask at a time. Close it, or use it in a `with` statement; what is left
    open is closed when the process ends.
    """

    def __init__(self, channel: Channel, server: Optional[PrivateServer] = None) -> None:
        self._channel = channel
        self._server = server
        self.api = v1.Api(channel)

    def maps(self) -> list[str]:
        """The names of all maps, ascending; also of those that cannot be opened."""
        reply = self.api.list_maps(v1.ListMapsRequest())
        return sorted([spec.name for spec in reply.maps] + list(reply.unreadable_maps))

    def map(self, name: Optional[str] = None) -> Map:
        """A map at its newest revision; None = the only map there is.

        Errors: NOT_FOUND/MAP_UNKNOWN; InvalidArgument if there are several maps and none is named.
        """
        if name is None:
            names = self.maps()
            if not names:
                raise NotFound(f"{self} has no maps yet; make one with dsg-ingest or dsg import",
                               "MAP_UNKNOWN")
            if len(names) > 1:
                raise InvalidArgument(f"{self} has {len(names)} maps; name one: {' '.join(names)}",
                                      "FIELD_INVALID", {"field": "name"})
            name = names[0]
        reply = self.api.get_map_stats(v1.GetMapStatsRequest(map=name))
        return Map(self.api, reply.map or v1.MapSpec(name=name))

    def create_map(self, name: str, *, frame: str = "map", epoch_ns: int = 0,
                   clock: Union[v1.Clock, str] = v1.Clock.CLOCK_UNIX,
                   gap_ns_max: int = 0, lossless: bool = False) -> Map:
        """A new, empty map. Poses of an agent further apart than gap_ns_max are a gap of its track
        (0 = 2 s); lossless keeps poses bit by bit, instead of within 0.1 mm and 6e-5 rad.

        Errors: ALREADY_EXISTS/MAP_EXISTS; INVALID_ARGUMENT/MAP_NAME_INVALID.
        """
        codec = (v1.TrajectoryCodec.TRAJECTORY_CODEC_LOSSLESS if lossless
                 else v1.TrajectoryCodec.TRAJECTORY_CODEC_QUANTIZED)
        spec = v1.MapSpec(name=name, frame=frame, epoch_ns=epoch_ns, clock=v1.Clock(clock),
                          codec=codec, gap_ns_max=gap_ns_max)
        reply = self.api.create_map(v1.CreateMapRequest(map=spec))
        return Map(self.api, reply.map or spec)

    def version(self) -> str:
        """The version of the server."""
        return self.api.get_server_info(v1.GetServerInfoRequest()).version

    def close(self) -> None:
        """Closes the connections, and stops the server if `open` started it."""
        self._channel.close()
        if self._server is not None:
            self._server.close()

    def __enter__(self) -> Database:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()

    def __repr__(self) -> str:
        if self._server is not None:
            return f"store {self._server.store}"
        return f"server {self._channel.address.name}"


def open(where: Union[str, os.PathLike[str]], *, token: Optional[str] = None,
         timeout: float = _TIMEOUT_S, writable: bool = False) -> Database:
    """Opens a store.

    where: "http://127.0.0.1:8080#token=TOKEN" or "unix:PATH" of a running server (`dsg-server
        --http ...`); any other text is a store folder, for which a private server is started that
        ends with this process. The program is `dsg-server` of PATH, or what DSGDB_SERVER names.
    token: the token of the server, where `where` has none.
    timeout: deadline of each call, seconds, where a call names none. Streams of tracks and meshes
        may take ten minutes.
    writable: of a folder: the private server takes commits. What a running server takes, it
        decides itself (`dsg-server --http-write`).

    Errors: NotFound without the folder or dsg-server; FailedPrecondition if the server does not
    start; InvalidArgument for an address that is none. A running server is asked with the first
    call only.
    """
    text = os.fspath(where)
    if not text:
        raise InvalidArgument("the store has an empty name; give a folder, unix:PATH or "
                              "http://HOST:PORT#token=TOKEN", "FIELD_INVALID", {"field": "where"})
    if not timeout > 0:
        raise InvalidArgument(f"timeout {timeout!r} is not above 0 seconds", "FIELD_INVALID",
                              {"field": "timeout", "value": str(timeout)})
    if text.startswith("unix:") or "://" in text:
        if writable:
            raise InvalidArgument(f"writable is for store folders; start the server of {text} with "
                                  "--http-write instead", "FIELD_INVALID", {"field": "writable"})
        return Database(Channel(addresses.parse(text, token), timeout))
    if token is not None:
        raise InvalidArgument(f"{text} is a store folder, which has no token", "FIELD_INVALID",
                              {"field": "token"})
    server = PrivateServer(os.path.abspath(text), writable)
    return Database(Channel(addresses.parse(server.address, None), timeout, server.explain), server)
