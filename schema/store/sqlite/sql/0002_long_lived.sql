-- SPDX-License-Identifier: Apache-2.0
-- Format 2: what a map needs that is kept for years. docs/storage_format.md explains.

-- Revisions before this one are gone, but for those that have a tag.
ALTER TABLE map ADD COLUMN oldest_revision INTEGER NOT NULL DEFAULT 0;
-- Counts how often the past was rewritten (erased from), so that readers drop what they keep of it.
ALTER TABLE map ADD COLUMN generation INTEGER NOT NULL DEFAULT 0;

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
