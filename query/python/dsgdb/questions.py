# SPDX-License-Identifier: Apache-2.0
"""What all families of questions need: the map and revision asked about, pages, points and times
as the protocol has them.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Callable, Iterator, Optional, Sequence, TypeVar, Union

from dsgdb import v1
from dsgdb.errors import Error, InvalidArgument, NotFound
from dsgdb.rows import Rows, join
from dsgdb.times import TIME_MAX, Duration, Instant, duration_ns, instant_ns

Request = TypeVar("Request")
Reply = TypeVar("Reply")
Row = TypeVar("Row")

# x, y, z in the map frame, metres.
Point = Union[v1.Vector3, Sequence[float]]
# Two opposite corners, the lower one first: six numbers, or two points.
Box = Union[v1.Box, Sequence[float], Sequence[Point]]
# x, y, z or x, y, z, qx, qy, qz, qw in the map frame.
Pose = Union[v1.Pose, Point]

_PAGE_SIZE_MAX = 1000
_UNKNOWN_WORDS = ("LAYER_UNKNOWN", "CLASS_UNKNOWN", "RELATION_UNKNOWN")


class Questions:
    """A map at a revision.

    spec: name, frame, epoch and clock of the map.
    """

    def __init__(self, api: v1.Api, spec: v1.MapSpec, read_at: Optional[v1.ReadAt] = None) -> None:
        self.api = api
        self.spec = spec
        self._read_at = read_at

    @property
    def name(self) -> str:
        return self.spec.name

    def _common(self) -> dict[str, Any]:
        """The fields that every question begins with."""
        return {"map": self.spec.name, "read_at": self._read_at}

    def _ns(self, value: Optional[Instant], what: str) -> Optional[int]:
        return None if value is None else instant_ns(value, self.spec, what)

    def _interval(self, start: Optional[Instant], end: Optional[Instant]) -> dict[str, Any]:
        """from_ns and to_ns; what is not said is the span of all poses."""
        from_ns, to_ns = self._ns(start, "start"), self._ns(end, "end")
        if from_ns is None or to_ns is None:
            stats = self.api.get_map_stats(v1.GetMapStatsRequest(**self._common()))
            if from_ns is None:
                from_ns = stats.first_pose_ns if stats.first_pose_ns is not None else -2 ** 63
            if to_ns is None:
                # The interval is half-open, and the last pose belongs to it.
                to_ns = (stats.last_pose_ns + 1 if stats.last_pose_ns is not None else TIME_MAX)
        return {"from_ns": from_ns, "to_ns": to_ns}

    def _pages(self, method: Callable[[Request], Reply], request: Request, limit: Optional[int],
               count: Callable[[Reply], int]) -> Iterator[Reply]:
        """Page by page, until the list ends or `limit` entries have come."""
        if limit is not None and limit < 1:
            raise InvalidArgument(f"limit {limit} is below 1; None is for all", "FIELD_INVALID",
                                  {"field": "limit", "value": str(limit)})
        left, token = limit, ""
        while True:
            size = _PAGE_SIZE_MAX if left is None else min(left, _PAGE_SIZE_MAX)
            page: Any = method(dataclasses.replace(request, page_size=size,
                                                   page_token=token))
            yield page
            token = page.next_page_token
            left = None if left is None else left - count(page)
            if not token or (left is not None and left <= 0):
                return

    def _rows(self, kind: type[Row], method: Callable[[Request], Reply], request: Request,
              field: str, limit: Optional[int]) -> Rows[Row, Reply]:
        """The entries in `field` of all pages."""
        pages = self._pages(method, request, limit, lambda page: len(getattr(page, field)))
        return join(kind, pages, field, self.spec)

    def _check_words(self, pattern: v1.NodePattern) -> None:
        """After an empty answer: an unknown layer, class or relation is an error, with the words
        that are similar.
        """
        if pattern == v1.NodePattern():
            return
        try:
            self.api.search_nodes(v1.SearchNodesRequest(**self._common(), pattern=pattern,
                                                        page_size=1))
        except Error as error:
            if error.reason in _UNKNOWN_WORDS:
                raise

    def _node_id(self, id_or_name: str) -> str:
        return self._basic(id_or_name).id

    def _basic(self, id_or_name: str) -> v1.Node:
        reply = self.api.get_node(v1.GetNodeRequest(**self._common(), id=id_or_name,
                                                    view=v1.NodeView.NODE_VIEW_BASIC))
        return reply.node or v1.Node()

    def _region_id(self, word: str) -> str:
        """Of a room, a place or a region by id or name, or of the only room of a class."""
        found: Union[v1.Node, Error]
        try:
            found = self._basic(word)
            if found.id == word:
                return word
        except (NotFound, InvalidArgument) as error:
            found = error
        named = self._only_room(word, v1.NodeFilter(kind="room", name=word))
        if named:
            return named
        # Rooms found in images have a class but no name.
        room = self._only_room(word, v1.NodeFilter(kind="room", class_name=word))
        if isinstance(found, Error):
            if not room:
                raise found
            return room
        if room:
            raise InvalidArgument(f"\"{word}\" is the name of the {found.kind} {found.id} and the "
                                  f"class of room {room}; name one by its id", "FIELD_INVALID",
                                  {"field": "room", "value": word})
        return found.id

    def _only_room(self, word: str, where: v1.NodeFilter) -> str:
        rooms = self.api.list_nodes(v1.ListNodesRequest(
            **self._common(), filter=where, view=v1.NodeView.NODE_VIEW_BASIC)).nodes
        if len(rooms) > 1:
            raise InvalidArgument(f"several rooms are \"{word}\"; name one by its id: "
                                  f"{' '.join(room.id for room in rooms)}", "FIELD_INVALID",
                                  {"field": "room", "value": word})
        return rooms[0].id if rooms else ""


def optional_duration(value: Optional[Duration], what: str) -> int:
    """Nanoseconds; 0 = the default of the server."""
    return 0 if value is None else duration_ns(value, what)


def vector(value: Point, what: str) -> v1.Vector3:
    if isinstance(value, v1.Vector3):
        return value
    return v1.Vector3(*_numbers(value, (3,), what, "x, y, z"))


def box(value: Optional[Box], what: str = "box") -> Optional[v1.Box]:
    if value is None or isinstance(value, v1.Box):
        return value
    form = "x0, y0, z0, x1, y1, z1, or two points"
    if isinstance(value, str) or len(value) not in (2, 6):
        raise _bad_numbers(value, what, form)
    if len(value) == 2:
        low, high = value
        return v1.Box(vector(low, what), vector(high, what))  # type: ignore[arg-type]
    n = _numbers(value, (6,), what, form)
    return v1.Box(v1.Vector3(*n[:3]), v1.Vector3(*n[3:]))


def pose(value: Pose, what: str) -> v1.Pose:
    if isinstance(value, v1.Pose):
        return value
    n = _numbers(list(value), (3, 7), what, "x, y, z or x, y, z, qx, qy, qz, qw")
    return v1.Pose(v1.Vector3(*n[:3]), v1.Quaternion(*n[3:]) if len(n) == 7 else None)


def _numbers(value: Any, sizes: tuple[int, ...], what: str, form: str) -> list[float]:
    if isinstance(value, (str, bytes)):
        raise _bad_numbers(value, what, form)
    try:
        found = [float(one) for one in value]
    except (TypeError, ValueError):
        raise _bad_numbers(value, what, form) from None
    if len(found) not in sizes:
        raise _bad_numbers(value, what, form)
    return found


def _bad_numbers(value: Any, what: str, form: str) -> InvalidArgument:
    return InvalidArgument(f"{what} {value!r} is not of the form {form}", "FIELD_INVALID",
                           {"field": what, "value": str(value)})
