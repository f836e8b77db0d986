// SPDX-License-Identifier: Apache-2.0
#include "schema/store/track_rules.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"

namespace dsg {
namespace {

// The part [begin, end] of the way from `a` to `b` inside the box, as fractions; false if none.
bool ClipToBox(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Box3d& box, double* begin,
               double* end) {
  *begin = 0.0;
  *end = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = b[axis] - a[axis];
    const double to_min = box.min()[axis] - a[axis];
    const double to_max = box.max()[axis] - a[axis];
    if (way == 0.0) {
      if (to_min > 0.0 || to_max < 0.0) return false;
      continue;
    }
    const double enter = (way > 0.0 ? to_min : to_max) / way;
    const double leave = (way > 0.0 ? to_max : to_min) / way;
    *begin = std::max(*begin, enter);
    *end = std::min(*end, leave);
  }
  return *begin <= *end;
}

// Adds the instants [first_ns, last_ns], joining them with the visit before when they touch.
void AddInstants(NodeId agent, TimeNs first_ns, TimeNs last_ns, TimeNs from_ns, TimeNs to_ns,
                 std::vector<BoxVisit>* visits) {
  const TimeNs enter_ns = std::max(first_ns, from_ns);
  const TimeNs exit_ns = std::min(last_ns + 1, to_ns);
  if (enter_ns >= exit_ns) return;
  if (!visits->empty() && visits->back().agent == agent && visits->back().exit_ns >= enter_ns) {
    visits->back().exit_ns = std::max(visits->back().exit_ns, exit_ns);
    return;
  }
  visits->push_back({agent, enter_ns, exit_ns});
}

}  // namespace

absl::Status UnknownAgent(const std::string& map, NodeId agent) {
  return MakeError(Reason::kAgentUnknown,
                   absl::StrCat("agent ", ToString(agent), " is unknown in map \"", map,
                                "\"; `dsg ls --layer agents` lists the known ones"),
                   {{"map", map}, {"agent", ToString(agent)}});
}

absl::Status CheckInTrack(const TrackInfo& track, TimeNs at_ns) {
  if (track.pose_count > 0 && at_ns >= track.first_ns && at_ns <= track.last_ns) {
    return absl::OkStatus();
  }
  const std::string who = track.name.empty()
                              ? ToString(track.agent)
                              : absl::StrCat(track.name, " (", ToString(track.agent), ")");
  if (track.pose_count == 0) {
    return MakeError(Reason::kTimeOutsideTrack,
                     absl::StrCat("agent ", who, " has no poses at this revision"),
                     {{"agent", ToString(track.agent)}});
  }
  return MakeError(
      Reason::kTimeOutsideTrack,
      absl::StrCat("time ", at_ns, " ns is ", at_ns < track.first_ns ? "before" : "after",
                   " the track of agent ", who, ", which goes from ", track.first_ns, " to ",
                   track.last_ns, " ns; ask for a time between these"),
      {{"agent", ToString(track.agent)},
       {"at_ns", absl::StrCat(at_ns)},
       {"first_ns", absl::StrCat(track.first_ns)},
       {"last_ns", absl::StrCat(track.last_ns)}});
}

TrackInfo TrackInfoOf(const Node& node, const MapSpec& spec) {
  TrackInfo info;
  info.agent = node.id;
  info.name = node.name;
  info.kind = node.kind;
  const bool has_own_gap = node.agent.has_value() && node.agent->gap_ns_max > 0;
  info.gap_ns_max = has_own_gap ? node.agent->gap_ns_max : spec.gap_ns_max;
  return info;
}

LocatedPose LocateBetween(const StoredPose& before, const StoredPose& after, TimeNs at_ns,
                          TimeNs gap_ns_max, TrajectoryCodec codec) {
  const TimedPose from = FromStored(before, codec);
  LocatedPose located;
  located.before_ns = located.after_ns = from.time_ns;
  located.flags = from.flags;
  located.covariance = from.covariance;
  located.map_T_agent = from.map_T_agent;
  if (from.time_ns == at_ns) return located;
  located.after_ns = after.time_ns;
  if (located.after_ns - located.before_ns > gap_ns_max) {
    located.quality = PoseQuality::kInGap;
    return located;
  }
  const TimedPose to = FromStored(after, codec);
  const double fraction =
      static_cast<double>(at_ns - from.time_ns) / static_cast<double>(to.time_ns - from.time_ns);
  located.quality = PoseQuality::kInterpolated;
  located.map_T_agent = Interpolate(from.map_T_agent, to.map_T_agent, fraction);
  located.flags = from.flags | to.flags;
  if (fraction > 0.5) located.covariance = to.covariance;
  return located;
}

void CollectVisits(NodeId agent, const std::vector<TimedPosition>& positions, TimeNs gap_ns_max,
                   const Box3d& box, TimeNs from_ns, TimeNs to_ns, std::vector<BoxVisit>* visits) {
  for (size_t i = 0; i < positions.size(); ++i) {
    const TimedPosition& at = positions[i];
    // A pose by itself counts, also between two gaps.
    if (box.contains(at.position_map)) {
      AddInstants(agent, at.time_ns, at.time_ns, from_ns, to_ns, visits);
    }
    if (i + 1 == positions.size()) break;
    const TimedPosition& next = positions[i + 1];
    const TimeNs span_ns = next.time_ns - at.time_ns;
    if (span_ns > gap_ns_max) continue;
    double begin = 0.0;
    double end = 0.0;
    if (!ClipToBox(at.position_map, next.position_map, box, &begin, &end)) {
      continue;
    }
    const auto length = static_cast<double>(span_ns);
    AddInstants(agent, at.time_ns + static_cast<TimeNs>(std::ceil(begin * length)),
                at.time_ns + static_cast<TimeNs>(std::floor(end * length)), from_ns, to_ns, visits);
  }
}

void SortVisits(std::vector<BoxVisit>* visits) {
  std::sort(visits->begin(), visits->end(), [](const BoxVisit& a, const BoxVisit& b) {
    return a.enter_ns != b.enter_ns ? a.enter_ns < b.enter_ns : a.agent < b.agent;
  });
}

void SortStays(std::vector<Stay>* stays) {
  std::sort(stays->begin(), stays->end(), [](const Stay& a, const Stay& b) {
    return a.enter_ns != b.enter_ns ? a.enter_ns < b.enter_ns : a.agent < b.agent;
  });
}

Stay ClipToTrack(Stay stay, const TrackInfo& track) {
  // One nanosecond past the last pose, so that the half-open stay holds it.
  if (stay.exit_ns == kTimeMax && track.pose_count > 0) {
    stay.exit_ns = std::max(stay.enter_ns, track.last_ns) + 1;
  }
  return stay;
}

void SortFactors(std::vector<PoseFactor>* factors) {
  const auto key = [](const PoseFactor& factor) {
    return std::tie(factor.from_ns, factor.to_ns, factor.type, factor.to_agent);
  };
  std::sort(factors->begin(), factors->end(), [&](const PoseFactor& a, const PoseFactor& b) {
    return key(a) != key(b) ? key(a) < key(b) : EncodeFactors({a}) < EncodeFactors({b});
  });
}

BatchTimes TimesOf(const std::vector<PoseFactor>& factors) {
  BatchTimes times;
  for (const PoseFactor& factor : factors) {
    times.t0 = std::min({times.t0, factor.from_ns, factor.to_ns});
    times.t1 = std::max({times.t1, factor.from_ns, factor.to_ns});
  }
  return times;
}

ShapeAppend CutBatch(const ShapeAppend& append, size_t first) {
  ShapeAppend batch{append.agent, append.topology, {}};
  const TimeNs t0 = append.shapes[first].time_ns;
  for (size_t i = first; i < append.shapes.size(); ++i) {
    const BodyShape& shape = append.shapes[i];
    // Times may lie further apart than 63 bits count.
    const uint64_t length_ns = static_cast<uint64_t>(shape.time_ns) - static_cast<uint64_t>(t0);
    if (batch.shapes.size() == kShapesPerSegmentMax ||
        length_ns > static_cast<uint64_t>(kShapeBatchNsMax)) {
      break;
    }
    batch.shapes.push_back(shape);
  }
  return batch;
}

bool Touches(const PoseFactor& factor, const TrackSpan& span) {
  const bool ends_here = factor.to_agent.empty() || factor.to_agent == span.agent;
  return Holds(span, factor.from_ns) || (ends_here && Holds(span, factor.to_ns));
}

}  // namespace dsg
