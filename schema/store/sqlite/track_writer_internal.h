// SPDX-License-Identifier: Apache-2.0
// What appending to tracks and correcting them share. Refuses to be seen outside of both.
#pragma once

#include <optional>
#include <vector>

#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

/// A row of trajectory_segment.
struct SegmentRow {
  int64_t id = 0;
  Revision rev_from = 0;
  std::vector<StoredPose> poses;
};

/// Of a query for id, rev_from, t0, t1, pose_count, checksum, payload.
absl::StatusOr<SegmentRow> DecodeSegmentRow(Query& query, const MapSpec& spec);

inline constexpr char kSelectLast[] =
    "SELECT id, rev_from, t0, t1, pose_count, checksum, payload FROM trajectory_segment"
    " WHERE id BETWEEN ?1 AND ?2 ORDER BY id DESC LIMIT 1";

inline void Grow(const StoredPose& pose, TrajectoryCodec codec, Box3d* box) {
  box->extend(PositionOf(pose, codec));
}

/// The open end of a track.
struct TrackWriter::Tail {
  NodeId agent;
  int64_t slot = 0;
  int64_t pose_count = 0;
  /// The last pose of the track, if there is one.
  std::optional<StoredPose> last;
  SegmentEncoder encoder{TrajectoryCodec::kQuantized};
  /// Row of the segment in `encoder`; 0 until it has one.
  int64_t segment_id = 0;
  bool segment_stored = false;
  Revision segment_rev_from = 0;
  int64_t previous_segment_id = 0;
  /// Bounds of the segment's poses and of the way from the pose before.
  Box3d box;
  TimeNs box_t0 = 0;
};

}  // namespace dsg::sqlite
