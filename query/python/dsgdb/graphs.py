# SPDX-License-Identifier: Apache-2.0
"""Parts of a map as one value: a graph, a mesh, the differences between two revisions."""

from __future__ import annotations

import dataclasses
import math
from array import array
from typing import TYPE_CHECKING, Any, Iterable, Mapping, NamedTuple, Optional

from dsgdb.rows import plain_value
from dsgdb.v1 import (DiffRevisionsResponse, Edge, EdgeChange, MapSpec, MeshChange, Node,
                      NodeChange, Revision, TrackChange)

if TYPE_CHECKING:
    import networkx
    import numpy
    import pandas


@dataclasses.dataclass(frozen=True)
class Graph:
    """Nodes, and the edges between them, of one revision."""

    spec: MapSpec
    revision: int
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]

    def to_networkx(self) -> networkx.MultiDiGraph:
        """Nodes by id with layer, kind, name, class_name, position (x, y, z) and the Node itself;
        edges keyed by their relation with weight and the times of their validity. Attributes of
        the map keep their names, behind those.
        """
        import networkx
        graph = networkx.MultiDiGraph(map=self.spec.name, frame=self.spec.frame,
                                      revision=self.revision)
        for node in self.nodes:
            pose = node.map_T_node
            known: dict[str, Any] = {
                "layer": node.layer, "kind": node.kind, "name": node.name,
                "class_name": node.semantic_class.name if node.semantic_class else "",
                "position": tuple(pose.position) if pose and pose.position else None,
                "valid_from_ns": node.valid_from_ns, "valid_to_ns": node.valid_to_ns, "node": node}
            graph.add_node(node.id, **{**_plain(node.attributes), **known})
        for edge in self.edges:
            known = {"weight": edge.weight, "valid_from_ns": edge.valid_from_ns,
                     "valid_to_ns": edge.valid_to_ns}
            graph.add_edge(edge.source, edge.target, key=edge.relation,
                           **{**_plain(edge.attributes), **known})
        return graph


def _plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {name: plain_value(value) for name, value in attributes.items()}


class MeshArrays(NamedTuple):
    """One mesh in numpy; None where no block of the map has such values, 0 where one lacks them."""

    # (n, 3) float32, map frame, metres.
    vertices: numpy.ndarray[Any, Any]
    # (m, 3) uint32, rows of `vertices`.
    faces: numpy.ndarray[Any, Any]
    # (n, 3) uint8: red, green, blue.
    colors: Optional[numpy.ndarray[Any, Any]]
    # (n, 3) float32.
    normals: Optional[numpy.ndarray[Any, Any]]
    # (n,) uint32: semantic class; the object that the vertex belongs to.
    labels: Optional[numpy.ndarray[Any, Any]]
    instance_ids: Optional[numpy.ndarray[Any, Any]]


class Mesh:
    """The triangles of a map, or of one node, as flat arrays of the standard library: vertices and
    normals x y z, faces three indices each, colors 0xRRGGBB.
    """

    # Columns with their numbers a vertex, and the fields of MeshBlock that they come from.
    _COLUMNS = (("normals", "f", 3), ("colors", "I", 1), ("labels", "I", 1),
                ("instance_ids", "I", 1))

    def __init__(self, revision: int = 0) -> None:
        self.revision = revision
        self.vertices = array("f")
        self.faces = array("I")
        self.normals = array("f")
        self.colors = array("I")
        self.labels = array("I")
        self.instance_ids = array("I")

    def add(self, block: Mapping[str, Any]) -> None:
        """Adds the JSON of a MeshBlock."""
        first = len(self.vertices) // 3
        self.vertices.extend(block["positions"])
        self.faces.extend(first + int(corner) for corner in block["faces"])
        count = len(block["positions"]) // 3
        for name, _, size in self._COLUMNS:
            values = block.get(name) or ()
            column: Any = getattr(self, name)
            if values and not column:
                column.extend([0] * (first * size))
            if values or column:
                column.extend(values or [0] * (count * size))

    def to_numpy(self) -> MeshArrays:
        """Arrays in the shapes that mesh libraries take; `MeshArrays` says which."""
        import numpy
        found: dict[str, Any] = {}
        for name, kind, size in self._COLUMNS:
            column = getattr(self, name)
            values = numpy.frombuffer(column, kind) if column else None
            found[name] = values.reshape(-1, 3) if values is not None and size == 3 else values
        if found["colors"] is not None:
            found["colors"] = numpy.stack([found["colors"] >> shift & 0xff for shift in (16, 8, 0)],
                                          axis=1).astype("u1")
        return MeshArrays(numpy.frombuffer(self.vertices, "f").reshape(-1, 3),
                          numpy.frombuffer(self.faces, "I").reshape(-1, 3), **found)

    def __repr__(self) -> str:
        return (f"<Mesh: {len(self.vertices) // 3} vertices, {len(self.faces) // 3} faces, "
                f"revision {self.revision}>")


@dataclasses.dataclass(frozen=True)
class Diff:
    """What differs between two revisions."""

    from_revision: int
    to_revision: int
    nodes: tuple[NodeChange, ...] = ()
    edges: tuple[EdgeChange, ...] = ()
    tracks: tuple[TrackChange, ...] = ()
    mesh_blocks: tuple[MeshChange, ...] = ()

    def __len__(self) -> int:
        return len(self.nodes) + len(self.edges) + len(self.tracks) + len(self.mesh_blocks)

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each change: what ("node", "edge", "track", "mesh block"), type (ADDED,
        REMOVED, CHANGED), id, kind, name, and how far a node moved, metres.
        """
        import pandas
        rows = [_node_row(change) for change in self.nodes]
        for edge in self.edges:
            one = edge.after or edge.before or Edge()
            rows.append(("edge", str(edge.type), f"{one.source} {one.relation} {one.target}",
                         one.relation, "", math.nan))
        for track in self.tracks:
            kind = "ADDED" if not track.pose_count_before else (
                "REMOVED" if not track.pose_count_after else "CHANGED")
            rows.append(("track", kind, track.agent_id, "", "", math.nan))
        for mesh in self.mesh_blocks:
            at = mesh.index
            rows.append(("mesh block", str(mesh.type), f"{at.x},{at.y},{at.z}" if at else "", "",
                         "", math.nan))
        return pandas.DataFrame(rows, columns=["what", "type", "id", "kind", "name", "moved_m"])


def _node_row(change: NodeChange) -> tuple[str, str, str, str, str, float]:
    before, after = change.before, change.after
    one = after or before or Node()
    moved = math.nan
    if before and after and before.map_T_node and after.map_T_node:
        old, new = before.map_T_node.position, after.map_T_node.position
        if old and new:
            moved = math.dist(tuple(old), tuple(new))
    return "node", str(change.type), one.id, one.kind, one.name, moved


def merge_diffs(pages: Iterable[DiffRevisionsResponse]) -> Diff:
    """The pages of one answer; at least one."""
    all_pages = list(pages)
    first = all_pages[0]
    return Diff(first.from_revision, first.to_revision,
                tuple(change for page in all_pages for change in page.nodes),
                tuple(change for page in all_pages for change in page.edges),
                tuple(change for page in all_pages for change in page.tracks),
                tuple(change for page in all_pages for change in page.mesh_blocks))


@dataclasses.dataclass(frozen=True)
class Change:
    """A revision that was committed during a watch."""

    revision: int
    record: Revision
    # What changed, if it was asked for.
    diff: Optional[Diff] = None
