# SPDX-License-Identifier: Apache-2.0
"""Questions about the map as a whole and its revisions; tags."""

from __future__ import annotations

import time
from typing import Generator, Iterator, Optional, Union

from dsgdb import v1
from dsgdb.errors import Cancelled, InvalidArgument, NotFound, ResourceExhausted, Unavailable
from dsgdb.graphs import Change, Diff, merge_diffs
from dsgdb.questions import Questions
from dsgdb.rows import Rows, join

# A revision by its number or its tag.
AnyRevision = Union[int, str]

_REVISIONS_PAGE_MAX = 1000
# How long a watch tries to reach a server that went away, and how often.
_WATCH_PATIENCE_S = 60.0
_WATCH_PAUSE_S = 0.5


class HistoryQuestions(Questions):
    """Revisions are counted from 1; 0 is the empty map."""

    def stats(self) -> v1.GetMapStatsResponse:
        """Counts of nodes, edges and poses, bytes on disk, the span of all poses."""
        return self.api.get_map_stats(v1.GetMapStatsRequest(**self._common()))

    def revisions(self, limit: Optional[int] = None, *,
                  before: int = 0) -> Rows[v1.Revision, v1.ListRevisionsResponse]:
        """Revisions, newest first, at most `limit`; only those below `before`, if it is not 0."""
        if limit is not None and limit < 1:
            raise InvalidArgument(f"limit {limit} is below 1; None is for all", "FIELD_INVALID",
                                  {"field": "limit", "value": str(limit)})
        rows: list[v1.Revision] = []
        while True:
            left = _REVISIONS_PAGE_MAX if limit is None else limit - len(rows)
            reply = self.api.list_revisions(v1.ListRevisionsRequest(
                map=self.spec.name, before_revision=rows[-1].revision if rows else before,
                # When all are there, one more call says whether there are others.
                page_size=min(max(left, 1), _REVISIONS_PAGE_MAX)))
            if not reply.revisions or left == 0:
                return Rows(v1.Revision, rows, v1.ListRevisionsResponse(reply.header), self.spec,
                            bool(reply.revisions))
            rows += reply.revisions

    def diff(self, start: AnyRevision, end: Optional[AnyRevision] = None, *, layer: str = "",
             view: v1.NodeView = v1.NodeView.NODE_VIEW_FULL, limit: Optional[int] = None) -> Diff:
        """What differs from revision `start` to `end` (the newest); of the nodes of one layer and
        their edges and tracks, if it is named.
        """
        request = v1.DiffRevisionsRequest(
            map=self.spec.name, from_revision=self._number(start),
            to_revision=None if end is None else self._number(end), layer=layer, view=view)
        return merge_diffs(self._pages(self.api.diff_revisions, request, limit, _change_count))

    def versions(self, node: str, *, view: v1.NodeView = v1.NodeView.NODE_VIEW_FULL,
                 limit: Optional[int] = None
                 ) -> Rows[v1.NodeVersion, v1.ListNodeVersionsResponse]:
        """What was believed of a node in the revisions that can be read, newest first: each
        version with the revision that wrote it and the one that ended it. A node that is gone is
        named by its id, any other one also by the name that it has now.
        """
        try:
            node = self._node_id(node)
        except NotFound:
            # The call says so, unless this is the id of a node that is gone.
            pass
        request = v1.ListNodeVersionsRequest(map=self.spec.name, id=node, view=view)
        return self._rows(v1.NodeVersion, self.api.list_node_versions, request, "versions", limit)

    def vocabulary(self, limit: Optional[int] = None
                   ) -> Rows[v1.Word, v1.ListVocabularyResponse]:
        """The words that `find` can use: kinds, classes and relations, with how many there are."""
        request = v1.ListVocabularyRequest(**self._common())
        return self._rows(v1.Word, self.api.list_vocabulary, request, "words", limit)

    def watch(self, after: Optional[AnyRevision] = None, *, changes: bool = False,
              idle: float = 5.0) -> Generator[Change, None, None]:
        """Each revision when it is committed, from the one behind `after` (the newest) on, for
        ever. If the server goes away, the watch tries for a minute to reach it again, and goes on
        behind the last revision that it gave. idle: seconds between signs of life of the server.
        """
        known = None if after is None else self._number(after)
        lost_at: Optional[float] = None
        while True:
            request = v1.WatchMapRequest(map=self.spec.name, after_revision=known, changes=changes,
                                         idle_period_ns=int(idle * 1e9))
            try:
                for message, change in _whole_changes(self.api.watch_map(request)):
                    lost_at = None
                    if message.header is not None:
                        # All up to this one has come whole.
                        known = message.header.read_revision
                    if change is not None:
                        yield change
            except (Cancelled, ResourceExhausted, Unavailable) as error:
                # A server that shuts down may cancel calls. A reader that was too slow is told so
                # without a reason, and may go on.
                if isinstance(error, ResourceExhausted) and error.reason:
                    raise
                lost_at = lost_at or time.monotonic()
                if time.monotonic() - lost_at > _WATCH_PATIENCE_S:
                    raise
            time.sleep(_WATCH_PAUSE_S)

    def tags(self) -> Rows[v1.Tag, v1.ListTagsResponse]:
        """Names of revisions, ascending."""
        reply = self.api.list_tags(v1.ListTagsRequest(map=self.spec.name))
        return join(v1.Tag, [reply], "tags", self.spec)

    def tag(self, name: str, revision: Optional[AnyRevision] = None,
            note: Optional[str] = None) -> v1.Tag:
        """Names a revision (the newest); an existing tag moves."""
        number = None if revision is None else self._number(revision)
        reply = self.api.set_tag(v1.SetTagRequest(map=self.spec.name, name=name, revision=number,
                                                  note=note))
        return reply.tag or v1.Tag()

    def untag(self, name: str) -> None:
        """Removes a tag, but not its revision. Errors: NOT_FOUND/TAG_UNKNOWN."""
        self.api.remove_tag(v1.RemoveTagRequest(map=self.spec.name, name=name))

    def _number(self, revision: AnyRevision) -> int:
        if not isinstance(revision, str):
            return revision
        tags = self.tags()
        for tag in tags:
            if tag.name == revision:
                return tag.revision
        names = ", ".join(tag.name for tag in tags) or "none"
        raise NotFound(f"map \"{self.spec.name}\" has no tag \"{revision}\"; it has {names}",
                       "TAG_UNKNOWN", {"map": self.spec.name, "tag": revision})


def _change_count(page: v1.DiffRevisionsResponse) -> int:
    return len(page.nodes) + len(page.edges) + len(page.tracks) + len(page.mesh_blocks)


def _whole_changes(messages: Iterator[v1.WatchMapResponse]
                   ) -> Iterator[tuple[v1.WatchMapResponse, Optional[Change]]]:
    """Each message, with the revision that it completes."""
    parts: list[v1.DiffRevisionsResponse] = []
    for message in messages:
        if message.revision is None:
            yield message, None
            continue
        if message.changes is not None:
            parts.append(message.changes)
        if message.complete:
            yield message, Change(message.revision.revision, message.revision,
                                  merge_diffs(parts) if parts else None)
            parts = []
