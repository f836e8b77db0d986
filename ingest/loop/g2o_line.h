// SPDX-License-Identifier: Apache-2.0
// One line of a g2o file.
// Refuses to know other lines: whether poses exist is told when all have been read.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

struct G2oLine {
  enum class Kind { kBlank, kVertex, kEdge, kFix, kOther };
  Kind kind = Kind::kBlank;
  /// Of vertices and edges.
  bool is_planar = false;
  /// Vertex and FIX: the first only.
  std::array<int64_t, 2> ids = {0, 0};
  Pose3d pose;
  Matrix6d information = Matrix6d::Zero();
};

/// Where a line stands, for messages.
struct G2oPosition {
  const std::string& file;
  int64_t line = 0;

  /// INVALID_ARGUMENT/FILE_MALFORMED: "file:line: message".
  absl::Status Error(const std::string& message) const;
};

/// A piece of a file in quotes, without control characters, shortened.
std::string QuoteText(std::string_view text);

/// Errors: FILE_MALFORMED naming the field and its value.
absl::StatusOr<G2oLine> ParseG2oLine(const G2oPosition& at, std::string_view text);

/// Whether the information of a planar (rows 0, 1 and 5) or spatial edge is positive definite
/// beyond rounding, whatever the units.
bool IsInformation(const Matrix6d& information, bool is_planar);

}  // namespace dsg::ingest
