// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/output_layout.h"

#include <algorithm>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr int kSsdNumberCount = 7;
// Sigmoids of half precision end a little beyond 1.
constexpr double kScoreTolerance = 1e-3;

absl::Status UnknownShape(const std::vector<int>& shape, const std::string& why) {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat("the network's output has shape ", ShapeText(shape), ", ", why,
                                "; known are [1, N, 5 + classes], [1, 4 + classes, N] and "
                                "[1, 1, N, 7], with N at least twice the numbers of a box"),
                   {{"shape", ShapeText(shape)}});
}

absl::Status CheckScore(double score) {
  if (score >= -kScoreTolerance && score <= 1.0 + kScoreTolerance) return absl::OkStatus();
  return absl::InternalError(
      absl::StrCat("the network gives a score of ", score,
                   ", and scores are 0 to 1; export it with its last sigmoid and with boxes in "
                   "pixels, and check that its output is one of the known ones"));
}

// Numbers of an output by box and place in it, whether boxes are rows or columns.
struct BoxTable {
  const float* values = nullptr;
  size_t box_stride = 0;
  size_t number_stride = 0;

  double At(int box, int number) const {
    return values[static_cast<size_t>(box) * box_stride +
                  static_cast<size_t>(number) * number_stride];
  }
};

BoxTable TableOf(const OutputLayout& layout, const float* values) {
  switch (layout.kind) {
    case OutputKind::kRows:
      return {values, static_cast<size_t>(5 + layout.class_count), 1};
    case OutputKind::kColumns:
      return {values, 1, static_cast<size_t>(layout.box_count)};
    case OutputKind::kSsd:
      break;
  }
  return {values, kSsdNumberCount, 1};
}

absl::StatusOr<double> ScoreAt(const BoxTable& table, int box, int number) {
  const double score = table.At(box, number);
  DSG_RETURN_IF_ERROR(CheckScore(score));
  return std::clamp(score, 0.0, 1.0);
}

absl::StatusOr<double> PersonScore(const OutputLayout& layout, const BoxTable& table, int box,
                                   int person_class) {
  switch (layout.kind) {
    case OutputKind::kRows: {
      DSG_ASSIGN_OR_RETURN(const double any_object, ScoreAt(table, box, 4));
      DSG_ASSIGN_OR_RETURN(const double person, ScoreAt(table, box, 5 + person_class));
      return any_object * person;
    }
    case OutputKind::kColumns:
      return ScoreAt(table, box, 4 + person_class);
    case OutputKind::kSsd:
      break;
  }
  // Unused rows have an image number below 0.
  const bool is_person = table.At(box, 0) >= 0.0 && table.At(box, 1) == person_class;
  return is_person ? ScoreAt(table, box, 2) : 0.0;
}

Eigen::Vector4d BoxAt(const OutputLayout& layout, const BoxTable& table, int box,
                      const CandidateOptions& options) {
  if (layout.kind == OutputKind::kSsd) {
    const double width = options.input_width_px;
    const double height = options.input_height_px;
    return {table.At(box, 3) * width, table.At(box, 4) * height, table.At(box, 5) * width,
            table.At(box, 6) * height};
  }
  const Eigen::Vector2d center(table.At(box, 0), table.At(box, 1));
  const Eigen::Vector2d half(0.5 * table.At(box, 2), 0.5 * table.At(box, 3));
  return {center.x() - half.x(), center.y() - half.y(), center.x() + half.x(),
          center.y() + half.y()};
}

}  // namespace

std::string ShapeText(const std::vector<int>& shape) {
  return absl::StrCat("[", absl::StrJoin(shape, ", "), "]");
}

absl::StatusOr<OutputLayout> LayoutOf(const std::vector<int>& shape) {
  if (shape.size() == 4 && shape[0] == 1 && shape[1] == 1 && shape[3] == kSsdNumberCount) {
    return OutputLayout{.kind = OutputKind::kSsd, .box_count = shape[2], .class_count = 0};
  }
  if (shape.size() != 3 || shape[0] != 1) return UnknownShape(shape, "which is not known");
  const int a = shape[1];
  const int b = shape[2];
  if (b >= 6 && a / 2 >= b) {
    return OutputLayout{.kind = OutputKind::kRows, .box_count = a, .class_count = b - 5};
  }
  if (a >= 5 && b / 2 >= a) {
    return OutputLayout{.kind = OutputKind::kColumns, .box_count = b, .class_count = a - 4};
  }
  if (a >= 5 && b >= 6) {
    return UnknownShape(shape,
                        "which does not tell boxes from classes (a larger input gives more)");
  }
  return UnknownShape(shape, "which has too few numbers for a box and a class");
}

absl::StatusOr<std::vector<PersonCandidate>> ReadCandidates(const OutputLayout& layout,
                                                            const float* values,
                                                            const CandidateOptions& options) {
  const BoxTable table = TableOf(layout, values);
  std::vector<PersonCandidate> candidates;
  for (int box = 0; box < layout.box_count; ++box) {
    PersonCandidate candidate;
    DSG_ASSIGN_OR_RETURN(candidate.score, PersonScore(layout, table, box, options.person_class));
    if (candidate.score < options.score_min) continue;
    candidate.box_input = BoxAt(layout, table, box, options);
    const Eigen::Vector4d& edges = candidate.box_input;
    if (!edges.allFinite() || !(edges[0] < edges[2] && edges[1] < edges[3])) continue;
    candidates.push_back(candidate);
  }
  return candidates;
}

}  // namespace dsg::ingest
