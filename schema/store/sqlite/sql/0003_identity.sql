-- SPDX-License-Identifier: Apache-2.0
-- Format 3: what tells things apart that bear the same name, and stays of any length.
-- docs/storage_format.md explains.

-- Checksum of the delta that made the revision, and of the last one of the session, so that another
-- delta of the same session and sequence is refused. Unknown in what older formats wrote and in
-- what has been erased from.
ALTER TABLE revision ADD COLUMN delta_checksum INTEGER;
ALTER TABLE session ADD COLUMN last_checksum INTEGER;

-- Tells the map from others of its name that were there before or come after; empty in copies,
-- which get one where they become maps.
ALTER TABLE map ADD COLUMN incarnation TEXT NOT NULL DEFAULT '';

-- Erasures that were begun, before the commits that retire what they name. What was written after
-- `revision` is not meant.
CREATE TABLE noted_erasure (
  id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL,
  assets INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  keys BLOB NOT NULL,
  spans BLOB NOT NULL
) STRICT;

-- Stays longer than an hour (kStayNsMax), so that looking for the others need not look further
-- back. By their end: of the long ones of a room few have not ended before the time asked about.
CREATE INDEX stay_room_long ON stay (room, exit_ns) WHERE exit_ns - enter_ns > 3600000000000;
CREATE INDEX stay_place_long ON stay (place, exit_ns) WHERE exit_ns - enter_ns > 3600000000000;
CREATE INDEX stay_history_room_long ON stay_history (room, exit_ns)
  WHERE exit_ns - enter_ns > 3600000000000;
CREATE INDEX stay_history_place_long ON stay_history (place, exit_ns)
  WHERE exit_ns - enter_ns > 3600000000000;
