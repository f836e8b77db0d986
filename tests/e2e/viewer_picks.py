# SPDX-License-Identifier: Apache-2.0
"""What a click on a pixel of the viewer may select, from the nodes that `dsg` lists and the camera
of the address alone.

Each shape has an inner and an outer outline: a pixel within the inner one is on the shape for sure,
one beyond the outer one is not; between them either is right.
"""

import dataclasses
import math

FIELD_OF_VIEW = 0.8
# Pixels by which a pointer may miss, and those by which outlines of boxes are uncertain.
AGENT_REACH, PLACE_REACH, EDGE_PX = 24, 8, 2
PERSON_M, ROBOT_M = 1.7, 0.5
# Half the width of a person or a robot: surely within it, surely beyond it, metres.
INNER_M, OUTER_M = 0.08, 0.3
# Between layers apart: a storey, and shares of the map's shorter and longer side.
STOREY_M, SHORTER_SHARE, LONGER_SHARE = 3, 0.36, 0.13
# Kind of an agent that is drawn as a ring, which a click need not choose.
IN_GAP = "in a gap"
LIFTS = {"agents": 0, "objects": 0, "places": 1, "rooms": 2, "buildings": 3}
# A shape of a lower rank is chosen before those of higher ones.
RANKS = {"agents": 0, "objects": 1, "places": 1, "rooms": 2, "buildings": 3}


def vector(message):
    return [message.get(axis, 0) for axis in "xyz"]


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def turned_back(q, v):
    """A vector of the map in the frame of an orientation: columns of its matrix, multiplied."""
    x, y, z, w = q
    columns = ([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
               [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
               [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)])
    return [dot(column, v) for column in columns]


@dataclasses.dataclass
class Thing:
    id: str
    layer: str
    kind: str
    position: list
    orientation: list
    low: list
    high: list


class Scene:
    """What is to be seen: the nodes of a time, and those that the map ever has."""

    def __init__(self, now, ever, explode):
        self.things = [thing for thing in map(to_thing, now) if thing and thing.layer in LIFTS]
        corners = [thing.position for thing in map(to_thing, ever)
                   if thing and thing.layer != "agents"]
        corners += [corner for thing in self.things if thing.layer in ("rooms", "buildings")
                    for corner in floor_corners(thing)]
        self.low, self.high = ([f(p[i] for p in corners) for i in range(3)] for f in (min, max))
        shorter, longer = sorted(self.high[i] - self.low[i] for i in range(2))
        step = explode * (STOREY_M + SHORTER_SHARE * shorter + LONGER_SHARE * longer)
        for thing in self.things:
            thing.position[2] += LIFTS[thing.layer] * step

    def middle(self):
        return [round((a + b) / 2, 3) for a, b in zip(self.low, self.high)]

    def somebody(self, rng):
        """Where one of the people stands."""
        people = [thing for thing in self.things if thing.layer == "agents"]
        return [round(value, 3) for value in rng.choice(people).position]


def to_thing(node):
    pose = node.get("map_T_node")
    if not pose or "position" not in pose:
        return None
    box = node.get("bounding_box", {})
    q = pose.get("orientation", {"w": 1})
    return Thing(node["id"], node["layer"], node["kind"], vector(pose["position"]),
                 [q.get(axis, 0) for axis in "xyzw"], vector(box.get("min", {})),
                 vector(box.get("max", {})))


def floor_corners(thing):
    """Corners of the floor of a room, which is not turned."""
    x, y, z = thing.position
    return [[x + dx, y + dy, z + thing.low[2]] for dx in (thing.low[0], thing.high[0])
            for dy in (thing.low[1], thing.high[1])]


class Camera:
    def __init__(self, target, distance, yaw, pitch):
        self.target, self.distance, self.yaw, self.pitch = target, distance, yaw, pitch
        cy, sy, cp, sp = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
        self.forward = [cy * cp, sy * cp, -sp]
        self.right = [sy, -cy, 0]
        self.up = [cy * sp, sy * sp, cp]
        self.eye = [t - f * distance for t, f in zip(target, self.forward)]

    def address(self):
        return ",".join(f"{value:.3f}" for value in
                        (*self.target, self.distance, self.yaw, self.pitch))


class Picture:
    def __init__(self, scene, camera, width, height):
        self.scene, self.camera, self.width, self.height = scene, camera, width, height
        self.scale = height / 2 / math.tan(FIELD_OF_VIEW / 2)

    def pixel(self, point):
        """Where a point is, and its depth in metres; None behind the camera."""
        away = minus(point, self.camera.eye)
        depth = dot(away, self.camera.forward)
        if depth < 0.05:
            return None
        return (self.width / 2 + dot(away, self.camera.right) / depth * self.scale,
                self.height / 2 - dot(away, self.camera.up) / depth * self.scale, depth)

    def ray(self, x, y):
        right, up = (x - self.width / 2) / self.scale, (self.height / 2 - y) / self.scale
        way = [f + r * right + u * up for f, r, u in
               zip(self.camera.forward, self.camera.right, self.camera.up)]
        length = math.sqrt(dot(way, way))
        return [value / length for value in way]

    def random_pixel(self, rng):
        """Any pixel, or one near a random thing."""
        while True:
            x, y = rng.uniform(5, self.width - 5), rng.uniform(5, self.height - 5)
            if rng.random() < 0.5:
                layer = rng.choice(list(LIFTS))
                at = self.pixel(rng.choice([one for one in self.scene.things
                                            if one.layer == layer]).position)
                if at is None:
                    continue
                x, y = at[0] + rng.gauss(0, 8), at[1] + rng.gauss(0, 8)
            x, y = int(x), int(y)
            if 5 < x < self.width - 5 and 5 < y < self.height - 5:
                return x, y

    def objection(self, x, y, chosen):
        """Why a click on a pixel must not choose this id, "" for none; "" if it may."""
        hits = {thing.id: (thing, *self.hit(thing, x, y)) for thing in self.scene.things}
        sure = [(thing, far) for thing, inner, _, _, far in hits.values() if inner]
        if not chosen:
            return f"{sure[0][0].id} is there" if sure else ""
        if chosen not in hits:
            return f"{chosen} is not shown"
        thing, _, is_near, near, _ = hits[chosen]
        if not is_near:
            return f"{chosen} is not there"
        for other, far in sure:
            if RANKS[other.layer] < RANKS[thing.layer]:
                return f"{other.id} is there, which comes before {chosen}"
            if RANKS[other.layer] == RANKS[thing.layer] and far < near:
                return f"{other.id} is before {chosen}"
        return ""

    def hit(self, thing, x, y):
        """Whether a pixel is surely and whether it may be on a thing, and between which distances
        from the camera the thing is there, metres."""
        if thing.layer == "agents":
            return self.hit_agent(thing, x, y)
        if thing.layer == "objects":
            return self.hit_box(thing, x, y)
        if thing.layer == "places":
            return self.hit_point(thing.position, x, y)
        return self.hit_floor(thing, x, y)

    def hit_point(self, point, x, y):
        at = self.pixel(point)
        if at is None:
            return False, False, math.inf, math.inf
        away = math.hypot(at[0] - x, at[1] - y)
        distance = math.dist(point, self.camera.eye)
        return away < PLACE_REACH - EDGE_PX, away < PLACE_REACH + EDGE_PX, distance - 0.5, \
            distance + 0.5

    def hit_agent(self, thing, x, y):
        tall = ROBOT_M if thing.kind == "robot" else PERSON_M
        foot = [*thing.position[:2], 0]
        inner = outer = False
        depth = math.dist(foot, self.camera.eye)
        for i in range(41):
            at = self.pixel([*foot[:2], tall * i / 40])
            if at is None:
                # Partly behind the camera: nobody knows.
                return False, True, 0, math.inf
            away = math.hypot(at[0] - x, at[1] - y)
            inner |= thing.kind != IN_GAP and 2 < i < 36 and away < INNER_M * self.scale / at[2]
            outer |= away < max(AGENT_REACH + EDGE_PX, OUTER_M * self.scale / at[2])
        return inner, outer, depth - tall, depth + tall

    def hit_box(self, thing, x, y):
        eye = turned_back(thing.orientation, minus(self.camera.eye, thing.position))
        way = turned_back(thing.orientation, self.ray(x, y))
        margin = EDGE_PX * math.dist(thing.position, self.camera.eye) / self.scale
        inner = entry(eye, way, thing.low, thing.high, -margin)
        outer = entry(eye, way, thing.low, thing.high, margin)
        return inner < math.inf, outer < math.inf, outer, inner + 2 * margin

    def hit_floor(self, thing, x, y):
        way = self.ray(x, y)
        x0, y0, z = floor_corners(thing)[0]
        x1, y1, _ = floor_corners(thing)[3]
        distance = (z - self.camera.eye[2]) / way[2]
        if distance < 0:
            return False, False, math.inf, math.inf
        at = [e + w * distance for e, w in zip(self.camera.eye, way)]
        margin = EDGE_PX * distance / self.scale / abs(way[2])
        inside = min(at[0] - x0, x1 - at[0], at[1] - y0, y1 - at[1])
        return inside > margin, inside > -margin, distance - margin, distance + margin


def entry(eye, way, low, high, margin):
    """Where a ray comes into a box that is larger by a margin on each side; infinite if nowhere."""
    near, far = 0.0, math.inf
    for e, w, a, b in zip(eye, way, low, high):
        a, b = a - margin, b + margin
        if a > b:
            return math.inf
        w = w or 1e-12
        first, last = sorted(((a - e) / w, (b - e) / w))
        near, far = max(near, first), min(far, last)
    return near if near <= far else math.inf
