# SPDX-License-Identifier: Apache-2.0
"""Questions about people and robots: where, when, who with whom."""

from __future__ import annotations

import contextlib
from typing import Iterable, Iterator, Optional

from dsgdb import v1
from dsgdb.errors import InvalidArgument
from dsgdb.packed import encode_read_at
from dsgdb.questions import Box, Questions, box as to_box, optional_duration
from dsgdb.rows import Rows, join
from dsgdb.times import Duration, Instant, instant_ns
from dsgdb.tracks import PoseChunk, Track, Tracks, encode_request, read_chunks, read_tracks

_COEFFICIENTS_AND_JOINTS = (v1.ShapePart.SHAPE_PART_COEFFICIENTS, v1.ShapePart.SHAPE_PART_JOINTS)


class AgentQuestions(Questions):
    """An agent is named by node id ("H12") or by its name in the log ("carol")."""

    def where(self, agent: str, at: Instant) -> v1.LocateAgentResponse:
        """Where an agent was at an instant: interpolated between stored poses, never extrapolated.
        In a gap of the track `position` is None and `quality` IN_GAP.

        Errors: NOT_FOUND/AGENT_UNKNOWN; OUT_OF_RANGE/TIME_OUTSIDE_TRACK with both ends of the track
        in the metadata.
        """
        return self.api.locate_agent(v1.LocateAgentRequest(
            **self._common(), agent=agent, at_ns=instant_ns(at, self.spec, "at")))

    def track(self, agent: str, start: Optional[Instant] = None, end: Optional[Instant] = None, *,
              every: Optional[Duration] = None) -> Track:
        """The poses of an agent in [start, end), by default all. With `every`: interpolated at this
        period from `start` (or the first pose) on, NaN in gaps.
        """
        if not agent:
            raise InvalidArgument("agent \"\" names nobody; give an id (\"H12\") or a name",
                                  "FIELD_INVALID", {"field": "agent", "value": ""})
        found = self._tracks((agent,), start, end, every)
        return next(track for _, track in found.values())

    def tracks(self, agents: Optional[Iterable[str]] = None, start: Optional[Instant] = None,
               end: Optional[Instant] = None, *, every: Optional[Duration] = None) -> Tracks:
        """The tracks of several agents (None = of all, by id), all of one revision."""
        asked = _listed(agents)
        if asked == []:
            return Tracks({}, self.spec)
        found = self._tracks(asked or (), start, end, every)
        if asked is None:
            return Tracks({agent: track for agent, (_, track) in found.items()}, self.spec)
        # Each under the word that it was asked for with: its id or its name.
        by_word = {name: track for name, track in found.values()}
        by_word.update({agent: track for agent, (_, track) in found.items()})
        return Tracks({word: by_word[word] for word in asked}, self.spec)

    def pose_chunks(self, agents: Optional[Iterable[str]] = None, start: Optional[Instant] = None,
                    end: Optional[Instant] = None) -> Iterator[PoseChunk]:
        """The stored poses of several agents (None = of all) in numpy, some 16,000 at a time: one
        agent behind the other, each ascending in time. Nothing is kept, so that there may be more
        of them than memory holds; it is the quickest way to look at each pose once.
        """
        asked = _listed(agents)
        if asked == []:
            return
        with self._track_messages(asked or (), start, end, 0) as messages:
            yield from read_chunks(messages)

    def who(self, where: Optional[str] = None, start: Optional[Instant] = None,
            end: Optional[Instant] = None, *, box: Optional[Box] = None,
            limit: Optional[int] = None) -> Rows[v1.PresenceInterval, v1.ListPresenceResponse]:
        """Who was in a room, a place, a region above rooms (by id, name, or the class of a single
        room), or in a box of the map frame, and when: stays, clipped to [start, end), which is by
        default the span of all poses. `reply.observed_agent_count` agents were observed anywhere
        then; the absence of others is no evidence.
        """
        if (where is None) == (box is None):
            raise InvalidArgument("who asks about a room or a box: name one of both",
                                  "FIELD_INVALID", {"field": "where"})
        request = v1.ListPresenceRequest(
            **self._common(), **self._interval(start, end), box=to_box(box),
            node_id=None if where is None else self._region_id(where))
        return self._rows(v1.PresenceInterval, self.api.list_presence, request, "intervals", limit)

    def met(self, agent: str = "", other: str = "", start: Optional[Instant] = None,
            end: Optional[Instant] = None, *, within_m: float = 0.0,
            at_least: Optional[Duration] = None, line_of_sight: bool = False,
            sight_gap: Optional[Duration] = None,
            limit: Optional[int] = None) -> Rows[v1.Encounter, v1.ListEncountersResponse]:
        """When agents were closer to each other than within_m metres (0 = 2), where, and how close:
        those of `agent`, those of `agent` with `other`, or all. at_least leaves out shorter ones;
        line_of_sight times with a wall between them, except for up to sight_gap (2 s).
        """
        request = v1.ListEncountersRequest(
            **self._common(), **self._interval(start, end), agent=agent, other_agent=other,
            distance_m=within_m, duration_ns_min=optional_duration(at_least, "at_least"),
            line_of_sight=line_of_sight,
            sight_gap_ns_max=optional_duration(sight_gap, "sight_gap"))
        return self._rows(v1.Encounter, self.api.list_encounters, request, "encounters", limit)

    def picked(self, agent: str = "", start: Optional[Instant] = None,
               end: Optional[Instant] = None, *, object: str = "", class_name: str = "",
               room: str = "", placed: bool = False, include_abstained: bool = False,
               limit: Optional[int] = None) -> Rows[v1.Interaction, v1.ListInteractionsResponse]:
        """Which objects went away, and who may have taken them, with probability and evidence;
        placed: which objects appeared. include_abstained: also those for which the evidence names
        nobody.
        """
        kind = v1.InteractionType.PLACED if placed else v1.InteractionType.PICKED
        request = v1.ListInteractionsRequest(
            **self._common(), **self._interval(start, end), agent=agent, class_name=class_name,
            object=self._node_id(object) if object else "",
            node_id=self._region_id(room) if room else "", types=(kind,),
            include_abstained=include_abstained)
        found = self._rows(v1.Interaction, self.api.list_interactions, request, "interactions",
                           limit)
        if not found:
            self._check_words(v1.NodePattern(class_name=class_name))
        return found

    def predict(self, agent: str, at: Optional[Instant] = None, *,
                horizon: Optional[Duration] = None, every: Optional[Duration] = None,
                model: v1.PredictionModel = v1.PredictionModel.GOALS, paths_max: int = 0,
                stop_at_walls: bool = False) -> v1.PredictAgentResponse:
        """Where an agent will be: paths with their probabilities over `horizon` (4.8 s) in steps of
        `every` (0.4 s), from `at` (the end of the track), without what was observed later.
        """
        return self.api.predict_agent(v1.PredictAgentRequest(
            **self._common(), agent=agent, from_ns=self._ns(at, "at"), model=model,
            horizon_ns=optional_duration(horizon, "horizon"),
            period_ns=optional_duration(every, "every"), path_count_max=paths_max,
            stop_at_walls=stop_at_walls))

    def shape(self, agent: str, start: Optional[Instant] = None, end: Optional[Instant] = None, *,
              parts: Iterable[v1.ShapePart] = _COEFFICIENTS_AND_JOINTS
              ) -> Rows[v1.AgentShape, v1.GetAgentShapeResponse]:
        """The body of an agent at each time of [start, end), in the frame of the agent. Vertices
        come only if `parts` names them.
        """
        request = v1.GetAgentShapeRequest(**self._common(), agent=agent, parts=tuple(parts),
                                          from_ns=self._ns(start, "start"),
                                          to_ns=self._ns(end, "end"))
        return join(v1.AgentShape, self.api.get_agent_shape(request), "shapes", self.spec)

    def timeline(self, start: Optional[Instant] = None, end: Optional[Instant] = None, *,
                 bins: int = 0) -> v1.GetTimelineResponse:
        """How many agents were observed in each of `bins` (200) equal parts of [start, end), which
        is by default the span of all poses.
        """
        return self.api.get_timeline(v1.GetTimelineRequest(
            **self._common(), from_ns=self._ns(start, "start"), to_ns=self._ns(end, "end"),
            bin_count=bins))

    def factors(self, agent: str, start: Optional[Instant] = None, end: Optional[Instant] = None,
                ) -> Rows[v1.PoseFactor, v1.ListFactorsResponse]:
        """The pose-graph factors of an agent that begin in [start, end)."""
        request = v1.ListFactorsRequest(**self._common(), agent=agent,
                                        from_ns=self._ns(start, "start"),
                                        to_ns=self._ns(end, "end"))
        return join(v1.PoseFactor, self.api.list_factors(request), "factors", self.spec)

    def _tracks(self, agents: Iterable[str], start: Optional[Instant], end: Optional[Instant],
                every: Optional[Duration]) -> dict[str, tuple[str, Track]]:
        period_ns = optional_duration(every, "every")
        with self._track_messages(agents, start, end, period_ns) as messages:
            return read_tracks(messages, self.spec, period_ns)

    def _track_messages(self, agents: Iterable[str], start: Optional[Instant],
                        end: Optional[Instant], period_ns: int
                        ) -> contextlib.AbstractContextManager[Iterator[memoryview]]:
        request = encode_request(self.spec.name, encode_read_at(self._read_at), agents,
                                 self._ns(start, "start"), self._ns(end, "end"), period_ns)
        return self.api.binary_stream("dsg.v1.QueryService/GetTracks", request)


def _listed(agents: Optional[Iterable[str]]) -> Optional[list[str]]:
    if isinstance(agents, str):
        raise InvalidArgument(f"agents \"{agents}\" is one name; write [\"{agents}\"], or ask for "
                              "track()", "FIELD_INVALID", {"field": "agents"})
    return None if agents is None else list(agents)
