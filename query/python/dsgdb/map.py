# SPDX-License-Identifier: Apache-2.0
"""One map: everything that can be asked of it, and written to it."""

from __future__ import annotations

from typing import Optional

from dsgdb import v1
from dsgdb.agents import AgentQuestions
from dsgdb.errors import InvalidArgument
from dsgdb.history import HistoryQuestions
from dsgdb.scene import SceneQuestions
from dsgdb.space import SpaceQuestions
from dsgdb.writing import Writing


class Map(AgentQuestions, SceneQuestions, SpaceQuestions, HistoryQuestions, Writing):
    """A map, at its newest revision or at one that `at` names.

    Instants are ints (nanoseconds on the clock of the map), strings ("+30s" from its epoch, or RFC
    3339), timedeltas (from its epoch) or datetimes with a time zone; the last and RFC 3339 only
    where the clock is UNIX. Intervals are half-open: `start` belongs to them, `end` does not.
    Lengths are metres in the frame of the map, angles radians.

    Threads: any number may ask at a time.
    """

    def at(self, *, revision: Optional[int] = None, tag: Optional[str] = None) -> Map:
        """The map as it was at a revision, by number or tag. Whether the revision can be read, the
        first question says: OUT_OF_RANGE/REVISION_COMPACTED, NOT_FOUND/TAG_UNKNOWN.
        """
        if (revision is None) == (tag is None):
            raise InvalidArgument("at takes a revision or a tag: name one of both", "FIELD_INVALID",
                                  {"field": "revision"})
        if tag == "":
            raise InvalidArgument("the tag is empty; name one of tags(), or leave at() out for the "
                                  "newest revision", "FIELD_INVALID", {"field": "tag"})
        return Map(self.api, self.spec, v1.ReadAt(exact_revision=revision, tag=tag))

    def __repr__(self) -> str:
        at = self._read_at
        if at is None:
            return f"<Map {self.name}>"
        which = f"tag {at.tag}" if at.tag else f"revision {at.exact_revision}"
        return f"<Map {self.name} at {which}>"
