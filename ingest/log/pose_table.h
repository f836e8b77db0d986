// SPDX-License-Identifier: Apache-2.0
// Files of one robot's poses: EuRoC's ground truth, TUM's trajectories and KITTI's matrices.
// Refuses to sort: rows stay as found, and TrackTable's checks speak of their lines.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/text_table.h"
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

/// Poses without times.
struct MatrixPoses {
  struct Row {
    int64_t line = 0;
    Pose3d map_T_body;
  };
  std::vector<Row> rows;
  /// The largest RigidMatrix::deviation.
  double deviation_max = 0.0;
};

/// KITTI: the first three rows of a 4x4 matrix a line, twelve numbers between blanks.
/// Frames: as the file has them; KITTI's own are of the left grey camera, z forward.
/// Errors: FILE_MALFORMED naming file, line and value; a matrix that is not rigid is one.
absl::StatusOr<MatrixPoses> ReadMatrixPoses(const LogFile& file);

/// Twelve fields from `first` on, of such a line; `deviation_max` grows to what this one has.
absl::StatusOr<Pose3d> ReadMatrixFields(const LinePosition& at,
                                        const std::vector<std::string_view>& fields, size_t first,
                                        double* deviation_max);

/// Whether the first line that is no remark has twelve fields.
bool HasMatrixRows(const LogFile& file);

}  // namespace dsg::ingest
