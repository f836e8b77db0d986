// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/graph_index.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/known_names.h"
#include "schema/retention/past.h"

namespace dsg {

std::optional<Solid> SpaceOf(const Node& node) {
  if (node.kind != kinds::kRoom) return std::nullopt;
  const bool has_plan = node.region.has_value() && node.region->footprint_map.size() >= 3;
  // Without a floor plan: the box of the room.
  if (!has_plan) {
    if (node.box_node.isEmpty()) return std::nullopt;
    return Solid{node.BoxMap(), {}};
  }
  Solid solid;
  solid.footprint_map = node.region->footprint_map;
  double z_min = node.region->z_min_m;
  double z_max = node.region->z_max_m;
  if (!(z_min < z_max)) {
    // Unknown height: that of the box, or unbounded.
    const Box3d box = node.box_node.isEmpty() ? Box3d() : node.BoxMap();
    z_min = box.isEmpty() ? -std::numeric_limits<double>::max() : box.min().z();
    z_max = box.isEmpty() ? std::numeric_limits<double>::max() : box.max().z();
  }
  for (const Eigen::Vector2d& corner : solid.footprint_map) {
    solid.box_map.extend(Eigen::Vector3d(corner.x(), corner.y(), z_min));
    solid.box_map.extend(Eigen::Vector3d(corner.x(), corner.y(), z_max));
  }
  return solid;
}

void GraphIndex::Add(const Node& node) {
  IndexedNode made;
  made.id = node.id;
  made.layer = node.layer;
  made.is_agent = IsAgentKind(node.kind);
  made.is_pose = node.kind == kAgentPoseKind;
  made.may_hold_stays = node.kind == kinds::kRoom || node.kind == kinds::kPlace;
  made.position_map = node.map_T_node.position;
  made.valid_to_ns = node.valid.to_ns;
  made.last_observed_ns = node.last_observed_ns;
  made.byte_count = static_cast<int32_t>(EncodeNodePayload(node).size());
  for (const Sha256& asset : AssetsOf(node)) assets_.push_back({node.id, asset});
  if (auto space = SpaceOf(node)) {
    made.solid = static_cast<int32_t>(solids_.size());
    solids_.push_back(*std::move(space));
  }
  nodes_.push_back(made);
}

absl::Status GraphIndex::LoadNodes(const Snapshot& map, const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(map.ReadAllNodes(stop, [this](const Node& node) { Add(node); }));
  std::sort(nodes_.begin(), nodes_.end(),
            [](const IndexedNode& a, const IndexedNode& b) { return a.id < b.id; });
  // A node that a concurrent commit replaces is shown twice.
  const auto same = [](const IndexedNode& a, const IndexedNode& b) { return a.id == b.id; };
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end(), same), nodes_.end());
  return absl::OkStatus();
}

absl::Status GraphIndex::LoadHierarchy(const Snapshot& map, const StopCheck& stop) {
  children_.resize(nodes_.size());
  parents_.resize(nodes_.size());
  DSG_RETURN_IF_ERROR(map.ReadAllEdges(stop, [this](const Edge& edge) {
    if (edge.relation != relations::kContains) return;
    const int64_t parent = Find(edge.source);
    const int64_t child = Find(edge.target);
    if (parent < 0 || child < 0) return;
    children_[static_cast<size_t>(parent)].push_back(static_cast<uint32_t>(child));
    parents_[static_cast<size_t>(child)].push_back(static_cast<uint32_t>(parent));
  }));
  for (auto* lists : {&children_, &parents_}) {
    for (auto& list : *lists) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }
  return absl::OkStatus();
}

absl::Status GraphIndex::SortByRank(const Snapshot& map) {
  DSG_ASSIGN_OR_RETURN(const std::vector<Layer> layers, map.Layers());
  std::unordered_map<LayerId, int32_t> rank_of;
  for (const Layer& layer : layers) rank_of[layer.id] = layer.rank;
  bottom_up_.resize(nodes_.size());
  for (uint32_t i = 0; i < bottom_up_.size(); ++i) bottom_up_[i] = i;
  std::stable_sort(bottom_up_.begin(), bottom_up_.end(), [&](uint32_t a, uint32_t b) {
    return rank_of[nodes_[a].layer] < rank_of[nodes_[b].layer];
  });
  return absl::OkStatus();
}

absl::StatusOr<GraphIndex> GraphIndex::Load(const Snapshot& map, const StopCheck& stop) {
  GraphIndex index;
  DSG_RETURN_IF_ERROR(index.LoadNodes(map, stop));
  DSG_RETURN_IF_ERROR(index.LoadHierarchy(map, stop));
  DSG_RETURN_IF_ERROR(index.SortByRank(map));
  DSG_ASSIGN_OR_RETURN(index.tracks_, map.Tracks(stop));
  return index;
}

int64_t GraphIndex::Find(NodeId id) const {
  const auto at =
      std::lower_bound(nodes_.begin(), nodes_.end(), id,
                       [](const IndexedNode& node, NodeId wanted) { return node.id < wanted; });
  return at == nodes_.end() || at->id != id ? -1 : at - nodes_.begin();
}

namespace {

// Shorter islands of poses do not count as the last word of an agent that nothing supports.
constexpr TimeNs kIslandMinNs = 3600 * kNsPerSecond;

TimeNs Sooner(TimeNs time_ns, TimeNs by_ns) {
  return time_ns < kTimeMin + by_ns ? kTimeMin : time_ns - by_ns;
}

bool IsLater(TimeNs time_ns, TimeNs than_ns) { return Sooner(time_ns, kClockLeapMaxNs) > than_ns; }

// An agent or a thing was seen at this time.
struct Witness {
  TimeNs time_ns = 0;
  NodeId who;
  /// The track that continues before this time; null for things.
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

// Searches from the newest time backwards for a supported one.
class NowFinder {
 public:
  NowFinder(const Snapshot& map, const GraphIndex& index, const StopCheck& stop)
      : map_(map), stop_(stop) {
    std::vector<Witness> all;
    for (const IndexedNode& node : index.nodes()) {
      // Agents count by their tracks; poses kept as nodes are no second witness.
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
  /// By agent or thing without support.
  std::map<NodeId, TimeNs> last_word_;
};

// Compares the end of a track with the time of the map when the end was committed.
class LagFinder {
 public:
  // `seen_ns`: now by observations alone. `now_ns`: the same, bounded by the wall clock.
  LagFinder(MapReader* reader, Revision head, TimeNs seen_ns, TimeNs now_ns, const StopCheck& stop)
      : reader_(*reader), head_(head), seen_ns_(seen_ns), now_ns_(now_ns), stop_(stop) {}

  // The lag of an agent whose newest pose that is not ahead is at `end_ns`. 0 if the clock was not
  // behind or this is unknown.
  absl::StatusOr<TimeNs> LagOf(NodeId agent, TimeNs end_ns) {
    if (revisions_.empty()) {
      DSG_ASSIGN_OR_RETURN(revisions_, ReadableRevisions(&reader_, head_, stop_));
    }
    size_t low = 0;
    size_t high = revisions_.size();
    // The first revision that had the end of the track.
    while (low < high) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      const size_t middle = low + (high - low) / 2;
      DSG_ASSIGN_OR_RETURN(const bool has_end, HasEnd(revisions_[middle], agent, end_ns));
      (has_end ? high : low) = has_end ? middle : middle + 1;
    }
    // The end may have been committed in a compacted revision, as between two tags.
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

  // Tracks that are ahead do not count.
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

// Time of the newest pose that is not more than a leap after now; nullopt if all are.
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
  // Later times cannot have been observed yet. If the epoch is later, time is simulated or the wall
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
