# SPDX-License-Identifier: Apache-2.0
"""Poses of agents as columns: millions of them without an object for each."""

from __future__ import annotations

import dataclasses
from array import array
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Mapping, Sequence

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


@dataclasses.dataclass(frozen=True, eq=False)
class Track(Sequence[TimedPose]):
    """The poses of one agent, ascending in time. As a sequence: of `TimedPose`, without
    covariances.

    time_ns, x, y, z (map frame, metres), qx, qy, qz, qw, flags: columns, arrays of the standard
    library; numpy.frombuffer(track.x) copies nothing. The orientation is NaN where the source gave
    positions only. Of a track that was asked for with `every`, the rows between samples that lie in
    a gap are there too, with NaN for everything but the time.
    """

    agent_id: str
    revision: int
    spec: MapSpec
    # 0: stored poses.
    period_ns: int
    time_ns: array[int]
    x: array[float]
    y: array[float]
    z: array[float]
    qx: array[float]
    qy: array[float]
    qz: array[float]
    qw: array[float]
    flags: array[int]

    def to_numpy(self) -> numpy.ndarray[Any, Any]:
        """A structured array with the fields agent, time_ns, x, y, z, qx, qy, qz, qw, flags and
        quality: 1 a stored pose, 2 interpolated (of all samples, with `every`), 3 in a gap.
        """
        import numpy
        rows = numpy.empty(len(self), dtype=[
            ("agent", f"U{max(1, len(self.agent_id))}"), ("time_ns", "i8"),
            *((name, "f8") for name in COORDINATES), ("flags", "u4"), ("quality", "u1")])
        rows["agent"] = self.agent_id
        for name in ("time_ns", *COORDINATES, "flags"):
            rows[name] = numpy.frombuffer(getattr(self, name), getattr(self, name).typecode)
        rows["quality"] = _INTERPOLATED if self.period_ns else _EXACT
        rows["quality"][numpy.isnan(rows["x"])] = _IN_GAP
        return rows

    def to_pandas(self) -> pandas.DataFrame:
        """The columns of to_numpy with the time as index: UTC where the clock of the map is UNIX,
        else timedeltas from its epoch.
        """
        return _to_frame(self.to_numpy(), self.spec)

    def __len__(self) -> int:
        return len(self.time_ns)

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
            parts = [read_track(iter(()), self.spec, 0, "").to_numpy()]
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


def read_track(messages: Iterable[Mapping[str, Any]], spec: MapSpec, period_ns: int,
               agent: str) -> Track:
    """A track from the JSON of GetTrajectoryResponse messages. Raises KeyError, TypeError and
    ValueError for what is none.
    """
    columns = _Columns(period_ns)
    revision = 0
    for message in messages:
        agent = message.get("agent_id") or agent
        header = message.get("header")
        if header:
            revision = int(header["read_revision"])
        for pose in message.get("poses", ()):
            columns.add(pose)
    x, y, z, qx, qy, qz, qw = columns.values
    return Track(agent, revision, spec, period_ns, columns.time_ns, x, y, z, qx, qy, qz, qw,
                 columns.flags)


class _Columns:
    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self.time_ns = array("q")
        self.values = tuple(array("d") for _ in COORDINATES)
        self.flags = array("I")

    def add(self, timed: Mapping[str, Any]) -> None:
        time_ns = int(timed["time_ns"])
        if self._period_ns and self.time_ns:
            for missing_ns in range(self.time_ns[-1] + self._period_ns, time_ns, self._period_ns):
                self._append(missing_ns, (_NAN,) * len(COORDINATES), 0)
        flags = int(timed.get("flags", 0))
        pose = timed["pose"]
        position, turn = pose["position"], pose.get("orientation")
        if flags & NO_ORIENTATION:
            q = (_NAN, _NAN, _NAN, _NAN)
        elif turn is None:
            q = (0.0, 0.0, 0.0, 1.0)
        else:
            q = (turn["x"], turn["y"], turn["z"], turn["w"])
        self._append(time_ns, (position["x"], position["y"], position["z"], *q), flags)

    def _append(self, time_ns: int, values: Sequence[float], flags: int) -> None:
        self.time_ns.append(time_ns)
        self.flags.append(flags)
        for column, value in zip(self.values, values):
            column.append(value)


def _to_frame(rows: numpy.ndarray[Any, Any], spec: MapSpec) -> pandas.DataFrame:
    import pandas
    columns: dict[str, Any] = {name: rows[name] for name in ("agent", *COORDINATES, "flags")}
    columns["quality"] = pandas.Categorical.from_codes(rows["quality"].astype("i1"), _QUALITIES)
    frame = pandas.DataFrame(columns)
    frame.index = time_index(rows["time_ns"], spec).rename("time")
    return frame


