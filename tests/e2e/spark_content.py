# SPDX-License-Identifier: Apache-2.0
"""Spark-DSG files as plain values, read from the facts of the format and from nothing of ours.

read() takes JSON of any version and binary of 1.1.3; both come out alike, in terms of version
1.1.3, so that two files can be compared field by field. Refuses bytes that are left over.
"""

import json
import math
import struct

NO_LABEL = 0xFFFFFFFF
IDENTITY = {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}
ZERO3 = [0.0, 0.0, 0.0]

# Class -> its fields beside those of the classes it extends: name, binary reader, default.
NODE = [("position", "vec3d", ZERO3), ("last_update_time_ns", "u64", 0),
        ("is_active", "bool", False), ("is_predicted", "bool", False)]
SEMANTIC = NODE + [("name", "text", ""), ("color", "color", {"r": 0, "g": 0, "b": 0, "a": 255}),
                   ("bounding_box", "box", None), ("semantic_label", "u32", NO_LABEL),
                   ("semantic_feature", "feature", {"rows": 0, "cols": 0, "data": None})]
OBJECT = SEMANTIC + [("mesh_connections", "u64s", []), ("registered", "bool", False),
                     ("world_R_object", "quaternion", IDENTITY)]
PLACE_LISTS = [("voxblox_mesh_connections", "links", []), ("pcl_mesh_connections", "u64s", []),
               ("mesh_vertex_labels", "u8s", []), ("deformation_connections", "u64s", [])]
CLASSES = {
    "NodeAttributes": NODE,
    "SemanticNodeAttributes": SEMANTIC,
    "ObjectNodeAttributes": OBJECT,
    "RoomNodeAttributes": SEMANTIC + [("semantic_class_probabilities", "probabilities", {})],
    "PlaceNodeAttributes": SEMANTIC + [("distance", "f64", 0.0), ("num_basis_points", "u32", 0)] +
                           PLACE_LISTS +
                           [("real_place", "bool", False), ("active_frontier", "bool", False),
                            ("frontier_scale", "vec3d", ZERO3),
                            ("orientation", "quaternion", IDENTITY),
                            ("need_cleanup", "bool", False), ("num_frontier_voxels", "u64", 0),
                            ("anti_frontier", "bool", False)],
    "Place2dNodeAttributes": SEMANTIC + [("boundary", "vec3ds", []),
                                         ("ellipse_centroid", "vec3d", ZERO3),
                                         ("ellipse_matrix_compress", "matrix2", [0.0] * 4),
                                         ("ellipse_matrix_expand", "matrix2", [0.0] * 4),
                                         ("pcl_boundary_connections", "u64s", [])] + PLACE_LISTS +
                             [("need_cleanup_splitting", "bool", False),
                              ("has_active_mesh_indices", "bool", False)],
    "AgentNodeAttributes": NODE + [("timestamp", "i64", 0),
                                   ("world_R_body", "quaternion", IDENTITY),
                                   ("external_key", "u64", None), ("dbow_ids", "column", None),
                                   ("dbow_values", "column", None)],
    "KhronosObjectAttributes": OBJECT + [("first_observed_ns", "u64s", []),
                                         ("last_observed_ns", "u64s", []),
                                         ("trajectory_positions", "vec3fs", []),
                                         ("trajectory_timestamps", "u64s", []),
                                         ("dynamic_object_points", "clouds", []),
                                         ("details", "details", {}), ("mesh", "mesh", None)],
    "TraversabilityNodeAttributes": NODE + [("first_observed_ns", "u64", 0),
                                            ("last_observed_ns", "u64", 0),
                                            ("distance", "f64", 0.0),
                                            ("min", "vec2", [0.0, 0.0]),
                                            ("max", "vec2", [0.0, 0.0]),
                                            ("states_0", "u8s", []), ("states_1", "u8s", []),
                                            ("states_2", "u8s", []), ("states_3", "u8s", [])],
}
CLASSES["FrontierNodeAttributes"] = CLASSES["PlaceNodeAttributes"]

WIDTHS = {0xCA: "<f", 0xCB: "<d", 0xCC: "<B", 0xCD: "<H", 0xCE: "<I", 0xCF: "<Q", 0xD0: "<b",
          0xD1: "<h", 0xD2: "<i", 0xD3: "<q"}


class Binary:
    """Tagged little-endian values, each checked against the type that the format has there."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def tagged(self, *tags):
        tag = self.byte()
        if tag not in tags:
            raise ValueError(f"byte {self.at - 1}: tag {tag:#x}, not {[hex(t) for t in tags]}")
        form = WIDTHS[tag]
        value = struct.unpack_from(form, self.data, self.at)[0]
        self.at += struct.calcsize(form)
        return value

    def count(self):
        if self.byte() != 0xDD:
            raise ValueError(f"byte {self.at - 1}: no array")
        self.at += 4
        return struct.unpack_from("<I", self.data, self.at - 4)[0]

    def fixed(self, count):
        if self.count() != count:
            raise ValueError(f"byte {self.at}: no array of {count}")

    def begins(self, marker):
        if self.data[self.at] != marker:
            return False
        self.at += 1
        return True

    def bool(self):
        tag = self.byte()
        if tag not in (0xC2, 0xC3):
            raise ValueError(f"byte {self.at - 1}: no bool")
        return tag == 0xC3

    def text(self):
        size = self.count()
        self.at += size
        return self.data[self.at - size:self.at].decode("utf-8")

    def u8(self):
        return self.tagged(0xCC)

    def u32(self):
        return self.tagged(0xCE)

    def u64(self):
        return self.tagged(0xCF)

    def i64(self):
        return self.tagged(0xD3)

    def f32(self):
        return self.tagged(0xCA)

    def f64(self):
        return self.tagged(0xCB)

    def list(self, read):
        return [read() for _ in range(self.count())]

    def vec3d(self):
        return [self.f64() for _ in range(3)]

    def vec3f(self):
        return [self.f32() for _ in range(3)]

    def matrix(self, read):
        size = self.count()
        rows, columns = self.i64(), self.i64()
        if rows * columns + 2 != size:
            raise ValueError(f"byte {self.at}: a matrix of {rows} x {columns} in {size}")
        return rows, columns, [read() for _ in range(size - 2)]

    def number(self):
        return self.tagged(0xCA, 0xCB, 0xCE)

    def vec2(self):
        return self.matrix(self.f64)[2]

    matrix2 = vec2

    def column(self):
        return self.matrix(self.number)[2] or None

    def feature(self):
        rows, columns, data = self.matrix(self.f32)
        return {"rows": rows, "cols": columns, "data": data or None}

    def quaternion(self):
        self.fixed(4)
        return dict(zip("wxyz", [self.f64() for _ in range(4)]))

    def color(self):
        return dict(zip("rgba", [self.u8() for _ in range(4)]))

    def box(self):
        self.fixed(4)
        kind = self.tagged(0xD2)
        dimensions, center = self.vec3f(), self.vec3f()
        rotation = self.matrix(self.f32)[2]
        return {"type": ["INVALID", "AABB", "OBB", "RAABB"][kind], "dimensions": dimensions,
                "world_P_center": center, "rotation": rotation}

    def u64s(self):
        return self.list(self.u64)

    def u8s(self):
        return self.list(self.u8)

    def vec3ds(self):
        return self.list(self.vec3d)

    def vec3fs(self):
        return self.list(self.vec3f)

    def clouds(self):
        return self.list(self.vec3fs)

    def probabilities(self):
        return {self.text(): self.f64() for _ in range(self.count())}

    def details(self):
        return {self.text(): self.u64s() for _ in range(self.count())}

    def link(self):
        self.fixed(4)
        self.fixed(3)
        block = [self.tagged(0xD2) for _ in range(3)]
        self.fixed(3)
        position = self.vec3d()
        vertex = self.u64()
        label = None if self.begins(0xC0) else self.u32()
        return {"block": block, "voxel_pos": position, "vertex": vertex, "label": label}

    def links(self):
        return self.list(self.link)

    def face(self):
        self.fixed(3)
        return [self.u64() for _ in range(3)]

    def mesh(self):
        flags = [self.bool() for _ in range(4)]
        mesh = dict(zip(("has_colors", "has_timestamps", "has_labels", "has_first_seen_stamps"),
                        flags))
        for name, read in (("points", self.vec3f), ("colors", self.color), ("stamps", self.u64),
                           ("labels", self.u32), ("first_seen_stamps", self.u64),
                           ("faces", self.face)):
            mesh[name] = self.list(read)
        return mesh

    def key(self):
        self.fixed(2)
        return [self.i64(), self.u32()]

    def graph(self):
        if self.text() != "SPARK_DSG":
            raise ValueError("no header")
        self.text()
        if [self.u8() for _ in range(3)] != [1, 1, 3]:
            raise ValueError("not version 1.1.3")
        graph = {"layer_keys": self.list(self.key)}
        node_classes, edge_classes = self.list(self.text), self.list(self.text)
        graph["layer_names"] = {self.text(): self.key() for _ in range(self.count())}
        graph["metadata"] = json.loads(self.text())
        graph["nodes"], graph["edges"] = {}, {}
        if not self.begins(0x00):
            raise ValueError("no list of nodes")
        while not self.begins(0x01):
            self.fixed(4)
            layer, name, partition = self.i64(), self.u64(), self.u32()
            kind = node_classes[self.u8()]
            node = {"type": kind, "metadata": json.loads(self.text())}
            for field, reader, _ in CLASSES[kind]:
                node[field] = getattr(self, reader)()
            graph["nodes"][name] = {"key": [layer, partition], **node}
        if not self.begins(0x00):
            raise ValueError("no list of edges")
        while not self.begins(0x01):
            self.fixed(3)
            ends = tuple(sorted((self.u64(), self.u64())))
            if edge_classes[self.u8()] != "EdgeAttributes":
                raise ValueError("an edge of another class")
            graph["edges"][ends] = {"metadata": json.loads(self.text()), "weighted": self.bool(),
                                    "weight": self.f64()}
        graph["mesh"] = self.mesh() if self.bool() else None
        if self.at != len(self.data):
            raise ValueError(f"{len(self.data) - self.at} bytes are left")
        return graph


def single(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def upgrade_color(color):
    if isinstance(color, list):
        return dict(zip("rgba", (color + [255])[:4]))
    return {"a": 255, **color}


def upgrade_box(box):
    if not box or box["type"] in (None, "INVALID", 0):
        return {"type": "INVALID"}
    dimensions = box.get("dimensions") or [
        single(single(b) - single(a)) for a, b in zip(box["min"], box["max"])]
    return {"type": box["type"], "dimensions": [single(d) for d in dimensions],
            "world_P_center": [single(c) for c in box["world_P_center"]],
            "rotation": matrix_of(box.get("world_R_center", IDENTITY))}


def matrix_of(q):
    norm = math.sqrt(sum(v * v for v in q.values())) or 1.0
    w, x, y, z = (q[k] / norm for k in "wxyz")
    return [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
            2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
            2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]


def upgrade_node(name, node):
    found = dict(node["attributes"])
    kind = found["type"]
    out = {"type": "PlaceNodeAttributes" if kind.startswith("Frontier") else kind,
           "metadata": found.get("metadata") or {}}
    if "timestamp" in node:
        found.setdefault("timestamp", node["timestamp"])
    for field, _, default in CLASSES[kind]:
        value = found.get(field)
        out[field] = default if value is None else value
    if "external_key" in out and out["external_key"] is None:
        out["external_key"] = name
    if "color" in out:
        out["color"] = upgrade_color(out["color"])
        out["bounding_box"] = upgrade_box(out["bounding_box"])
    for link in out.get("voxblox_mesh_connections", []):
        link.setdefault("label", None)
    partition = node.get("partition", name >> 56 if "timestamp" in node else 0)
    return {"key": [node["layer"], partition], **out}


def from_json(text):
    root = json.loads(text)
    graph = {"layer_keys": [[k["layer"], k["partition"]] for k in root.get("layer_keys", [])],
             "layer_names": {n: [k["layer"], k["partition"]] if isinstance(k, dict) else [k, 0]
                             for n, k in root.get("layer_names", {}).items()},
             "metadata": root.get("metadata") or {}, "mesh": root.get("mesh")}
    graph["nodes"] = {n["id"]: upgrade_node(n["id"], n) for n in root["nodes"]}
    # What older files have as edges to the mesh, newer ones have as lists of the objects.
    for edge in root.get("mesh_edges") or []:
        connections = graph["nodes"][edge["source"]]
        connections.setdefault("from_edges", []).append(edge["target"])
    for node in graph["nodes"].values():
        from_edges = node.pop("from_edges", None)
        if from_edges and not node["mesh_connections"]:
            node["mesh_connections"] = from_edges
    graph["edges"] = {}
    for edge in root["edges"]:
        info = edge["info"]
        graph["edges"][tuple(sorted((edge["source"], edge["target"])))] = {
            "metadata": info.get("metadata") or {}, "weighted": info["weighted"],
            "weight": info["weight"]}
    return graph


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    if data[:1] == b"\xdd":
        graph = Binary(data).graph()
        for node in graph["nodes"].values():
            if node.get("bounding_box", {}).get("type") == "INVALID":
                node["bounding_box"] = {"type": "INVALID"}
        return graph
    return from_json(data.decode("utf-8"))


def same(a, b, digits=0.0):
    """Numbers within `digits` of each other, relative to their size; all else equal."""
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    if isinstance(a, float) or isinstance(b, float):
        if a is None or b is None:
            return a is b
        both_nan = math.isnan(a) and math.isnan(b)
        return both_nan or a == b or abs(a - b) <= digits * max(1.0, abs(a), abs(b))
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(
            same(a[k], b[k], digits) for k in a)
    if isinstance(a, (list, tuple)):
        return isinstance(b, (list, tuple)) and len(a) == len(b) and all(
            same(x, y, digits) for x, y in zip(a, b))
    return a == b


def differences(first, second, digits=0.0):
    """What the second file says otherwise than the first, as sentences; [] when it says the same.

    `first` may be of an older version: the second may name layers that it did not name. The
    metadata of the whole graph may have our own key besides.
    """
    found = []
    for part in ("nodes", "edges"):
        for name in first[part].keys() - second[part].keys():
            found.append(f"{part} {name} is missing")
        for name in second[part].keys() - first[part].keys():
            found.append(f"{part} {name} is new")
        for name in first[part].keys() & second[part].keys():
            a, b = first[part][name], second[part][name]
            for field in a.keys() | b.keys():
                # Rotations come from quaternions in one form, as matrices in the other.
                close = 3e-7 if field == "bounding_box" else digits
                if not same(a.get(field), b.get(field), close):
                    found.append(f"{part} {name} {field}: {a.get(field)} became {b.get(field)}")
    for key in first["layer_keys"]:
        if key not in second["layer_keys"]:
            found.append(f"layer {key} is missing")
    for name, key in first["layer_names"].items():
        if second["layer_names"].get(name) != key:
            found.append(f"layer {name} is {second['layer_names'].get(name)}, not {key}")
    before, after = ({k: v for k, v in graph["metadata"].items() if k != "dsgdb"}
                     for graph in (first, second))
    if not same(before, after):
        found.append(f"metadata {before} became {after}")
    return found + mesh_differences(first["mesh"], second["mesh"])


def triangles(mesh):
    """Faces by what stands at their corners, since the numbers of vertices may change."""
    channels = [mesh.get(name) or [] for name in ("colors", "stamps", "labels",
                                                   "first_seen_stamps")]
    corners = [tuple(single(v) for v in p) for p in mesh.get("points") or []]
    looks = [(corners[i],) + tuple(json.dumps(c[i], sort_keys=True) for c in channels if c)
             for i in range(len(corners))]
    return sorted(looks), sorted(tuple(looks[i] for i in f) for f in mesh.get("faces") or [])


def mesh_differences(first, second):
    if not first or not first.get("points"):
        return [] if not second or not second.get("points") else ["a mesh has appeared"]
    if not second:
        return ["the mesh is missing"]
    a, b = triangles(first), triangles(second)
    names = ("vertices", "faces")
    return [f"mesh {n}: {len(x)} became {len(y)}" for n, x, y in zip(names, a, b) if x != y]
