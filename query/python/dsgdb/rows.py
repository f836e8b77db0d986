# SPDX-License-Identifier: Apache-2.0
"""Lists of answers, and messages as columns of a table."""

from __future__ import annotations

import collections.abc
import dataclasses
import re
import sys
import typing
from typing import (TYPE_CHECKING, Any, Generic, Iterable, Iterator, Sequence, TypeVar, Union,
                    overload)

from dsgdb.json_codec import ProtoEnum
from dsgdb.times import TIME_MAX, TIME_MIN
from dsgdb.v1 import Clock, MapSpec

if TYPE_CHECKING:
    import numpy
    import pandas

Row = TypeVar("Row")
Reply = TypeVar("Reply")

# World times, of whatever interval; "last_pose_ns_before" too.
_TIME = re.compile(r"_ns(?=$|_before$|_after$)")
# Times of commits are on the wall clock, whatever the clock of the map.
_WALL_TIMES = ("committed_ns", "created_ns")


class Rows(Sequence[Row], Generic[Row, Reply]):
    """The entries of a list in the order that the server documents.

    reply: the rest of the reply, such as `reply.observed_agent_count`, without the entries.
    has_more: entries were left out because of `limit`.
    """

    def __init__(self, kind: type[Row], rows: Sequence[Row], reply: Reply, spec: MapSpec,
                 has_more: bool = False) -> None:
        self._kind = kind
        self._rows = tuple(rows)
        self.reply = reply
        self.spec = spec
        self.has_more = has_more

    @property
    def revision(self) -> int:
        """The revision that the answer was read from."""
        header = getattr(self.reply, "header", None)
        if header is None:
            raise AttributeError("this list is of the map as a whole, of no revision")
        return int(header.read_revision)

    @property
    def ids(self) -> list[str]:
        """Of the nodes, or of the agents that the entries are about; empty for other entries."""
        found = []
        for row in self._rows:
            about: Any = getattr(row, "node", row)
            identity = getattr(about, "id", None) or getattr(about, "agent_id", None)
            if identity:
                found.append(str(identity))
        return found

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each field of an entry; of what entries have inside them, with dots between
        levels, where any entry has it. World times lose their `_ns`: UTC where the clock of the map
        is UNIX, else timedeltas from its epoch; NaT where an interval is open.
        """
        return _to_frame(self._kind, self._rows, self.spec)

    @overload
    def __getitem__(self, index: int) -> Row: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Row]: ...

    def __getitem__(self, index: Union[int, slice]) -> Union[Row, Sequence[Row]]:
        return self._rows[index]

    def __iter__(self) -> Iterator[Row]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def __repr__(self) -> str:
        more = ", and there are more" if self.has_more else ""
        return f"<Rows of {self._kind.__name__}: {len(self._rows)}{more}>"


def join(kind: type[Row], replies: Iterable[Reply], field: str,
         spec: MapSpec) -> Rows[Row, Reply]:
    """The entries in `field` of all pages of a list, or of all messages of a stream; the first
    reply is kept for what else it says. There is at least one.
    """
    rows: list[Row] = []
    first: Any = None
    token = ""
    for reply in replies:
        first = first or reply
        rows += getattr(reply, field)
        token = getattr(reply, "next_page_token", "")
    return Rows(kind, rows, dataclasses.replace(first, **{field: ()}), spec, bool(token))


def _to_frame(kind: Any, messages: Iterable[Any], spec: MapSpec) -> pandas.DataFrame:
    import pandas
    rows = [dict(_flat("", message)) for message in messages]
    columns: dict[str, Any] = {}
    for name in _column_names(kind, rows):
        values = [row.get(name) for row in rows]
        if name.rsplit(".", 1)[-1] in _WALL_TIMES:
            columns[name[:-3]] = time_index(values, dataclasses.replace(spec,
                                                                        clock=Clock.CLOCK_UNIX))
        elif _TIME.search(name):
            columns[_TIME.sub("", name)] = time_index(values, spec)
        else:
            columns[name] = values
    return pandas.DataFrame(columns)


def _column_names(kind: Any, rows: Iterable[dict[str, Any]]) -> list[str]:
    """In the order of the fields of a message; those of messages inside it as rows have them."""
    found: dict[str, list[str]] = {}
    for field, hint in typing.get_type_hints(kind, vars(sys.modules[kind.__module__])).items():
        inner = (*typing.get_args(hint), hint)
        is_message = any(dataclasses.is_dataclass(one) for one in inner)
        is_list = typing.get_origin(hint) is tuple
        is_map = typing.get_origin(hint) is collections.abc.Mapping
        found[field] = [field] if is_list or not (is_message or is_map) else []
    for name in dict.fromkeys(name for row in rows for name in row):
        names = found[name.split(".", 1)[0]]
        if name not in names:
            names.append(name)
    return [name for names in found.values() for name in names]


def time_index(values: Any, spec: MapSpec) -> Union[pandas.DatetimeIndex, pandas.TimedeltaIndex]:
    """World times (None = NaT, as open ends are) as pandas has them; see Rows.to_pandas."""
    import numpy
    import pandas
    if isinstance(values, list):
        values = [TIME_MIN if value is None else value for value in values]
    times_ns: numpy.ndarray[Any, numpy.dtype[numpy.int64]] = numpy.array(values, dtype=numpy.int64)
    # The smallest int64, an open begin, is what numpy takes for NaT.
    is_open = (times_ns == TIME_MIN) | (times_ns == TIME_MAX)
    if spec.clock == Clock.CLOCK_UNIX:
        times_ns[is_open] = TIME_MIN
        return pandas.DatetimeIndex(times_ns.view("M8[ns]"), tz="UTC")
    times_ns = times_ns - spec.epoch_ns
    times_ns[is_open] = TIME_MIN
    return pandas.TimedeltaIndex(times_ns.view("m8[ns]"))


def _flat(prefix: str, message: Any) -> Iterator[tuple[str, Any]]:
    for field in dataclasses.fields(message):
        name, value = prefix + field.name, getattr(message, field.name)
        if value is None:
            continue
        if dataclasses.is_dataclass(value):
            yield from _flat(name + ".", value)
        elif isinstance(value, ProtoEnum):
            yield name, str(value)
        elif isinstance(value, typing.Mapping):
            for key, inner in value.items():
                plain = plain_value(inner)
                if plain is not None:
                    yield f"{name}.{key}", plain
        else:
            yield name, value


def plain_value(value: Any) -> Any:
    """An attribute value as a number, a text or a flag; other values as they are."""
    if not dataclasses.is_dataclass(value):
        return value
    return next((inner for field in dataclasses.fields(value)
                 if (inner := getattr(value, field.name)) is not None), None)
