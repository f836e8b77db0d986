// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/world_clock.h"

#include <algorithm>
#include <queue>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/retention/graph_index.h"
#include "schema/retention/past.h"

namespace dsg {
namespace {

// An island of poses that is shorter does not speak for its agent where nothing supports it.
constexpr TimeNs kIslandMinNs = 3600 * kNsPerSecond;

TimeNs Sooner(TimeNs time_ns, TimeNs by_ns) {
  return time_ns < kTimeMin + by_ns ? kTimeMin : time_ns - by_ns;
}

bool IsLater(TimeNs time_ns, TimeNs than_ns) { return Sooner(time_ns, kClockLeapMaxNs) > than_ns; }

// Somebody, or something, was seen at a time.
struct Witness {
  TimeNs time_ns = 0;
  NodeId who;
  /// The track goes on before; null for what has one time only.
  const TrackInfo* track = nullptr;

  bool operator<(const Witness& other) const {
    return std::tie(time_ns, who) < std::tie(other.time_ns, other.who);
  }
};

// The poses of a track until the first leap back in time.
struct Island {
  TimeNs begin_ns = 0;
  /// The last pose before the leap.
  std::optional<TimeNs> end_before_ns;
};

// Walks down from the newest time until one is supported.
class NowFinder {
 public:
  NowFinder(const Snapshot& map, const GraphIndex& index, const StopCheck& stop)
      : map_(map), stop_(stop) {
    std::vector<Witness> all;
    for (const IndexedNode& node : index.nodes()) {
      // Agents speak by their tracks, of which a pose is no second witness.
      if (node.is_agent || node.is_pose || !node.last_observed_ns.has_value()) continue;
      all.push_back({*node.last_observed_ns, node.id, nullptr});
    }
    for (const TrackInfo& track : index.tracks()) {
      if (track.pose_count > 0) all.push_back({track.last_ns, track.agent, &track});
    }
    open_ = std::priority_queue<Witness>(std::less<Witness>(), std::move(all));
  }

  absl::StatusOr<std::optional<TimeNs>> Find() {
    while (!open_.empty()) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      const Witness top = open_.top();
      open_.pop();
      if (IsSupported(top)) return std::optional<TimeNs>(top.time_ns);
      DSG_RETURN_IF_ERROR(StepDown(top));
    }
    std::optional<TimeNs> oldest;
    for (const auto& [who, time_ns] : last_word_) {
      oldest = std::min(oldest.value_or(time_ns), time_ns);
    }
    return oldest;
  }

 private:
  bool IsSupported(const Witness& top) {
    std::vector<Witness> own;
    while (!open_.empty() && open_.top().who == top.who) {
      own.push_back(open_.top());
      open_.pop();
    }
    const bool is_supported = !open_.empty() && !IsLater(top.time_ns, open_.top().time_ns);
    for (const Witness& witness : own) open_.push(witness);
    return is_supported;
  }

  absl::Status StepDown(const Witness& top) {
    Island island{top.time_ns, std::nullopt};
    if (top.track != nullptr && IsLater(top.time_ns, top.track->first_ns)) {
      DSG_ASSIGN_OR_RETURN(island, FindIsland(top));
    }
    if (island.end_before_ns.has_value()) {
      open_.push({*island.end_before_ns, top.who, top.track});
    }
    const bool is_last_word =
        !island.end_before_ns.has_value() || Sooner(top.time_ns, kIslandMinNs) >= island.begin_ns;
    if (is_last_word) last_word_.try_emplace(top.who, top.time_ns);
    return absl::OkStatus();
  }

  absl::StatusOr<Island> FindIsland(const Witness& top) {
    Island island{top.track->first_ns, std::nullopt};
    std::optional<TimeNs> before_ns;
    DSG_RETURN_IF_ERROR(
        map_.ReadPoses(top.who, kTimeMin, top.time_ns + 1, stop_, [&](const TimedPose& pose) {
          if (before_ns.has_value() && IsLater(pose.time_ns, *before_ns)) {
            island = {pose.time_ns, before_ns};
          }
          before_ns = pose.time_ns;
          return true;
        }));
    return island;
  }

  const Snapshot& map_;
  const StopCheck& stop_;
  std::priority_queue<Witness> open_;
  /// Of those whom nothing supports.
  std::map<NodeId, TimeNs> last_word_;
};

// Compares when a track ended with how far the map was when it learnt that.
class LagFinder {
 public:
  // `seen_ns`: now by what was observed alone. `now_ns`: the same, bounded by the wall clock.
  LagFinder(MapReader* reader, Revision head, TimeNs seen_ns, TimeNs now_ns, const StopCheck& stop)
      : reader_(*reader), head_(head), seen_ns_(seen_ns), now_ns_(now_ns), stop_(stop) {}

  // Of an agent the newest pose of whose track, but for those that are ahead, is at `end_ns`. 0 if
  // the clock was not behind, or nothing tells.
  absl::StatusOr<TimeNs> LagOf(NodeId agent, TimeNs end_ns) {
    if (revisions_.empty()) {
      DSG_ASSIGN_OR_RETURN(revisions_, ReadableRevisions(&reader_, head_, stop_));
    }
    size_t low = 0;
    size_t high = revisions_.size();
    // The first revision that had the whole of the track.
    while (low < high) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      const size_t middle = low + (high - low) / 2;
      DSG_ASSIGN_OR_RETURN(const bool has_end, HasEnd(revisions_[middle], agent, end_ns));
      (has_end ? high : low) = has_end ? middle : middle + 1;
    }
    // It may have come with a revision that was compacted, as between two tags.
    const bool is_known =
        low > 0 && low < revisions_.size() && revisions_[low] == revisions_[low - 1] + 1;
    if (!is_known) return 0;
    DSG_ASSIGN_OR_RETURN(const std::optional<TimeNs> then_ns, NowAt(revisions_[low]));
    if (!then_ns.has_value() || !IsLater(*then_ns, end_ns)) return 0;
    return *then_ns - end_ns;
  }

 private:
  absl::StatusOr<bool> HasEnd(Revision revision, NodeId agent, TimeNs end_ns) {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> then, reader_.At(revision));
    const auto known = then->GetTrack(agent);
    if (ReasonOf(known.status()) == Reason::kAgentUnknown) return false;
    DSG_RETURN_IF_ERROR(known.status());
    return known->pose_count > 0 && known->last_ns >= end_ns;
  }

  // Ends that are ahead do not speak of how far the map was.
  absl::StatusOr<std::optional<TimeNs>> NowAt(Revision revision) {
    const auto found = now_at_.find(revision);
    if (found != now_at_.end()) return found->second;
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> then, reader_.At(revision));
    DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, then->Tracks(stop_));
    std::optional<TimeNs> now_ns;
    for (const TrackInfo& track : tracks) {
      if (track.pose_count == 0 || IsLater(track.last_ns, seen_ns_)) continue;
      const TimeNs last_ns = std::min(track.last_ns, now_ns_);
      now_ns = std::max(now_ns.value_or(last_ns), last_ns);
    }
    return now_at_[revision] = now_ns;
  }

  MapReader& reader_;
  const Revision head_;
  const TimeNs seen_ns_;
  const TimeNs now_ns_;
  const StopCheck& stop_;
  /// Oldest first.
  std::vector<Revision> revisions_;
  std::map<Revision, std::optional<TimeNs>> now_at_;
};

// The newest pose that is not ahead of now by a leap; nullopt if all are.
absl::StatusOr<std::optional<TimeNs>> EndOf(const Snapshot& map, const TrackInfo& track,
                                            TimeNs now_ns, const StopCheck& stop) {
  std::optional<TimeNs> end_ns;
  if (track.pose_count == 0) return end_ns;
  if (!IsLater(track.last_ns, now_ns)) return std::optional<TimeNs>(track.last_ns);
  DSG_RETURN_IF_ERROR(
      map.ReadPoses(track.agent, kTimeMin, track.last_ns, stop, [&](const TimedPose& pose) {
        if (IsLater(pose.time_ns, now_ns)) return false;
        end_ns = pose.time_ns;
        return true;
      }));
  return end_ns;
}

std::vector<NodeId> FindAhead(const GraphIndex& index, TimeNs now_ns) {
  std::vector<NodeId> ahead;
  for (const TrackInfo& track : index.tracks()) {
    if (track.pose_count > 0 && IsLater(track.last_ns, now_ns)) ahead.push_back(track.agent);
  }
  return ahead;
}

}  // namespace

TimeNs WorldClock::NowOf(NodeId agent) const {
  const auto lag = lag_ns.find(agent);
  return lag == lag_ns.end() ? *now_ns : Sooner(*now_ns, lag->second);
}

absl::StatusOr<WorldClock> FindWorldClock(MapReader* reader, const Snapshot& map,
                                          const GraphIndex& index, TimeNs age_min_ns,
                                          int64_t wall_now_ns, const StopCheck& stop) {
  WorldClock clock;
  DSG_ASSIGN_OR_RETURN(const std::optional<TimeNs> seen_ns, NowFinder(map, index, stop).Find());
  if (!seen_ns.has_value()) return clock;
  // What is later was not observed yet. A map that begins later is of simulated time, or the wall
  // clock is wrong.
  const bool has_wall =
      map.spec().clock == Clock::kUnix && wall_now_ns > 0 && wall_now_ns >= map.spec().epoch_ns;
  clock.now_ns = has_wall ? std::min<TimeNs>(*seen_ns, wall_now_ns) : *seen_ns;
  clock.ahead = FindAhead(index, *clock.now_ns);
  LagFinder lags(reader, map.revision(), *seen_ns, *clock.now_ns, stop);
  for (const TrackInfo& track : index.tracks()) {
    if (track.first_ns >= Sooner(*clock.now_ns, age_min_ns)) continue;
    DSG_ASSIGN_OR_RETURN(const std::optional<TimeNs> end_ns,
                         EndOf(map, track, *clock.now_ns, stop));
    if (!end_ns.has_value() || !IsLater(*clock.now_ns, *end_ns)) continue;
    DSG_ASSIGN_OR_RETURN(const TimeNs lag_ns, lags.LagOf(track.agent, *end_ns));
    if (lag_ns > 0) clock.lag_ns[track.agent] = lag_ns;
  }
  return clock;
}

std::string NoteOf(const WorldClock& clock) {
  constexpr size_t kNamedMax = 20;
  std::string text;
  const auto name = [&](size_t count, NodeId id) {
    if (count < kNamedMax) absl::StrAppend(&text, count == 0 ? ": " : " ", ToString(id));
    if (count == kNamedMax) text += " ...";
  };
  if (!clock.ahead.empty()) {
    text = "ages count without agents that are ahead of all others by more than a week";
    for (size_t i = 0; i < clock.ahead.size(); ++i) name(i, clock.ahead[i]);
  }
  if (clock.lag_ns.empty()) return text;
  absl::StrAppend(&text, text.empty() ? "" : "; ",
                  "poses of agents that came into the map more than a week late count from then");
  size_t count = 0;
  for (const auto& [agent, lag_ns] : clock.lag_ns) name(count++, agent);
  return text;
}

}  // namespace dsg
