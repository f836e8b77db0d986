// SPDX-License-Identifier: Apache-2.0
// What the numbers mean that a detection network gives, told by their shape.
// Refuses shapes that could mean two things, and numbers that cannot be scores.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::ingest {

enum class OutputKind {
  /// [1, N, 5 + classes]: centre x, centre y, width, height, score of any object, scores of
  /// classes;
  /// pixels of the input.
  kRows,
  /// [1, 4 + classes, N]: the same without the score of any object, one box a column.
  kColumns,
  /// [1, 1, N, 7]: image, class, score, left, top, right, bottom; 0 to 1.
  kSsd,
};

struct OutputLayout {
  OutputKind kind = OutputKind::kRows;
  int box_count = 0;
  /// 0 = the output does not say.
  int class_count = 0;
};

/// "[1, 84, 8400]".
std::string ShapeText(const std::vector<int>& shape);

/// Boxes must be at least twice as many as numbers of one box, or the other way round, because only
/// the shape tells them apart. Errors: INVALID_ARGUMENT/FILE_MALFORMED with the shape.
absl::StatusOr<OutputLayout> LayoutOf(const std::vector<int>& shape);

/// A box in pixels of the input: left, top, right, bottom.
struct PersonCandidate {
  Eigen::Vector4d box_input = Eigen::Vector4d::Zero();
  double score = 0.0;
};

struct CandidateOptions {
  double score_min = 0.5;
  int person_class = 0;
  int input_width_px = 640;
  int input_height_px = 640;
};

/// Boxes that score enough, in the network's order; those that are not finite or have no area are
/// left out. `values` are as many as the layout says.
/// Errors: INTERNAL when a score is not between 0 and 1.
absl::StatusOr<std::vector<PersonCandidate>> ReadCandidates(const OutputLayout& layout,
                                                            const float* values,
                                                            const CandidateOptions& options);

}  // namespace dsg::ingest
