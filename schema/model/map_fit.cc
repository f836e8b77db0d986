// SPDX-License-Identifier: Apache-2.0
#include "schema/model/map_fit.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/model/value_check.h"

namespace dsg {
namespace {

class TimeChecker {
 public:
  TimeChecker(const GraphDelta& delta, const GraphLookup& graph, const MapSpec& spec)
      : delta_(delta), graph_(graph), spec_(spec) {}

  absl::Status Run() {
    for (const Node& node : delta_.nodes) DSG_RETURN_IF_ERROR(CheckTimesOf(node));
    for (const Retirement& item : delta_.retirements) {
      if (!item.valid_to_ns.has_value()) continue;
      DSG_RETURN_IF_ERROR(CheckTime(*item.valid_to_ns, kValidFarMaxNs,
                                    absl::StrCat("valid_to_ns of node ", ToString(item.id))));
    }
    const auto check_ends = [&](const auto& list, NodeId agent, const char* of) -> absl::Status {
      if (list.empty()) return absl::OkStatus();
      // They grow.
      for (const auto* item : {&list.front(), &list.back()}) {
        DSG_RETURN_IF_ERROR(CheckTime(item->time_ns, kObservedFarMaxNs,
                                      absl::StrCat("time of a ", of, " of ", ToString(agent))));
      }
      return absl::OkStatus();
    };
    for (const TrajectoryAppend& item : delta_.appends) {
      DSG_RETURN_IF_ERROR(check_ends(item.poses, item.agent, "pose"));
    }
    for (const TrajectoryCorrection& item : delta_.corrections) {
      DSG_RETURN_IF_ERROR(check_ends(item.poses, item.agent, "pose"));
    }
    for (const ShapeAppend& item : delta_.shapes) {
      DSG_RETURN_IF_ERROR(check_ends(item.shapes, item.agent, "shape"));
    }
    for (const FactorAppend& item : delta_.factors) {
      for (const PoseFactor& factor : item.factors) {
        for (const TimeNs time_ns : {factor.from_ns, factor.to_ns}) {
          DSG_RETURN_IF_ERROR(
              CheckTime(time_ns, kObservedFarMaxNs,
                        absl::StrCat("time of a factor of ", ToString(item.agent))));
        }
      }
    }
    for (const Stay& stay : delta_.stays) {
      for (const TimeNs time_ns : {stay.enter_ns, stay.exit_ns}) {
        DSG_RETURN_IF_ERROR(CheckTime(time_ns, kObservedFarMaxNs,
                                      absl::StrCat("time of a stay of ", ToString(stay.agent))));
      }
    }
    return absl::OkStatus();
  }

 private:
  absl::Status CheckTimesOf(const Node& node) {
    const absl::Status status = [&]() -> absl::Status {
      const std::string of = " of node " + ToString(node.id);
      if (node.first_observed_ns.has_value()) {
        DSG_RETURN_IF_ERROR(
            CheckTime(*node.first_observed_ns, kObservedFarMaxNs, "first_observed_ns" + of));
      }
      if (node.last_observed_ns.has_value()) {
        DSG_RETURN_IF_ERROR(
            CheckTime(*node.last_observed_ns, kObservedFarMaxNs, "last_observed_ns" + of));
      }
      DSG_RETURN_IF_ERROR(CheckTime(node.valid.from_ns, kValidFarMaxNs, "valid.from_ns" + of));
      return CheckTime(node.valid.to_ns, kValidFarMaxNs, "valid.to_ns" + of);
    }();
    if (status.ok() || ReasonOf(status) != Reason::kTimeImplausible) return status;
    // What is stored may be written again, as when the node moves.
    DSG_ASSIGN_OR_RETURN(const auto stored, graph_.FindNode(node.id));
    const bool is_known =
        stored.has_value() && stored->first_observed_ns == node.first_observed_ns &&
        stored->last_observed_ns == node.last_observed_ns && stored->valid == node.valid;
    return is_known ? absl::OkStatus() : status;
  }

  // Open ends say nothing.
  absl::Status CheckTime(TimeNs time_ns, TimeNs far_max_ns, const std::string& what) {
    if (time_ns == kTimeMin || time_ns == kTimeMax) return absl::OkStatus();
    if (DistanceNs(time_ns, {spec_.epoch_ns, spec_.epoch_ns}) <= far_max_ns)
      return absl::OkStatus();
    if (!span_.has_value()) {
      DSG_ASSIGN_OR_RETURN(span_, FindKnownSpan());
    }
    if (!span_->has_value() || DistanceNs(time_ns, **span_) <= far_max_ns) return absl::OkStatus();
    constexpr int64_t kYearNs = 365 * 24 * 3600 * kNsPerSecond;
    const std::string span = absl::StrCat("[", (*span_)->from_ns, ", ", (*span_)->to_ns, "]");
    return MakeError(Reason::kTimeImplausible,
                     absl::StrCat("delta refused: ", what, " is ", time_ns, " ns, more than ",
                                  far_max_ns / kYearNs, " years from all that map \"", spec_.name,
                                  "\" knows, ", span, " ns; check the clock, or use another map"),
                     {{"map", spec_.name},
                      {"item", what},
                      {"time_ns", absl::StrCat(time_ns)},
                      {"span_ns", span}});
  }

  // A difference of two times need not fit 64 bits with a sign.
  static TimeNs DistanceNs(TimeNs time_ns, const Interval& span) {
    if (time_ns >= span.from_ns && time_ns <= span.to_ns) return 0;
    const bool is_before = time_ns < span.from_ns;
    const uint64_t low = static_cast<uint64_t>(is_before ? time_ns : span.to_ns);
    const uint64_t high = static_cast<uint64_t>(is_before ? span.from_ns : time_ns);
    return static_cast<TimeNs>(std::min<uint64_t>(high - low, kTimeMax));
  }

  // The poses and the epoch; both ends belong to it. An epoch of 0 is what a map has that was not
  // given one, and other clocks may begin anywhere.
  absl::StatusOr<std::optional<Interval>> FindKnownSpan() const {
    DSG_ASSIGN_OR_RETURN(std::optional<Interval> span, graph_.FindSpan());
    if (!span.has_value() && (spec_.clock != Clock::kUnix || spec_.epoch_ns == 0)) {
      return FirstPoses();
    }
    if (!span.has_value()) return std::optional<Interval>({spec_.epoch_ns, spec_.epoch_ns});
    span->from_ns = std::min(span->from_ns, spec_.epoch_ns);
    span->to_ns = std::max(span->to_ns, spec_.epoch_ns);
    return span;
  }

  // The delta's own poses up to the first gap that is too long: the poses behind it would be
  // refused if they came with the next delta, so they are with this one.
  std::optional<Interval> FirstPoses() const {
    std::vector<TimeNs> times;
    for (const TrajectoryAppend& item : delta_.appends) {
      for (const TimedPose& pose : item.poses) times.push_back(pose.time_ns);
    }
    if (times.empty()) return std::nullopt;
    std::sort(times.begin(), times.end());
    Interval span{times.front(), times.front()};
    for (const TimeNs time_ns : times) {
      if (DistanceNs(time_ns, span) > kObservedFarMaxNs) break;
      span.to_ns = time_ns;
    }
    return span;
  }

  const GraphDelta& delta_;
  const GraphLookup& graph_;
  const MapSpec& spec_;
  /// What FindKnownSpan has told, once it was asked.
  std::optional<std::optional<Interval>> span_;
};

// A face belongs to the block of its first corner, a vertex without faces to its own.
absl::Status CheckVertices(const MeshBlock& block, double size_m) {
  const Eigen::Vector3d low = Eigen::Vector3d(block.index.x, block.index.y, block.index.z) * size_m;
  const double far_m = low.cwiseAbs().maxCoeff() + size_m;
  const double tolerance_m = kVertexToleranceM + kVertexTolerancePerM * far_m;
  std::vector<bool> may_lie_outside(block.positions_map.size(), false);
  for (const auto& face : block.faces) may_lie_outside[face[1]] = may_lie_outside[face[2]] = true;
  for (const auto& face : block.faces) may_lie_outside[face[0]] = false;
  for (size_t i = 0; i < block.positions_map.size(); ++i) {
    const double reach_m = may_lie_outside[i] ? kFaceReachMaxM : tolerance_m;
    const Eigen::Array3d at = block.positions_map[i].cast<double>().array();
    const bool is_inside =
        (at >= low.array() - reach_m).all() && (at <= low.array() + size_m + reach_m).all();
    if (is_inside) continue;
    return values::Invalid(absl::StrCat(
        "vertex ", i, " of mesh block ", block.index.x, ",", block.index.y, ",", block.index.z,
        " at (", at.x(), ", ", at.y(), ", ", at.z(), ") is outside of the block, which begins at (",
        low.x(), ", ", low.y(), ", ", low.z(), ") and is ", size_m,
        " m wide; put each face into the block of its first corner, and each vertex without "
        "faces into its own"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckFitsMap(const GraphDelta& delta, const GraphLookup& graph) {
  const MapSpec* const spec = graph.FindSpec();
  if (spec == nullptr) return absl::OkStatus();
  DSG_RETURN_IF_ERROR(TimeChecker(delta, graph, *spec).Run());
  for (const MeshBlock& block : delta.mesh_blocks) {
    DSG_RETURN_IF_ERROR(CheckVertices(block, spec->mesh_block_size_m));
  }
  return absl::OkStatus();
}

}  // namespace dsg
