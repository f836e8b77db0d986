// SPDX-License-Identifier: Apache-2.0
// Pose graphs as text files of g2o.
// Refuses landmarks, cameras and whatever else g2o can hold: such lines are counted.
#pragma once

#include <cstdint>
#include <istream>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

struct G2oFile {
  PoseGraph graph;
  /// Whether the file gave every pose a start (VERTEX lines); otherwise poses were found by
  /// following edges from the first one.
  bool has_start = false;
  /// The pose of the first FIX line that names one, else the first pose.
  int fixed_pose = 0;
  /// Lines that were left out, by reason in words ("information matrix not positive definite").
  std::map<std::string, int64_t> skipped;
  /// For the user: the first line of each reason, poses without edges, parts that hang apart.
  std::vector<std::string> notes;
};

/// VERTEX_SE2, VERTEX_SE3:QUAT, EDGE_SE2, EDGE_SE3:QUAT, FIX; lines in any order, "#" begins a
/// comment. An edge is a loop unless it joins neighbours in the order of ids whose topmost bytes
/// (the robot's letter in keys of GTSAM) are the same.
///
/// Information is taken as of RelativePose's residual, rotations as rotation vectors in radians.
/// GTSAM and SE-Sync read such files alike, and the noise in the usual benchmarks is of this size.
/// g2o itself means the vector part of the quaternion: optimise PoseObjective::kQuaternion for its
/// chi^2.
///
/// Skipped and counted: lines of other kinds, information that is not positive definite, edges from
/// a pose to itself, FIX of an unknown pose.
///
/// Errors: NOT_FOUND; INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field and value: a number
/// that is none, an edge whose vertex is missing where others have VERTEX lines, a vertex twice,
/// planar and spatial lines mixed, no edge at all; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED for more than
/// a million poses or two million edges.
absl::StatusOr<G2oFile> ReadG2o(const std::string& path);
/// The same from memory or elsewhere; `name` stands for the file in messages.
absl::StatusOr<G2oFile> ReadG2oStream(std::istream* in, const std::string& name);

/// Numbers are written so that reading gives the same ones.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the path; RESOURCE_EXHAUSTED/DISK_FULL;
/// UNAVAILABLE.
absl::Status WriteG2o(const PoseGraph& graph, const std::string& path);

}  // namespace dsg::ingest
