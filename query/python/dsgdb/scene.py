# SPDX-License-Identifier: Apache-2.0
"""Questions about the graph: its nodes and edges, its mesh, and what is where."""

from __future__ import annotations

import hashlib
from typing import Iterable, Optional, Union

from dsgdb import meshes, v1
from dsgdb.errors import DataLoss, InvalidArgument
from dsgdb.graphs import Graph
from dsgdb.meshes import Mesh
from dsgdb.packed import encode_read_at
from dsgdb.questions import Box, Point, Questions, box as to_box, vector
from dsgdb.rows import Rows, join
from dsgdb.times import Instant

_FULL = v1.NodeView.NODE_VIEW_FULL


class SceneQuestions(Questions):
    """A node is named by its id ("O42") or by a name that no other node has. `at` asks for what
    was valid at that instant, and for agents where they were then; without it: for all nodes that
    the revision has.
    """

    def node(self, node: str, *, view: v1.NodeView = _FULL) -> v1.Node:
        """One node. Errors: NOT_FOUND/NODE_UNKNOWN."""
        return self.show(node, view=view).node or v1.Node()

    def show(self, node: str, *, view: v1.NodeView = _FULL) -> v1.GetNodeResponse:
        """One node with its ancestors, the number of its children, and the extent of its track."""
        return self.api.get_node(v1.GetNodeRequest(**self._common(), id=node, view=view))

    def nodes(self, *, layer: str = "", kind: str = "", class_name: str = "", name: str = "",
              parent: str = "", box: Optional[Box] = None, at: Optional[Instant] = None,
              view: v1.NodeView = _FULL,
              limit: Optional[int] = None) -> Rows[v1.Node, v1.ListNodesResponse]:
        """Nodes in ascending order of id; of all conditions that are given."""
        where = v1.NodeFilter(layer=layer, kind=kind, class_name=class_name, parent_id=parent,
                              box=to_box(box), at_ns=self._ns(at, "at"), name=name)
        request = v1.ListNodesRequest(**self._common(), filter=where, view=view)
        found = self._rows(v1.Node, self.api.list_nodes, request, "nodes", limit)
        if not found:
            self._check_words(_words(where))
        return found

    def edges(self, *, source: str = "", relation: str = "", target: str = "",
              at: Optional[Instant] = None,
              limit: Optional[int] = None) -> Rows[v1.Edge, v1.ListEdgesResponse]:
        """Edges in ascending order of source, relation, target."""
        request = v1.ListEdgesRequest(**self._common(), source=source, relation=relation,
                                      target=target, at_ns=self._ns(at, "at"))
        found = self._rows(v1.Edge, self.api.list_edges, request, "edges", limit)
        if not found and relation:
            self._check_words(v1.NodePattern(relations=(v1.RelationCondition(relation),)))
        return found

    def find(self, query: Union[str, v1.NodePattern], *, near: Optional[Point] = None,
             max_distance_m: float = 0.0, box: Optional[Box] = None, at: Optional[Instant] = None,
             view: v1.NodeView = _FULL, explain: bool = False,
             limit: Optional[int] = None) -> Rows[v1.SearchHit, v1.SearchNodesResponse]:
        """Nodes by the query language of docs/search.md: "red cup on table in kitchen". With `near`
        the nearest come first, with their distances.

        Errors: INVALID_ARGUMENT/QUERY_MALFORMED with the position in the metadata; NOT_FOUND for a
        word that the map does not know, with similar ones.
        """
        request = self._search(query, near, max_distance_m, box, at, view=view, explain=explain)
        return self._rows(v1.SearchHit, self.api.search_nodes, request, "hits", limit)

    def count(self, query: Union[str, v1.NodePattern], *, near: Optional[Point] = None,
              max_distance_m: float = 0.0, box: Optional[Box] = None,
              at: Optional[Instant] = None) -> int:
        """How many nodes `find` finds."""
        request = self._search(query, near, max_distance_m, box, at, count_only=True)
        return self.api.search_nodes(request).hit_count

    def near(self, position: Point, k: int = 5, *, max_distance_m: float = 0.0, layer: str = "",
             kind: str = "", class_name: str = "", at: Optional[Instant] = None,
             view: v1.NodeView = _FULL) -> Rows[v1.NearestNode, v1.ListNearestNodesResponse]:
        """The k nodes nearest to a point by distance to their boxes. Agents only with `at` and a
        layer or kind that selects them.
        """
        where = v1.NodeFilter(layer=layer, kind=kind, class_name=class_name,
                              at_ns=self._ns(at, "at"))
        reply = self.api.list_nearest_nodes(v1.ListNearestNodesRequest(
            **self._common(), position=vector(position, "position"), k=k, filter=where,
            max_distance_m=max_distance_m, view=view))
        if not reply.nodes:
            self._check_words(_words(where))
        return join(v1.NearestNode, [reply], "nodes", self.spec)

    def around(self, node: str, *, relations: Iterable[str] = (), outgoing: bool = False,
               incoming: bool = False, at: Optional[Instant] = None, view: v1.NodeView = _FULL,
               limit: Optional[int] = None) -> Rows[v1.Neighbor, v1.GetNeighborsResponse]:
        """The edges of a node with the nodes at their other ends; of both directions unless one is
        asked for.
        """
        request = v1.GetNeighborsRequest(
            **self._common(), id=node, relations=_listed(relations, "relations"),
            outgoing=outgoing, incoming=incoming, at_ns=self._ns(at, "at"), view=view)
        return self._rows(v1.Neighbor, self.api.get_neighbors, request, "neighbors", limit)

    def subgraph(self, root: str, *, relations: Iterable[str] = (), both_directions: bool = False,
                 depth_max: int = 0, layer: str = "", kind: str = "", class_name: str = "",
                 box: Optional[Box] = None, at: Optional[Instant] = None, tree_only: bool = False,
                 view: v1.NodeView = _FULL) -> Graph:
        """A node and all that can be reached from it over `relations` (CONTAINS), through nodes
        that match. tree_only: only the edges that were followed.
        """
        where = v1.NodeFilter(layer=layer, kind=kind, class_name=class_name, box=to_box(box),
                              at_ns=self._ns(at, "at"))
        messages = list(self.api.get_subgraph(v1.GetSubgraphRequest(
            **self._common(), root=root, relations=_listed(relations, "relations"),
            both_directions=both_directions, depth_max=depth_max, filter=where, view=view,
            tree_only=tree_only)))
        nodes = tuple(node for message in messages for node in message.nodes)
        if len(nodes) <= 1:
            self._check_words(_words(where))
        header = messages[0].header or v1.ResponseHeader()
        return Graph(self.spec, header.read_revision, nodes,
                     tuple(edge for message in messages for edge in message.edges))

    def graph(self, *, layers: Iterable[str] = (), relations: Iterable[str] = (),
              at: Optional[Instant] = None, view: v1.NodeView = _FULL) -> Graph:
        """The nodes of some layers (none named = of all), and the edges of some relations (of all)
        between them, of one revision.
        """
        here = self._pinned()
        nodes: list[v1.Node] = []
        for layer in _listed(layers, "layers") or ("",):
            nodes += here.nodes(layer=layer, at=at, view=view)
        ids = {node.id for node in nodes}
        edges = [edge for relation in _listed(relations, "relations") or ("",)
                 for edge in here.edges(relation=relation, at=at)
                 if edge.source in ids and edge.target in ids]
        return Graph(self.spec, here.revision(), tuple(nodes), tuple(edges))

    def mesh(self, node: str = "", *, box: Optional[Box] = None) -> Mesh:
        """The triangles of the map, of one object, structure, room or region, or of the blocks that
        a box touches. A map without a mesh has none.
        """
        request = meshes.encode_request(self.spec.name, encode_read_at(self._read_at), node,
                                        to_box(box))
        with self.api.binary_stream("dsg.v1.QueryService/GetMesh", request) as messages:
            return Mesh(messages)

    def asset(self, sha256: Union[str, bytes]) -> bytes:
        """The content with this digest (32 bytes, or 64 hexadecimal digits): a CAD model, a body
        model. Errors: NOT_FOUND/ASSET_UNKNOWN.
        """
        digest = _digest(sha256)
        parts = self.api.get_asset(v1.GetAssetRequest(**self._common(), sha256=digest))
        content = b"".join(part.content for part in parts)
        if hashlib.sha256(content).digest() != digest:
            raise DataLoss(f"what came for asset {digest.hex()} has another digest; dsg verify "
                           "looks at the map", "STORE_CORRUPT")
        return content

    def revision(self) -> int:
        """The revision that questions are answered from now."""
        stats = self.api.get_map_stats(v1.GetMapStatsRequest(**self._common()))
        return stats.header.read_revision if stats.header else 0

    def _pinned(self) -> SceneQuestions:
        """This map at the revision that it has now."""
        return SceneQuestions(self.api, self.spec, v1.ReadAt(exact_revision=self.revision()))

    def _search(self, query: Union[str, v1.NodePattern], near: Optional[Point],
                max_distance_m: float, box: Optional[Box], at: Optional[Instant], *,
                view: v1.NodeView = _FULL, explain: bool = False,
                count_only: bool = False) -> v1.SearchNodesRequest:
        if max_distance_m and near is None:
            raise InvalidArgument("max_distance_m is the distance to near; name both",
                                  "FIELD_INVALID", {"field": "max_distance_m"})
        return v1.SearchNodesRequest(
            **self._common(), query=query if isinstance(query, str) else None,
            pattern=None if isinstance(query, str) else query, at_ns=self._ns(at, "at"),
            near=None if near is None else vector(near, "near"), max_distance_m=max_distance_m,
            box=to_box(box), view=view, explain=explain, count_only=count_only)


def _words(where: v1.NodeFilter) -> v1.NodePattern:
    return v1.NodePattern(layer=where.layer, kind=where.kind, class_name=where.class_name)


def _listed(words: Iterable[str], what: str) -> tuple[str, ...]:
    if isinstance(words, str):
        raise InvalidArgument(f"{what} \"{words}\" is one word; write [\"{words}\"]",
                              "FIELD_INVALID", {"field": what, "value": words})
    return tuple(words)


def _digest(sha256: Union[str, bytes]) -> bytes:
    try:
        return bytes.fromhex(sha256) if isinstance(sha256, str) else bytes(sha256)
    except ValueError:
        raise InvalidArgument(f"sha256 \"{sha256!r}\" is no hexadecimal digest", "FIELD_INVALID",
                              {"field": "sha256"}) from None
