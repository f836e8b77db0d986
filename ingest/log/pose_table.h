// SPDX-License-Identifier: Apache-2.0
// Files of one robot's poses: EuRoC's ground truth and TUM's trajectories.
// Refuses to sort: rows stay as found, and TrackTable's checks speak of their lines.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// EuRoC when its rows have commas (stamp [ns], p x y z, q w x y z, then nothing or v, b_w, b_a),
/// else TUM (t [s], x y z, q x y z w, between blanks, lines that begin with "#" are remarks).
/// Frames: body to map. Errors: FILE_MALFORMED naming file, line, field and value.
absl::StatusOr<TrackTable> ReadPoseTable(const LogFile& file, const std::string& robot_name);

/// The same, EuRoC only.
absl::StatusOr<TrackTable> ReadEurocPoses(const LogFile& file, const std::string& robot_name);

/// The same, TUM only.
absl::StatusOr<TrackTable> ReadTumPoses(const LogFile& file, const std::string& robot_name);

}  // namespace dsg::ingest
