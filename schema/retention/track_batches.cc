// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/track_batches.h"

#include <algorithm>

#include "schema/base/status.h"

namespace dsg {
namespace {

// A correction ends where so many poses in a row are kept: they need not be written anew.
constexpr size_t kKeptRunMax = 500;

}  // namespace

absl::StatusOr<size_t> TrackBatches::AddTo(size_t row_count_max, const StopCheck& stop,
                                           GraphDelta* delta) {
  if (shape_span_ < plan_.shape_spans.size()) return AddShapes(row_count_max, stop, delta);
  if (factor_span_ < plan_.factor_spans.size()) return AddFactors(row_count_max, delta);
  if (poses_are_done_) return size_t{0};
  return AddPoses(row_count_max, stop, delta);
}

absl::StatusOr<size_t> TrackBatches::AddShapes(size_t row_count_max, const StopCheck& stop,
                                               GraphDelta* delta) {
  const Interval& span = plan_.shape_spans[shape_span_];
  const TimeNs from_ns = std::max(span.from_ns, shapes_from_ns_);
  size_t count = 0;
  TimeNs to_ns = span.to_ns;
  DSG_RETURN_IF_ERROR(map_.ReadShapes(plan_.agent, from_ns, span.to_ns, /*with_vertices=*/false,
                                      stop, [&](const ShownShape& shown) {
                                        if (count == row_count_max) {
                                          to_ns = shown.shape.time_ns;
                                          return false;
                                        }
                                        ++count;
                                        return true;
                                      }));
  delta->shape_removals.push_back({plan_.agent, from_ns, to_ns});
  shapes_from_ns_ = to_ns;
  if (to_ns == span.to_ns) {
    ++shape_span_;
    shapes_from_ns_ = kTimeMin;
  }
  return std::max<size_t>(count, 1);
}

// All of a span: factors stand in batches of one row each, hundreds together.
absl::StatusOr<size_t> TrackBatches::AddFactors(size_t row_count_max, GraphDelta* delta) {
  const Interval& span = plan_.factor_spans[factor_span_++];
  DSG_ASSIGN_OR_RETURN(const std::vector<PoseFactor> factors,
                       map_.Factors(plan_.agent, span.from_ns, span.to_ns));
  delta->factor_removals.push_back({plan_.agent, span.from_ns, span.to_ns});
  return std::clamp<size_t>(factors.size(), 1, row_count_max);
}

bool TrackBatches::Goes(TimeNs time_ns) {
  const auto& spans = plan_.forgotten;
  while (next_span_ < spans.size() && spans[next_span_].to_ns <= time_ns) ++next_span_;
  if (next_span_ < spans.size() && spans[next_span_].Contains(time_ns)) return true;
  const auto& thinned = plan_.thinned_ns;
  while (next_thinned_ < thinned.size() && thinned[next_thinned_] < time_ns) ++next_thinned_;
  return next_thinned_ < thinned.size() && thinned[next_thinned_] == time_ns;
}

// From the first pose that goes to the last, with those between that stay.
struct TrackBatches::Piece {
  TrajectoryCorrection correction;
  size_t row_count = 0;
  /// Kept poses since the last one that goes.
  std::vector<TimedPose> kept;

  void Drop(NodeId agent, TimeNs time_ns) {
    if (row_count == 0) {
      correction.agent = agent;
      correction.from_ns = time_ns;
    } else {
      row_count += kept.size();
      correction.poses.insert(correction.poses.end(), kept.begin(), kept.end());
    }
    kept.clear();
    ++row_count;
    correction.to_ns = time_ns + 1;
  }
};

absl::StatusOr<size_t> TrackBatches::AddPoses(size_t row_count_max, const StopCheck& stop,
                                              GraphDelta* delta) {
  TimeNs from_ns = kTimeMax;
  TimeNs to_ns = kTimeMin;
  if (!plan_.forgotten.empty()) {
    from_ns = plan_.forgotten.front().from_ns;
    to_ns = plan_.forgotten.back().to_ns;
  }
  if (!plan_.thinned_ns.empty()) {
    from_ns = std::min(from_ns, plan_.thinned_ns.front());
    to_ns = std::max(to_ns, plan_.thinned_ns.back() + 1);
  }
  Piece piece;
  poses_are_done_ = true;
  const auto take = [&](const TimedPose& pose) {
    if (Goes(pose.time_ns)) {
      piece.Drop(plan_.agent, pose.time_ns);
    } else if (piece.row_count > 0) {
      piece.kept.push_back(pose);
    }
    const bool is_full = piece.row_count + piece.kept.size() >= row_count_max;
    if (piece.row_count == 0 || (!is_full && piece.kept.size() < kKeptRunMax)) return true;
    poses_from_ns_ = pose.time_ns + 1;
    poses_are_done_ = false;
    return false;
  };
  DSG_RETURN_IF_ERROR(
      map_.ReadPoses(plan_.agent, std::max(from_ns, poses_from_ns_), to_ns, stop, take));
  if (piece.row_count == 0) return size_t{0};
  delta->corrections.push_back(std::move(piece.correction));
  return piece.row_count;
}

}  // namespace dsg
