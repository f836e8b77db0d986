// SPDX-License-Identifier: Apache-2.0
#include "query/maintenance/revert_series.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "query/engine/diff.h"
#include "schema/base/status.h"
#include "schema/codec/trajectory_codec.h"

namespace dsg::query {
namespace {

constexpr size_t kPoseChunk = 4096;
constexpr size_t kShapeChunk = 32;

struct StoredShape {
  BodyShape shape;
  std::optional<Sha256> topology;
};

TimeNs TimeOf(const TimedPose& pose) { return pose.time_ns; }
TimeNs TimeOf(const StoredShape& stored) { return stored.shape.time_ns; }

bool IsSameRow(const TimedPose& a, const TimedPose& b) { return IsSamePose(a, b); }

bool IsSameRow(const StoredShape& a, const StoredShape& b) {
  return a.shape.time_ns == b.shape.time_ns && a.topology == b.topology &&
         a.shape.pose_coefficients == b.shape.pose_coefficients &&
         a.shape.shape_coefficients == b.shape.shape_coefficients &&
         a.shape.vertices == b.shape.vertices && a.shape.joints == b.shape.joints;
}

// Nothing for an agent that is not there.
absl::Status UnlessNotFound(absl::Status status) {
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

// The first of a series at or after an instant, at most so many.
absl::StatusOr<std::vector<TimedPose>> ReadPoseChunk(const Snapshot& snapshot, NodeId agent,
                                                     TimeNs from_ns, const StopCheck& stop) {
  std::vector<TimedPose> poses;
  DSG_RETURN_IF_ERROR(
      UnlessNotFound(snapshot.ReadPoses(agent, from_ns, kTimeMax, stop, [&](const TimedPose& pose) {
        poses.push_back(pose);
        return poses.size() < kPoseChunk;
      })));
  return poses;
}

absl::StatusOr<std::vector<StoredShape>> ReadShapeChunk(const Snapshot& snapshot, NodeId agent,
                                                        TimeNs from_ns, const StopCheck& stop) {
  std::vector<StoredShape> shapes;
  DSG_RETURN_IF_ERROR(UnlessNotFound(snapshot.ReadShapes(
      agent, from_ns, kTimeMax, /*with_vertices=*/true, stop, [&](const ShownShape& shown) {
        shapes.push_back({shown.shape, shown.topology});
        return shapes.size() < kShapeChunk;
      })));
  return shapes;
}

// The part of a chunk before an instant.
template <typename Row>
void CutAt(TimeNs to_ns, std::vector<Row>* chunk) {
  while (!chunk->empty() && TimeOf(chunk->back()) >= to_ns) chunk->pop_back();
}

template <typename Row>
std::optional<SeriesDifference> Compare(NodeId agent, const std::vector<Row>& present,
                                        const std::vector<Row>& wanted) {
  const auto is_same = [](const Row& a, const Row& b) { return IsSameRow(a, b); };
  const auto [a, b] =
      std::mismatch(present.begin(), present.end(), wanted.begin(), wanted.end(), is_same);
  if (a == present.end() && b == wanted.end()) return std::nullopt;
  const auto [a_end, b_end] =
      std::mismatch(present.rbegin(), std::make_reverse_iterator(a), wanted.rbegin(),
                    std::make_reverse_iterator(b), is_same);
  SeriesDifference found;
  found.present_count = a_end.base() - a;
  found.wanted_count = b_end.base() - b;
  TimeNs first_ns = kTimeMax;
  TimeNs last_ns = kTimeMin;
  for (auto it = a; it != a_end.base(); ++it) {
    first_ns = std::min(first_ns, TimeOf(*it));
    last_ns = std::max(last_ns, TimeOf(*it));
  }
  for (auto it = b; it != b_end.base(); ++it) {
    first_ns = std::min(first_ns, TimeOf(*it));
    last_ns = std::max(last_ns, TimeOf(*it));
  }
  found.span = {agent, first_ns, last_ns + 1};
  return found;
}

template <typename ReadChunk>
absl::StatusOr<std::vector<SeriesDifference>> FindDifferences(NodeId agent, size_t chunk_size,
                                                              const Snapshot& present,
                                                              const Snapshot& wanted,
                                                              const StopCheck& stop,
                                                              const ReadChunk& read) {
  std::vector<SeriesDifference> found;
  for (TimeNs from_ns = kTimeMin;;) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(auto a, read(present, agent, from_ns, stop));
    DSG_ASSIGN_OR_RETURN(auto b, read(wanted, agent, from_ns, stop));
    // As far as both were read.
    TimeNs to_ns = kTimeMax;
    if (a.size() == chunk_size) to_ns = std::min(to_ns, TimeOf(a.back()) + 1);
    if (b.size() == chunk_size) to_ns = std::min(to_ns, TimeOf(b.back()) + 1);
    CutAt(to_ns, &a);
    CutAt(to_ns, &b);
    if (const auto difference = Compare(agent, a, b)) found.push_back(*difference);
    if (to_ns == kTimeMax) return found;
    from_ns = to_ns;
  }
}

}  // namespace

absl::StatusOr<std::vector<SeriesDifference>> FindPoseDifferences(const Snapshot& present,
                                                                  const Snapshot& wanted,
                                                                  NodeId agent,
                                                                  const StopCheck& stop) {
  return FindDifferences(agent, kPoseChunk, present, wanted, stop, ReadPoseChunk);
}

absl::StatusOr<std::vector<SeriesDifference>> FindShapeDifferences(const Snapshot& present,
                                                                   const Snapshot& wanted,
                                                                   NodeId agent,
                                                                   const StopCheck& stop) {
  return FindDifferences(agent, kShapeChunk, present, wanted, stop, ReadShapeChunk);
}

Eigen::Quaterniond StoredAsBefore(const Eigen::Quaterniond& orientation) {
  const Eigen::Vector4d in_steps = orientation.coeffs() / kQuaternionStep;
  Eigen::Index largest = 0;
  in_steps.cwiseAbs().maxCoeff(&largest);
  const double nearest = std::round(in_steps[largest]);
  for (const double off : {0.0, 1.0, -1.0, 2.0, -2.0}) {
    // If this is the whole number that stood for the largest part, all others are whole as well.
    const Eigen::Vector4d scaled = in_steps * ((nearest + off) / in_steps[largest]);
    const Eigen::Vector4d stored = scaled.array().round();
    if ((scaled - stored).cwiseAbs().maxCoeff() > 1e-6) continue;
    // To unit length by moving each part by less than half a step, the same share of it each.
    const double missing = 1.0 / kQuaternionStep - stored.norm();
    const Eigen::Vector4d direction = stored.array().sign();
    const double share = missing * stored.norm() / stored.dot(direction);
    const Eigen::Vector4d moved = stored + share * direction;
    return Eigen::Quaterniond(moved * kQuaternionStep).normalized();
  }
  return orientation;
}

absl::StatusOr<std::vector<ShapeAppend>> ReadShapeAppends(const Snapshot& snapshot,
                                                          const TrackSpan& span,
                                                          const StopCheck& stop) {
  std::vector<ShapeAppend> appends;
  DSG_RETURN_IF_ERROR(UnlessNotFound(
      snapshot.ReadShapes(span.agent, span.from_ns, span.to_ns, /*with_vertices=*/true, stop,
                          [&](const ShownShape& shown) {
                            if (appends.empty() || appends.back().topology != shown.topology) {
                              appends.push_back({span.agent, shown.topology, {}});
                            }
                            appends.back().shapes.push_back(shown.shape);
                            return true;
                          })));
  return appends;
}

}  // namespace dsg::query
