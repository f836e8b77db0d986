// SPDX-License-Identifier: Apache-2.0
// Which poses, shapes and factors exactly go.
#include <algorithm>

#include "schema/base/status.h"
#include "schema/retention/measure.h"
#include "schema/retention/simplify.h"

namespace dsg {
namespace {

// Dropped poses closer together than this are of one stretch, which loses its factors whole.
constexpr TimeNs kStretchNs = 120 * kNsPerSecond;

// Ascending times against ascending spans.
class SpanWalk {
 public:
  explicit SpanWalk(const std::vector<Interval>& spans) : spans_(spans) {}
  bool Holds(TimeNs time_ns) {
    while (next_ < spans_.size() && spans_[next_].to_ns <= time_ns) ++next_;
    return next_ < spans_.size() && spans_[next_].Contains(time_ns);
  }

 private:
  const std::vector<Interval>& spans_;
  size_t next_ = 0;
};

class TrackMeasurer {
 public:
  TrackMeasurer(const Snapshot& map, const TrackInfo& track, const TrackChoice& choice,
                const StopCheck& stop, Measured* measured)
      : map_(map), track_(track), choice_(choice), stop_(stop), measured_(*measured) {}

  absl::Status Run(std::set<Sha256>* topologies) {
    plan_.agent = choice_.agent;
    plan_.forgotten = choice_.forgotten;
    DSG_RETURN_IF_ERROR(Forget(topologies));
    for (const Thinning& thinning : choice_.thinnings) DSG_RETURN_IF_ERROR(Thin(thinning));
    if (!plan_.thinned_ns.empty()) DSG_RETURN_IF_ERROR(CountThinned());
    LeaveLastPose();
    const bool is_needed = pose_count_ > 0 || !plan_.thinned_ns.empty() ||
                           !plan_.shape_spans.empty() || !plan_.factor_spans.empty();
    if (is_needed) measured_.tracks.push_back(std::move(plan_));
    return absl::OkStatus();
  }

 private:
  absl::Status Forget(std::set<Sha256>* topologies) {
    for (const Interval& span : plan_.forgotten) {
      PoseBytes bytes(map_.spec().codec);
      DSG_RETURN_IF_ERROR(
          map_.ReadPoses(track_.agent, span.from_ns, span.to_ns, stop_, [&](const TimedPose& pose) {
            bytes.Add(pose);
            ++pose_count_;
            return true;
          }));
      bytes.FlushTo(&measured_.amount);
      Amount batches;
      std::vector<Sha256> found;
      DSG_RETURN_IF_ERROR(CountBatches(map_, track_.agent, span, stop_, &batches, &found));
      if (batches.shape_count > 0) plan_.shape_spans.push_back(span);
      if (batches.factor_count > 0) plan_.factor_spans.push_back(span);
      measured_.amount += batches;
      topologies->insert(found.begin(), found.end());
    }
    measured_.forgotten_pose_count += pose_count_;
    return absl::OkStatus();
  }

  // Of an agent that goes the last pose goes with the node: cut off in between, the prune knows by
  // it next time when the agent was seen last.
  void LeaveLastPose() {
    const bool is_all = plan_.forgotten.size() == 1 && plan_.forgotten[0] == Interval();
    if (is_all && track_.pose_count > 0) plan_.forgotten[0].to_ns = track_.last_ns;
  }

  // What is left after forgetting and the thinnings before.
  absl::Status Thin(const Thinning& thinning) {
    SimplifyOptions options;
    options.position_m = thinning.position_m;
    options.rotation_rad = thinning.rotation_rad;
    options.gap_ns_max = track_.gap_ns_max;
    if (!thinning.ends_are_fixed) options.span = thinning.span;
    std::vector<TimeNs> dropped_ns;
    TrackThinner thinner(options,
                         [&](const TimedPose& pose) { dropped_ns.push_back(pose.time_ns); });
    SpanWalk forgotten(plan_.forgotten);
    size_t gone = 0;
    DSG_RETURN_IF_ERROR(
        map_.ReadPoses(track_.agent, thinning.ends_are_fixed ? thinning.span.from_ns : kTimeMin,
                       thinning.span.to_ns, stop_, [&](const TimedPose& pose) {
                         if (forgotten.Holds(pose.time_ns)) {
                           thinner.Break();
                           return true;
                         }
                         const auto& thinned = plan_.thinned_ns;
                         while (gone < thinned.size() && thinned[gone] < pose.time_ns) ++gone;
                         if (gone == thinned.size() || thinned[gone] != pose.time_ns)
                           thinner.Add(pose);
                         return true;
                       }));
    thinner.Finish(/*is_whole=*/thinning.ends_are_fixed || track_.last_ns < thinning.span.to_ns);
    std::vector<TimeNs> both;
    std::merge(plan_.thinned_ns.begin(), plan_.thinned_ns.end(), dropped_ns.begin(),
               dropped_ns.end(), std::back_inserter(both));
    plan_.thinned_ns = std::move(both);
    return absl::OkStatus();
  }

  absl::Status CountThinned() {
    const std::vector<TimeNs>& thinned = plan_.thinned_ns;
    PoseBytes before(map_.spec().codec);
    PoseBytes after(map_.spec().codec);
    SpanWalk forgotten(plan_.forgotten);
    size_t gone = 0;
    DSG_RETURN_IF_ERROR(map_.ReadPoses(
        track_.agent, thinned.front(), thinned.back() + 1, stop_, [&](const TimedPose& pose) {
          if (forgotten.Holds(pose.time_ns)) return true;
          before.Add(pose);
          if (gone < thinned.size() && thinned[gone] == pose.time_ns) {
            ++gone;
          } else {
            after.Add(pose);
          }
          return true;
        }));
    Amount whole;
    Amount left;
    before.FlushTo(&whole);
    after.FlushTo(&left);
    measured_.amount.pose_count += whole.pose_count - left.pose_count;
    measured_.amount.byte_count += std::max<int64_t>(whole.byte_count - left.byte_count, 0);
    return CountFactors();
  }

  // The factors of a thinned stretch tie poses that are not there any more.
  absl::Status CountFactors() {
    std::vector<Interval> stretches;
    for (const TimeNs time_ns : plan_.thinned_ns) {
      if (stretches.empty() || time_ns - stretches.back().to_ns > kStretchNs) {
        stretches.push_back({time_ns, time_ns + 1});
      }
      stretches.back().to_ns = time_ns + 1;
    }
    for (const Interval& stretch : stretches) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      DSG_ASSIGN_OR_RETURN(std::vector<PoseFactor> factors,
                           map_.Factors(track_.agent, stretch.from_ns, stretch.to_ns));
      std::erase_if(factors, [&](const PoseFactor& factor) {
        return !HasEndIn(factor, track_.agent, stretch);
      });
      if (factors.empty()) continue;
      plan_.factor_spans.push_back(stretch);
      measured_.amount.factor_count += static_cast<int64_t>(factors.size());
      measured_.amount.byte_count += BytesOf(factors);
    }
    plan_.factor_spans = JoinIntervals(std::move(plan_.factor_spans));
    return absl::OkStatus();
  }

  const Snapshot& map_;
  const TrackInfo& track_;
  const TrackChoice& choice_;
  const StopCheck& stop_;
  Measured& measured_;
  TrackPlan plan_;
  int64_t pose_count_ = 0;
};

}  // namespace

absl::Status MeasureTracks(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                           Measured* measured, std::set<Sha256>* topologies) {
  const std::vector<TrackChoice>& choices = measured->selection.tracks;
  for (const TrackInfo& track : index.tracks()) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    const auto chosen =
        std::find_if(choices.begin(), choices.end(),
                     [&](const TrackChoice& choice) { return choice.agent == track.agent; });
    TrackChoice choice;
    if (chosen != choices.end()) choice = *chosen;
    choice.agent = track.agent;
    const int64_t at = index.Find(track.agent);
    if (at >= 0 && measured->selection.is_gone[static_cast<size_t>(at)]) {
      choice.forgotten = {Interval()};
    }
    if (choice.forgotten.empty() && choice.thinnings.empty()) continue;
    DSG_RETURN_IF_ERROR(TrackMeasurer(map, track, choice, stop, measured).Run(topologies));
  }
  return absl::OkStatus();
}

}  // namespace dsg
