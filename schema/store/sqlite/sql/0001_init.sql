-- SPDX-License-Identifier: Apache-2.0
-- One map, with its history. docs/storage_format.md explains; never edited after a release.
--
-- node keys:  a NodeId rotated left by 8 bits (index * 256 + letter), so that small indices make
--             small integers: 8 bytes less in every row and index entry that names a node.
-- rev_from:   the revision that wrote the row; rev_to: the revision that ended it.
-- checksum:   XXH3 of the row's payload and columns, seeded by its key.

CREATE TABLE map (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  name TEXT NOT NULL,
  frame TEXT NOT NULL,
  epoch_ns INTEGER NOT NULL,
  clock INTEGER NOT NULL,
  codec INTEGER NOT NULL,
  gap_ns_max INTEGER NOT NULL,
  mesh_block_size_m REAL NOT NULL
) STRICT;

CREATE TABLE layer (
  id INTEGER PRIMARY KEY,
  name TEXT NOT NULL UNIQUE,
  rank INTEGER NOT NULL,
  rev_from INTEGER NOT NULL
) STRICT;

CREATE TABLE label (
  id INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  name TEXT NOT NULL,
  PRIMARY KEY (id, rev_from)
) STRICT, WITHOUT ROWID;

-- Names of relations, so that edges hold a small number.
CREATE TABLE relation (
  id INTEGER PRIMARY KEY,
  name TEXT NOT NULL UNIQUE
) STRICT;

CREATE TABLE revision (
  revision INTEGER PRIMARY KEY,
  digest BLOB NOT NULL,
  content BLOB NOT NULL,
  committed_ns INTEGER NOT NULL,
  author TEXT NOT NULL,
  message TEXT NOT NULL,
  session_id TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  config_digest TEXT NOT NULL,
  node_count INTEGER NOT NULL,
  edge_count INTEGER NOT NULL,
  agent_count INTEGER NOT NULL,
  pose_count INTEGER NOT NULL,
  stay_count INTEGER NOT NULL,
  mesh_block_count INTEGER NOT NULL,
  first_pose_ns INTEGER,
  last_pose_ns INTEGER,
  -- "layer:count" separated by spaces.
  layer_counts TEXT NOT NULL
) STRICT;
CREATE UNIQUE INDEX revision_session ON revision (session_id, sequence);

-- Keys of the nodes, edges, tracks and mesh blocks that the revision wrote or ended, so that what
-- lies between two revisions is found at the cost of the difference. Maps made before this table
-- do without.
CREATE TABLE touched (
  revision INTEGER PRIMARY KEY,
  payload BLOB NOT NULL,
  checksum INTEGER NOT NULL
) STRICT;

CREATE TABLE tag (
  name TEXT PRIMARY KEY,
  revision INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

CREATE TABLE node (
  key INTEGER PRIMARY KEY,
  rev_from INTEGER NOT NULL,
  layer INTEGER NOT NULL,
  name TEXT NOT NULL,
  payload BLOB NOT NULL,
  checksum INTEGER NOT NULL
) STRICT;
CREATE INDEX node_order ON node (key & 255, key >> 8);
CREATE INDEX node_layer ON node (layer, key & 255, key >> 8);
CREATE INDEX node_name ON node (name) WHERE name <> '';

CREATE TABLE node_history (
  key INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  rev_to INTEGER NOT NULL,
  layer INTEGER NOT NULL,
  name TEXT NOT NULL,
  payload BLOB NOT NULL,
  checksum INTEGER NOT NULL
) STRICT;
CREATE UNIQUE INDEX node_history_key ON node_history (key, rev_from);
CREATE INDEX node_history_rev_to ON node_history (rev_to);

CREATE TABLE edge (
  source INTEGER NOT NULL,
  relation INTEGER NOT NULL,
  target INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  weight REAL NOT NULL,
  -- Validity and attributes; empty for nearly all.
  payload BLOB NOT NULL,
  checksum INTEGER NOT NULL,
  PRIMARY KEY (source, relation, target)
) STRICT, WITHOUT ROWID;
CREATE INDEX edge_reverse ON edge (target, relation, source);

CREATE TABLE edge_history (
  source INTEGER NOT NULL,
  relation INTEGER NOT NULL,
  target INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  rev_to INTEGER NOT NULL,
  weight REAL NOT NULL,
  payload BLOB NOT NULL,
  checksum INTEGER NOT NULL
) STRICT;
CREATE UNIQUE INDEX edge_history_key ON edge_history (source, relation, target, rev_from);
CREATE INDEX edge_history_reverse ON edge_history (target, relation);
CREATE INDEX edge_history_rev_to ON edge_history (rev_to);

-- Agents that have poses. `slot` is the high part of the segments' ids.
CREATE TABLE track (
  slot INTEGER PRIMARY KEY,
  agent INTEGER NOT NULL UNIQUE
) STRICT;

-- How far a track reached at the end of each revision that touched it. Poses are appended in
-- place, so a reader at revision r sees the poses up to the last mark at or before r.
CREATE TABLE track_mark (
  slot INTEGER NOT NULL,
  revision INTEGER NOT NULL,
  last_ns INTEGER NOT NULL,
  pose_count INTEGER NOT NULL,
  PRIMARY KEY (slot, revision)
) STRICT, WITHOUT ROWID;

-- id = slot << 42 | milliseconds of t0 since (epoch - 2^41 ms): one seek finds a segment by time.
CREATE TABLE trajectory_segment (
  id INTEGER PRIMARY KEY,
  rev_from INTEGER NOT NULL,
  t0 INTEGER NOT NULL,
  t1 INTEGER NOT NULL,
  pose_count INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;

CREATE TABLE trajectory_history (
  id INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  rev_to INTEGER NOT NULL,
  t0 INTEGER NOT NULL,
  t1 INTEGER NOT NULL,
  pose_count INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE UNIQUE INDEX trajectory_history_id ON trajectory_history (id, rev_from);
CREATE INDEX trajectory_history_rev_to ON trajectory_history (rev_to);

-- Millimetres and tenths of a second from the map's epoch, rounded outward: candidates only. A
-- segment's box also covers the way from the pose before it.
CREATE VIRTUAL TABLE segment_box USING rtree_i32 (id, x0, x1, y0, y1, z0, z1, t0, t1);
CREATE VIRTUAL TABLE node_box USING rtree_i32 (key, x0, x1, y0, y1, z0, z1);

CREATE TABLE stay (
  agent INTEGER NOT NULL,
  enter_ns INTEGER NOT NULL,
  exit_ns INTEGER NOT NULL,
  place INTEGER NOT NULL,
  room INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  PRIMARY KEY (agent, enter_ns)
) STRICT, WITHOUT ROWID;
CREATE INDEX stay_room ON stay (room, enter_ns);
CREATE INDEX stay_place ON stay (place, enter_ns);

CREATE TABLE stay_history (
  agent INTEGER NOT NULL,
  enter_ns INTEGER NOT NULL,
  exit_ns INTEGER NOT NULL,
  place INTEGER NOT NULL,
  room INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  rev_to INTEGER NOT NULL,
  checksum INTEGER NOT NULL
) STRICT;
CREATE UNIQUE INDEX stay_history_agent ON stay_history (agent, enter_ns, rev_from);
CREATE INDEX stay_history_room ON stay_history (room, enter_ns);
CREATE INDEX stay_history_place ON stay_history (place, enter_ns);

CREATE TABLE factor_segment (
  id INTEGER PRIMARY KEY,
  agent INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  t0 INTEGER NOT NULL,
  t1 INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE INDEX factor_segment_agent ON factor_segment (agent, t0);

CREATE TABLE shape_segment (
  id INTEGER PRIMARY KEY,
  agent INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  t0 INTEGER NOT NULL,
  t1 INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE INDEX shape_segment_agent ON shape_segment (agent, t0);

CREATE TABLE mesh_block (
  id INTEGER PRIMARY KEY,
  x INTEGER NOT NULL,
  y INTEGER NOT NULL,
  z INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE UNIQUE INDEX mesh_block_index ON mesh_block (x, y, z);

CREATE TABLE mesh_block_history (
  x INTEGER NOT NULL,
  y INTEGER NOT NULL,
  z INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  rev_to INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE UNIQUE INDEX mesh_block_history_index ON mesh_block_history (x, y, z, rev_from);

-- Parts of at most 1 MiB.
CREATE TABLE asset (
  id INTEGER PRIMARY KEY,
  sha256 BLOB NOT NULL,
  part INTEGER NOT NULL,
  rev_from INTEGER NOT NULL,
  media_type TEXT NOT NULL,
  checksum INTEGER NOT NULL,
  payload BLOB NOT NULL
) STRICT;
CREATE UNIQUE INDEX asset_sha256 ON asset (sha256, part);
