# SPDX-License-Identifier: Apache-2.0
"""Parts of a map as one value: a graph, the differences between two revisions."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, Iterable, Mapping, Optional

from dsgdb.rows import plain_value
from dsgdb.v1 import (DiffRevisionsResponse, Edge, EdgeChange, MapSpec, MeshChange, Node,
                      NodeChange, Revision, TrackChange)

if TYPE_CHECKING:
    import networkx
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
