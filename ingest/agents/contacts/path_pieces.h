// SPDX-License-Identifier: Apache-2.0
// A path as straight pieces in time, in blocks with bounds so that most pairs need no look inside.
// Refuses to invent positions across gaps.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "ingest/agents/contacts/contacts.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// From one sample to the next; an instant when a sample stands alone between gaps.
struct PathPiece {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Eigen::Vector3d start_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d end_map = Eigen::Vector3d::Zero();

  /// Requires: from_ns <= time_ns <= to_ns.
  Eigen::Vector3d At(TimeNs time_ns) const;
};

/// Neighbouring pieces [begin, end).
struct PathBlock {
  size_t begin = 0;
  size_t end = 0;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Box3d box_map;
};

struct PathPieces {
  /// Ascending in time; neighbours may share an instant.
  std::vector<PathPiece> pieces;
  std::vector<PathBlock> blocks;
  /// Of the whole path; empty without pieces.
  Box3d box_map;
};

/// Samples that are not finite, or farther than a million kilometres from the origin, are left out;
/// those out of order are put in order, and of equal stamps the first counts.
PathPieces CutPath(const std::vector<TimedPoint>& points, TimeNs gap_ns_max);

}  // namespace dsg::ingest
