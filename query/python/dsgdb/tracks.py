# SPDX-License-Identifier: Apache-2.0
"""Poses of agents as columns: millions of them without an object for each."""

from __future__ import annotations

import functools
from array import array
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Mapping, NamedTuple, Optional, Sequence

from dsgdb import wire
from dsgdb.packed import Fields
from dsgdb.rows import time_index
from dsgdb.v1 import MapSpec, Pose, PoseQuality, Quaternion, TimedPose, Vector3

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


class _Columns:
    """The stored rows of a track as they came, one message behind the other. A message is copied
    at once, so that all of them come in the same memory.
    """

    def __init__(self) -> None:
        self.times = array("q")
        # x y z of each row, and x y z w.
        self.positions = array("d")
        self.orientations = array("d")
        self.flags = array("B")

    def add(self, part: Fields) -> None:
        """Adds a TrackPoses message of 64-bit numbers."""
        count = part.number(2)
        if part.number(4) != 8:
            raise ValueError(f"numbers of {part.number(4)} bytes were not asked for")
        orientations = part.column(7, 32, count, is_optional=True)
        self.times.frombytes(part.column(3, 8, count))
        self.positions.frombytes(part.column(6, 24, count))
        if orientations:
            self.orientations.frombytes(orientations)
        else:
            self.orientations.extend(array("d", [_NAN]) * (4 * count))
        self.flags.frombytes(part.column(9, 1, count, is_optional=True) or bytes(count))


class Track(Sequence[TimedPose]):
    """The poses of one agent, ascending in time. As a sequence: of `TimedPose`, without
    covariances.

    time_ns, x, y, z (map frame, metres), qx, qy, qz, qw, flags: columns, arrays of the standard
    library. The orientation is NaN where the source gave positions only. Of a track that was asked
    for with `every`, the rows between samples that lie in a gap are there too, with NaN for
    everything but the time.
    """

    def __init__(self, agent_id: str, revision: int, spec: MapSpec, period_ns: int,
                 columns: _Columns) -> None:
        """period_ns: 0 = stored poses."""
        self.agent_id = agent_id
        self.revision = revision
        self.spec = spec
        self.period_ns = period_ns
        self._columns = columns

    @functools.cached_property
    def time_ns(self) -> array[int]:
        times = self._columns.times
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
        return self._filled(self._columns.positions[0::3], _NAN)

    @functools.cached_property
    def y(self) -> array[float]:
        return self._filled(self._columns.positions[1::3], _NAN)

    @functools.cached_property
    def z(self) -> array[float]:
        return self._filled(self._columns.positions[2::3], _NAN)

    @functools.cached_property
    def qx(self) -> array[float]:
        return self._filled(self._columns.orientations[0::4], _NAN)

    @functools.cached_property
    def qy(self) -> array[float]:
        return self._filled(self._columns.orientations[1::4], _NAN)

    @functools.cached_property
    def qz(self) -> array[float]:
        return self._filled(self._columns.orientations[2::4], _NAN)

    @functools.cached_property
    def qw(self) -> array[float]:
        return self._filled(self._columns.orientations[3::4], _NAN)

    @functools.cached_property
    def flags(self) -> array[int]:
        return self._filled(self._columns.flags, 0)

    def to_arrays(self) -> tuple[numpy.ndarray[Any, Any], numpy.ndarray[Any, Any],
                                 numpy.ndarray[Any, Any]]:
        """Times (n, int64 ns), positions (n x 3, metres) and orientations (n x 4, x y z w), with
        NaN as in the columns: the quickest way to many poses. Without gaps they are the memory of
        this track, and cannot be written to.
        """
        import numpy
        times = numpy.frombuffer(self.time_ns, "i8")
        positions = numpy.frombuffer(self._columns.positions).reshape(-1, 3)
        orientations = numpy.frombuffer(self._columns.orientations).reshape(-1, 4)
        if self._gaps:
            places = numpy.repeat([row for row, _ in self._gaps],
                                  [count for _, count in self._gaps])
            positions = numpy.insert(positions, places, _NAN, axis=0)
            orientations = numpy.insert(orientations, places, _NAN, axis=0)
        for column in (times, positions, orientations):
            column.flags.writeable = False
        return times, positions, orientations

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
        return len(self._columns.times) + sum(count for _, count in self._gaps)

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
    def _gaps(self) -> list[tuple[int, int]]:
        """With a period: the rows before which samples are missing, and how many."""
        if not self.period_ns:
            return []
        times = self._columns.times
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


class PoseChunk(NamedTuple):
    """Consecutive poses of one agent, in numpy; they cannot be written to."""

    agent_id: str
    # (n,) int64.
    time_ns: numpy.ndarray[Any, Any]
    # (n, 3) float64, map frame, metres.
    positions: numpy.ndarray[Any, Any]
    # (n, 4) float64, x y z w. None where the source gave positions only.
    orientations: Optional[numpy.ndarray[Any, Any]]


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
            parts = [Track("", 0, self.spec, 0, _Columns()).to_numpy()]
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


def encode_request(map_name: str, revision_at: bytes, agents: Iterable[str],
                   from_ns: Optional[int], to_ns: Optional[int], period_ns: int) -> bytes:
    """The message GetTracksRequest; revision_at: an encoded ReadAt."""
    out = wire.text(1, map_name) + wire.block(2, revision_at)
    for agent in agents:
        out += wire.text(3, agent)
    for field, time_ns in ((4, from_ns), (5, to_ns)):
        if time_ns is not None:
            # Also 0 says something here.
            out += wire.present_number(field, time_ns)
    return out + wire.number(6, period_ns)


def read_tracks(messages: Iterable[memoryview], spec: MapSpec,
                period_ns: int) -> dict[str, tuple[str, Track]]:
    """Names and tracks by id, from GetTracksResponse messages. Raises IndexError, TypeError and
    ValueError for what is none.
    """
    revision = 0
    heads: list[tuple[str, str]] = []
    tracks: list[_Columns] = []
    for message in messages:
        for field, value in wire.fields(message):
            if field == 1:
                revision = Fields(value).number(1)
            elif field == 2:
                head = Fields(value)
                heads.append((head.text(1), head.text(2)))
                tracks.append(_Columns())
            elif field == 3:
                part = Fields(value)
                tracks[part.number(1)].add(part)
    return {agent: (name, Track(agent, revision, spec, period_ns, columns))
            for (agent, name), columns in zip(heads, tracks)}


def read_chunks(messages: Iterable[memoryview]) -> Iterator[PoseChunk]:
    """The same poses as they come. Raises as read_tracks does."""
    import numpy
    agents: list[str] = []
    for message in messages:
        for field, value in wire.fields(message):
            if field == 2:
                agents.append(Fields(value).text(1))
            elif field == 3:
                part = Fields(value)
                count = part.number(2)
                turns = part.column(7, 32, count, is_optional=True)
                yield PoseChunk(agents[part.number(1)],
                                numpy.frombuffer(part.column(3, 8, count), "<i8"),
                                numpy.frombuffer(part.column(6, 24, count), "<f8").reshape(-1, 3),
                                numpy.frombuffer(turns, "<f8").reshape(-1, 4) if turns else None)


def _to_frame(rows: numpy.ndarray[Any, Any], spec: MapSpec) -> pandas.DataFrame:
    import pandas
    columns: dict[str, Any] = {name: rows[name] for name in ("agent", *COORDINATES, "flags")}
    columns["quality"] = pandas.Categorical.from_codes(rows["quality"].astype("i1"), _QUALITIES)
    frame = pandas.DataFrame(columns)
    frame.index = time_index(rows["time_ns"], spec).rename("time")
    return frame
