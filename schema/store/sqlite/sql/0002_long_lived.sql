-- SPDX-License-Identifier: Apache-2.0
-- Format 2: what a map needs that is kept for years. docs/storage_format.md explains.

-- Revisions before this one are gone, but for those that have a tag.
ALTER TABLE map ADD COLUMN oldest_revision INTEGER NOT NULL DEFAULT 0;
-- Counts how often the past was rewritten (erased from), so that readers drop what they keep of it.
ALTER TABLE map ADD COLUMN generation INTEGER NOT NULL DEFAULT 0;
-- 1 from the begin of an erasure until the file and the log hold nothing of it.
ALTER TABLE map ADD COLUMN is_erasing INTEGER NOT NULL DEFAULT 0;

-- Set where the revision before is gone: what its digest was.
ALTER TABLE revision ADD COLUMN parent_digest BLOB;

ALTER TABLE tag ADD COLUMN created_ns INTEGER NOT NULL DEFAULT 0;
ALTER TABLE tag ADD COLUMN note TEXT NOT NULL DEFAULT '';

-- How far each session got, so that its deltas are known when its revisions are gone.
CREATE TABLE session (
  session_id TEXT PRIMARY KEY,
  last_sequence INTEGER NOT NULL,
  last_revision INTEGER NOT NULL,
  first_revision INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
INSERT INTO session
  SELECT session_id, max(sequence), max(revision), min(revision) FROM revision GROUP BY session_id;

-- Shapes and factors that are no longer believed. `id` is that of the row's time as a current one;
-- it may have been given again since.
CREATE TABLE shape_history (
  id INTEGER NOT NULL,
  agent INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  rev_to INTEGER NOT NULL,
  t0 INTEGER NOT NULL,
  t1 INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE UNIQUE INDEX shape_history_id ON shape_history (id, rev_from);
CREATE INDEX shape_history_agent ON shape_history (agent, t0);
CREATE INDEX shape_history_rev_to ON shape_history (rev_to);

CREATE TABLE factor_history (
  id INTEGER NOT NULL,
  agent INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  rev_to INTEGER NOT NULL,
  t0 INTEGER NOT NULL,
  t1 INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE UNIQUE INDEX factor_history_id ON factor_history (id, rev_from);
CREATE INDEX factor_history_agent ON factor_history (agent, t0);
CREATE INDEX factor_history_rev_to ON factor_history (rev_to);

-- A node's cell in a grid that is as coarse as the node is large: candidates only.
CREATE TABLE node_cell (
  cell INTEGER NOT NULL,
  key INTEGER NOT NULL,
  PRIMARY KEY (cell, key)
) STRICT, WITHOUT ROWID;
DROP TABLE node_box;

-- In the order of ids. The layer stands in it so that listing one reads no other nodes.
DROP INDEX node_layer;
DROP INDEX node_order;
CREATE INDEX node_order ON node (key & 255, key >> 8, layer);

-- Assets that nothing refers to any more and that compaction dropped: they still count in the
-- digests of the revisions that are kept.
CREATE TABLE dropped_asset (
  sha256 BLOB NOT NULL,
  rev_from INTEGER NOT NULL,
  PRIMARY KEY (sha256, rev_from)
) STRICT, WITHOUT ROWID;

-- Assets to which erased rows referred, until it is known whether others do.
CREATE TABLE doubtful_asset (
  sha256 BLOB PRIMARY KEY
) STRICT, WITHOUT ROWID;

-- What is being erased: the keys that are named (as in `touched`) and spans of tracks. The rows in
-- which they are found may be gone when an erasure is cut off. No row when none is.
CREATE TABLE pending_erasure (
  one INTEGER PRIMARY KEY CHECK (one = 1),
  assets INTEGER NOT NULL,
  keys BLOB NOT NULL,
  spans BLOB NOT NULL,
  checksum INTEGER NOT NULL
) STRICT;
