# SPDX-License-Identifier: Apache-2.0
"""Poses of agents as columns: millions of them without an object for each."""

from __future__ import annotations

import dataclasses
import functools
from array import array
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Mapping, Optional, Sequence

from dsgdb import wire
from dsgdb.rows import time_index
from dsgdb.v1 import MapSpec, Pose, PoseQuality, Quaternion, ReadAt, TimedPose, Vector3

if TYPE_CHECKING:
    import numpy
    import pandas

COORDINATES = ("x", "y", "z", "qx", "qy", "qz", "qw")
# Bit flag of a pose: the source gave positions only.
NO_ORIENTATION = 1
# In the order of their numbers in the protocol.
_QUALITIES = tuple(str(quality) for quality in PoseQuality)
_EXACT, _INTERPOLATED, _IN_GAP = 1, 2, 3
_NAN = float("nan")


@dataclasses.dataclass(frozen=True)
class _Part:
    """The columns of one TrackPoses message."""

    row_count: int
    value_bytes: int
    origin: tuple[float, float, float]
    times: memoryview
    positions: memoryview
    # Empty: unknown in every row.
    orientations: memoryview
    # Empty: 0 in every row.
    flags: memoryview

    def column(self, source: memoryview, index: int, width: int, shift: float) -> array[float]:
        """One of `width` interleaved columns of numbers, all moved by `shift`."""
        if not source:
            return array("d", [_NAN]) * self.row_count
        values = array("d", source.cast("B").cast("d" if self.value_bytes == 8 else "f")
                       [index::width].tolist())
        return array("d", [value + shift for value in values]) if shift else values


class Track(Sequence[TimedPose]):
    """The poses of one agent, ascending in time. As a sequence: of `TimedPose`, without
    covariances.

    time_ns, x, y, z (map frame, metres), qx, qy, qz, qw, flags: columns, arrays of the standard
    library. The orientation is NaN where the source gave positions only. Of a track that was asked
    for with `every`, the rows between samples that lie in a gap are there too, with NaN for
    everything but the time.
    """

    def __init__(self, agent_id: str, revision: int, spec: MapSpec, period_ns: int,
                 parts: Sequence[_Part]) -> None:
        """period_ns: 0 = stored poses."""
        self.agent_id = agent_id
        self.revision = revision
        self.spec = spec
        self.period_ns = period_ns
        self._parts = tuple(parts)

    @functools.cached_property
    def time_ns(self) -> array[int]:
        times = self._stored_times
        if not self._gaps:
            return times
        filled = array("q")
        begin = 0
        for row, count in self._gaps:
            filled += times[begin:row]
            first = times[row - 1] + self.period_ns
            filled.extend(range(first, first + count * self.period_ns, self.period_ns))
            begin = row
        return filled + times[begin:]

    @functools.cached_property
    def x(self) -> array[float]:
        return self._position(0)

    @functools.cached_property
    def y(self) -> array[float]:
        return self._position(1)

    @functools.cached_property
    def z(self) -> array[float]:
        return self._position(2)

    @functools.cached_property
    def qx(self) -> array[float]:
        return self._orientation(0)

    @functools.cached_property
    def qy(self) -> array[float]:
        return self._orientation(1)

    @functools.cached_property
    def qz(self) -> array[float]:
        return self._orientation(2)

    @functools.cached_property
    def qw(self) -> array[float]:
        return self._orientation(3)

    @functools.cached_property
    def flags(self) -> array[int]:
        values = array("I")
        for part in self._parts:
            values.extend(part.flags if part.flags else bytes(part.row_count))
        return self._filled(values, 0)

    def to_arrays(self) -> tuple[numpy.ndarray[Any, Any], numpy.ndarray[Any, Any],
                                 numpy.ndarray[Any, Any]]:
        """Times (n, int64 ns), positions (n x 3, metres) and orientations (n x 4, x y z w), with
        NaN as in the columns: the quickest way to many poses.
        """
        import numpy
        count = sum(part.row_count for part in self._parts)
        times = numpy.empty(count, "i8")
        positions = numpy.empty((count, 3))
        orientations = numpy.empty((count, 4))
        at = 0
        for part in self._parts:
            rows = slice(at, at + part.row_count)
            values = f"<f{part.value_bytes}"
            times[rows] = numpy.frombuffer(part.times, "<i8")
            numpy.add(numpy.frombuffer(part.positions, values).reshape(-1, 3), part.origin,
                      out=positions[rows])
            orientations[rows] = (numpy.frombuffer(part.orientations, values).reshape(-1, 4)
                                  if part.orientations else _NAN)
            at += part.row_count
        if not self._gaps:
            return times, positions, orientations
        places = numpy.repeat([row for row, _ in self._gaps], [count for _, count in self._gaps])
        return (numpy.frombuffer(self.time_ns, "i8").copy(),
                numpy.insert(positions, places, _NAN, axis=0),
                numpy.insert(orientations, places, _NAN, axis=0))

    def to_numpy(self) -> numpy.ndarray[Any, Any]:
        """A structured array with the fields agent, time_ns, x, y, z, qx, qy, qz, qw, flags and
        quality: 1 a stored pose, 2 interpolated (of all samples, with `every`), 3 in a gap.
        """
        import numpy
        times, positions, orientations = self.to_arrays()
        rows = numpy.empty(len(times), dtype=[
            ("agent", f"U{max(1, len(self.agent_id))}"), ("time_ns", "i8"),
            *((name, "f8") for name in COORDINATES), ("flags", "u4"), ("quality", "u1")])
        rows["agent"] = self.agent_id
        rows["time_ns"] = times
        for i, name in enumerate(COORDINATES):
            rows[name] = positions[:, i] if i < 3 else orientations[:, i - 3]
        rows["flags"] = numpy.frombuffer(self.flags, self.flags.typecode)
        rows["quality"] = _INTERPOLATED if self.period_ns else _EXACT
        rows["quality"][numpy.isnan(rows["x"])] = _IN_GAP
        return rows

    def to_pandas(self) -> pandas.DataFrame:
        """The columns of to_numpy with the time as index: UTC where the clock of the map is UNIX,
        else timedeltas from its epoch.
        """
        return _to_frame(self.to_numpy(), self.spec)

    def __len__(self) -> int:
        return (sum(part.row_count for part in self._parts) +
                sum(count for _, count in self._gaps))

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        if self.x[index] != self.x[index]:
            return TimedPose(self.time_ns[index])
        flags = self.flags[index]
        turn = (None if flags & NO_ORIENTATION else
                Quaternion(self.qx[index], self.qy[index], self.qz[index], self.qw[index]))
        return TimedPose(self.time_ns[index],
                         Pose(Vector3(self.x[index], self.y[index], self.z[index]), turn), flags)

    def __repr__(self) -> str:
        return f"<Track of {self.agent_id}: {len(self)} poses, revision {self.revision}>"

    @functools.cached_property
    def _stored_times(self) -> array[int]:
        times = array("q")
        for part in self._parts:
            times.frombytes(part.times)
        return times

    @functools.cached_property
    def _gaps(self) -> list[tuple[int, int]]:
        """With a period: the rows before which samples are missing, and how many."""
        if not self.period_ns:
            return []
        times = self._stored_times
        return [(row, (times[row] - times[row - 1]) // self.period_ns - 1)
                for row in range(1, len(times)) if times[row] - times[row - 1] > self.period_ns]

    def _filled(self, values: array[Any], missing: Any) -> array[Any]:
        if not self._gaps:
            return values
        filled = array(values.typecode)
        begin = 0
        for row, count in self._gaps:
            filled += values[begin:row]
            filled += array(values.typecode, [missing]) * count
            begin = row
        return filled + values[begin:]

    def _position(self, axis: int) -> array[float]:
        values = array("d")
        for part in self._parts:
            values += part.column(part.positions, axis, 3, part.origin[axis])
        return self._filled(values, _NAN)

    def _orientation(self, index: int) -> array[float]:
        values = array("d")
        for part in self._parts:
            values += part.column(part.orientations, index, 4, 0.0)
        return self._filled(values, _NAN)


class Tracks(Mapping[str, Track]):
    """Tracks by the id or name that they were asked for with; all are of one revision."""

    def __init__(self, tracks: Mapping[str, Track], spec: MapSpec) -> None:
        self._tracks = dict(tracks)
        self.spec = spec

    def to_numpy(self) -> numpy.ndarray[Any, Any]:
        """The rows of all tracks, one track behind the other; see Track.to_numpy."""
        import numpy
        parts = [track.to_numpy() for track in self._tracks.values()]
        if not parts:
            parts = [Track("", 0, self.spec, 0, ()).to_numpy()]
        return numpy.concatenate(parts)

    def to_pandas(self) -> pandas.DataFrame:
        """See Track.to_pandas."""
        return _to_frame(self.to_numpy(), self.spec)

    def __getitem__(self, agent: str) -> Track:
        return self._tracks[agent]

    def __iter__(self) -> Iterator[str]:
        return iter(self._tracks)

    def __len__(self) -> int:
        return len(self._tracks)

    def __repr__(self) -> str:
        return f"<Tracks {list(self._tracks.values())}>"


def encode_read_at(read_at: Optional[ReadAt]) -> bytes:
    """The message ReadAt; empty = the newest revision."""
    if read_at is None:
        return b""
    out = b""
    for field, value in ((2, read_at.at_least_revision), (3, read_at.exact_revision),
                         (5, read_at.committed_at_ns)):
        if value is not None:
            out += wire.number(field, value) or bytes((field << 3, 0))
    return out + (wire.text(4, read_at.tag) if read_at.tag else b"")


def encode_request(map_name: str, revision_at: bytes, agents: Iterable[str],
                   from_ns: Optional[int], to_ns: Optional[int], period_ns: int) -> bytes:
    """The message GetTracksRequest; revision_at: an encoded ReadAt."""
    out = wire.text(1, map_name) + wire.block(2, revision_at)
    for agent in agents:
        out += wire.text(3, agent)
    for field, time_ns in ((4, from_ns), (5, to_ns)):
        if time_ns is not None:
            # Also 0 says something here.
            out += wire.number(field, time_ns) or bytes((field << 3, 0))
    return out + wire.number(6, period_ns)


def read_tracks(messages: Iterable[memoryview], spec: MapSpec,
                period_ns: int) -> dict[str, tuple[str, Track]]:
    """Names and tracks by id, from GetTracksResponse messages. Raises IndexError, TypeError and
    ValueError for what is none.
    """
    revision = 0
    heads: list[tuple[str, str]] = []
    parts: list[list[_Part]] = []
    for message in messages:
        for field, value in wire.fields(message):
            inner = dict(wire.fields(value)) if isinstance(value, memoryview) else {}
            if field == 1:
                revision = int(inner.get(1, 0))
            elif field == 2:
                heads.append((_text(inner.get(1)), _text(inner.get(2))))
                parts.append([])
            elif field == 3:
                parts[int(inner.get(1, 0))].append(_part(inner))
    return {agent: (name, Track(agent, revision, spec, period_ns, of))
            for (agent, name), of in zip(heads, parts)}


def _part(inner: Mapping[int, wire.Value]) -> _Part:
    nothing = memoryview(b"")

    def column(field: int, size: int, is_optional: bool = False) -> memoryview:
        value = inner.get(field, nothing)
        if not isinstance(value, memoryview):
            raise TypeError(f"field {field} is no column")
        if len(value) != size * rows and not (is_optional and not value):
            raise ValueError(f"column {field} of {rows} rows has {len(value)} bytes")
        return value

    rows, value_bytes = int(inner.get(2, 0)), int(inner.get(4, 0))
    if value_bytes not in (4, 8):
        raise ValueError(f"numbers of {value_bytes} bytes")
    at = inner.get(5)
    axes = {field: wire.double(int(bits)) for field, bits in wire.fields(at)} if isinstance(
        at, memoryview) else {}
    return _Part(rows, value_bytes, (axes.get(1, 0.0), axes.get(2, 0.0), axes.get(3, 0.0)),
                 column(3, 8), column(6, 3 * value_bytes), column(7, 4 * value_bytes, True),
                 column(9, 1, True))


def _text(value: Optional[wire.Value]) -> str:
    return bytes(value).decode() if isinstance(value, memoryview) else ""


def _to_frame(rows: numpy.ndarray[Any, Any], spec: MapSpec) -> pandas.DataFrame:
    import pandas
    columns: dict[str, Any] = {name: rows[name] for name in ("agent", *COORDINATES, "flags")}
    columns["quality"] = pandas.Categorical.from_codes(rows["quality"].astype("i1"), _QUALITIES)
    frame = pandas.DataFrame(columns)
    frame.index = time_index(rows["time_ns"], spec).rename("time")
    return frame
