# SPDX-License-Identifier: Apache-2.0
"""Writing to a map: sessions of deltas, each applied exactly once."""

from __future__ import annotations

import dataclasses
import time
import uuid
from typing import Any, Iterable, Iterator, Optional, Sequence, Union

from dsgdb import v1
from dsgdb.errors import DeadlineExceeded, Error, InvalidArgument, ResourceExhausted, Unavailable
from dsgdb.json_codec import FieldMask
from dsgdb.questions import Questions, pose as to_pose
from dsgdb.times import Instant, instant_ns

# time, x, y, z or time, x, y, z, qx, qy, qz, qw: map frame, metres.
PoseRow = Union[v1.TimedPose, Sequence[Any]]

# The source gave positions only.
_NO_ORIENTATION = 1
# A request has at most 4 MiB; these are bytes of JSON, of a pose and of a number of its covariance.
_DELTA_BYTES_MAX = 2_500_000
_POSE_BYTES, _COVARIANCE_BYTES = 260, 26
_PAUSE_S = 0.2


class Session:
    """Deltas to one map, numbered from 1. The server knows a delta by session and number: one that
    was applied before is acknowledged and not applied again.

    A delta without an answer is sent again for `patience` seconds; then the error is raised, and
    it is sent once more before the next one, so that none is lost or applied twice.

    id: a name of your own lets another process go on where this one stopped: last_sequence says
        how many deltas the map has of it. By default it is drawn.

    Threads: one at a time.
    """

    def __init__(self, questions: Questions, id: Optional[str] = None, author: str = "dsgdb",
                 patience: float = 10.0) -> None:
        self._questions = questions
        self.id = id or f"dsgdb-{uuid.uuid4()}"
        self.author = author
        self.patience = patience
        self.last_sequence = 0
        # Sent, and not known whether it was applied.
        self._unknown: Optional[v1.GraphDelta] = None
        if id is not None:
            reply = questions.api.get_session(v1.GetSessionRequest(map=questions.name,
                                                                   session_id=id))
            self.last_sequence = reply.last_sequence

    def commit(self, delta: v1.GraphDelta) -> v1.CommitResponse:
        """Applies a delta as one revision, or nothing of it; map, session and sequence are set
        here. Answers when it is on disk.

        Errors: INVALID_ARGUMENT/DELTA_INVALID naming the part; ABORTED/PARENT_REVISION_STALE if
        `parent_revision` is set and not the newest; PermissionDenied if the server only reads.
        """
        numbered = self._numbered(delta, self.last_sequence + 1)
        if self._unknown is not None and self._unknown != numbered:
            self._send(self._unknown)
            numbered = self._numbered(delta, self.last_sequence + 1)
        return self._send(numbered)

    def append_poses(self, agent: str, poses: Iterable[PoseRow], *, message: str = "") -> int:
        """Adds poses to the track of an agent, by id or name, later than all that it has: rows of
        time, x, y, z and, if known, qx, qy, qz, qw, or `TimedPose`s. Thousands of poses are one
        revision each. Returns the last revision.
        """
        agent_id = self._questions._node_id(agent)
        revision = 0
        for part in _parts(_timed(row, i, self._questions.spec) for i, row in enumerate(poses)):
            delta = v1.GraphDelta(appends=(v1.TrajectoryAppend(agent_id, part),), message=message)
            revision = self.commit(delta).revision
        if not revision:
            raise InvalidArgument(f"no poses for {agent}; give at least one", "FIELD_INVALID",
                                  {"field": "poses"})
        return revision

    def upsert_nodes(self, nodes: Iterable[v1.Node], *, replace: bool = False,
                     message: str = "") -> int:
        """Writes nodes by id, new ones or over those that are there: the fields that are set are
        written, all others keep their values; replace: the whole node. Returns the revision.
        """
        written = tuple(dataclasses.replace(node, update_mask=FieldMask(("*",))) if replace
                        else node for node in nodes)
        return self.commit(v1.GraphDelta(nodes=written, message=message)).revision

    def upsert_edges(self, edges: Iterable[v1.Edge], *, replace: bool = False,
                     message: str = "") -> int:
        """Writes edges by source, relation and target; see upsert_nodes."""
        written = tuple(dataclasses.replace(edge, update_mask=FieldMask(("*",))) if replace
                        else edge for edge in edges)
        return self.commit(v1.GraphDelta(edges=written, message=message)).revision

    def _numbered(self, delta: v1.GraphDelta, sequence: int) -> v1.GraphDelta:
        return dataclasses.replace(delta, map=self._questions.name, session_id=self.id,
                                   sequence=sequence, author=delta.author or self.author)

    def _send(self, delta: v1.GraphDelta) -> v1.CommitResponse:
        end = time.monotonic() + self.patience
        while True:
            self._unknown = delta
            try:
                reply = self._questions.api.commit(v1.CommitRequest(delta))
            except (Unavailable, DeadlineExceeded, ResourceExhausted) as error:
                is_full = isinstance(error, ResourceExhausted) and error.reason != "OVERLOADED"
                if is_full:
                    self._unknown = None
                if is_full or time.monotonic() + _PAUSE_S > end:
                    raise
                time.sleep(_PAUSE_S)
                continue
            except Error:
                self._unknown = None
                raise
            self._unknown = None
            self.last_sequence = delta.sequence
            return reply


class Writing(Questions):
    """Writes in sessions of one call each; `session` is for more than one. Needs a server that
    takes commits: `dsgdb.open(folder, writable=True)`, or `dsg-server --http-write`.
    """

    def session(self, id: Optional[str] = None, *, author: str = "dsgdb",
                patience: float = 10.0) -> Session:
        """See `Session`."""
        if self._read_at is not None:
            raise InvalidArgument(f"this is map {self.name} at another revision than the newest, "
                                  "which is not written to; write to db.map(...)", "FIELD_INVALID",
                                  {"field": "map", "value": self.name})
        return Session(self, id, author, patience)

    def append_poses(self, agent: str, poses: Iterable[PoseRow], *, message: str = "") -> int:
        """See Session.append_poses."""
        return self.session().append_poses(agent, poses, message=message)

    def upsert_nodes(self, nodes: Iterable[v1.Node], *, replace: bool = False,
                     message: str = "") -> int:
        """See Session.upsert_nodes."""
        return self.session().upsert_nodes(nodes, replace=replace, message=message)

    def upsert_edges(self, edges: Iterable[v1.Edge], *, replace: bool = False,
                     message: str = "") -> int:
        """See Session.upsert_edges."""
        return self.session().upsert_edges(edges, replace=replace, message=message)


def _timed(row: PoseRow, number: int, spec: v1.MapSpec) -> v1.TimedPose:
    if isinstance(row, v1.TimedPose):
        if row.pose is None or row.pose.position is None:
            raise InvalidArgument(f"pose {number} at {row.time_ns} ns has no position; leave gaps "
                                  "out", "FIELD_INVALID", {"field": f"poses[{number}]"})
        return row
    time_at: Instant = row[0]
    pose = to_pose(list(row[1:]), f"poses[{number}]")
    flags = 0 if pose.orientation else _NO_ORIENTATION
    return v1.TimedPose(instant_ns(time_at, spec, f"poses[{number}]"), pose, flags)


def _parts(poses: Iterable[v1.TimedPose]) -> Iterator[tuple[v1.TimedPose, ...]]:
    part: list[v1.TimedPose] = []
    size = 0
    for pose in poses:
        size += _POSE_BYTES + _COVARIANCE_BYTES * len(pose.covariance)
        if part and size > _DELTA_BYTES_MAX:
            yield tuple(part)
            part, size = [], _POSE_BYTES
        part.append(pose)
    if part:
        yield tuple(part)
