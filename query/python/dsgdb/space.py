# SPDX-License-Identifier: Apache-2.0
"""Questions about free space: paths, and what a body would touch."""

from __future__ import annotations

from typing import Iterable, Optional, Union

from dsgdb import v1
from dsgdb.errors import InvalidArgument
from dsgdb.questions import Point, Pose, Questions, pose as to_pose, vector
from dsgdb.times import Instant

Body = Union[v1.Sphere, v1.Cuboid, v1.Capsule, v1.TriangleMesh]
# A point, a node by id or name, or "nearest CLASS"; a pattern: the nearest node that matches.
End = Union[str, Point, v1.NodePattern]

_NEAREST = "nearest "
_COLORS = ("red", "orange", "yellow", "green", "cyan", "blue", "purple", "pink", "brown", "black",
           "grey", "white")
_OBSTACLES = ("objects", "structures", "mesh", "agents", "predicted_agents")


class SpaceQuestions(Questions):
    """Lengths are metres, points are in the map frame."""

    def path(self, start: End, goal: End, *, radius_m: float = 0.0, avoid: Iterable[str] = (),
             shortest: bool = False, at: Optional[Instant] = None,
             check: bool = False) -> v1.PlanPathResponse:
        """A path over the places: ends are points, nodes, or "nearest CLASS" ("nearest red cup").
        radius_m leaves out what is too narrow, `avoid` places and rooms; shortest searches all
        places at once; check sweeps the robot along it and reports what it touches.

        Errors: NOT_FOUND/NO_PATH with what blocks it.
        """
        mode = v1.PlanMode.FLAT if shortest else v1.PlanMode.HIERARCHICAL
        if isinstance(avoid, str):
            raise InvalidArgument(f"avoid \"{avoid}\" is one word; write [\"{avoid}\"]",
                                  "FIELD_INVALID", {"field": "avoid", "value": avoid})
        return self.api.plan_path(v1.PlanPathRequest(
            **self._common(), from_=_end(start, "start"), to=_end(goal, "goal"),
            robot_radius_m=radius_m, blocked=tuple(avoid), mode=mode, at_ns=self._ns(at, "at"),
            check_collision=check))

    def collide(self, body: Body, poses: Iterable[Pose], *, at: Optional[Instant] = None,
                margin_m: float = 0.0, reach_m: float = 0.0, against: Iterable[str] = (),
                ignore: Iterable[str] = (), ignore_floor: bool = False) -> v1.CollisionResult:
        """What a body touches at a pose, or on its way along several; else its clearance, up to
        reach_m (0 = 2 m). A distance up to margin_m counts as a hit. `against` names obstacles of
        objects, structures, mesh, agents, predicted_agents; none = all but the last. Where
        `observed` is False, the absence of a hit proves nothing.
        """
        wanted = set([against] if isinstance(against, str) else against)
        for word in sorted(wanted - set(_OBSTACLES)):
            raise InvalidArgument(f"against \"{word}\" is none of {', '.join(_OBSTACLES)}",
                                  "FIELD_INVALID", {"field": "against", "value": word})
        field = {v1.Sphere: "sphere", v1.Cuboid: "cuboid", v1.Capsule: "capsule",
                 v1.TriangleMesh: "mesh"}.get(type(body))
        if field is None:
            raise InvalidArgument(f"body {body!r} is no Sphere, Cuboid, Capsule or TriangleMesh",
                                  "FIELD_INVALID", {"field": "body"})
        scope = v1.CollisionScope(**{word: True for word in wanted}, ignore_floor=ignore_floor,
                                  ignored=tuple([ignore] if isinstance(ignore, str) else ignore))
        moved = v1.CollisionBody(**{field: body},  # type: ignore[arg-type]
                                 poses=tuple(to_pose(one, "poses") for one in poses))
        reply = self.api.check_collision(v1.CheckCollisionRequest(
            **self._common(), bodies=(moved,), scope=scope, at_ns=self._ns(at, "at"),
            margin_m=margin_m, clearance_m_max=reach_m))
        return reply.results[0]


def _end(end: End, what: str) -> v1.PathEnd:
    if isinstance(end, v1.NodePattern):
        return v1.PathEnd(nearest=end)
    if not isinstance(end, str):
        return v1.PathEnd(position=vector(end, what))
    if not end.startswith(_NEAREST):
        return v1.PathEnd(node=end)
    color, _, rest = end[len(_NEAREST):].partition(" ")
    if rest and color in _COLORS:
        return v1.PathEnd(nearest=v1.NodePattern(color=color, class_name=rest))
    return v1.PathEnd(nearest=v1.NodePattern(class_name=end[len(_NEAREST):]))
