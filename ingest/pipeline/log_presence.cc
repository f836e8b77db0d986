// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_presence.h"

#include <algorithm>
#include <unordered_set>
#include <utility>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

bool IsRoom(const Node& node) { return node.layer == layers::kRooms; }
bool IsPlace(const Node& node) { return node.layer == layers::kPlaces; }

}  // namespace

absl::StatusOr<LogRegions> LogRegions::Read(const MapView& map,
                                            const std::optional<NodeNumbering>& own) {
  LogRegions regions;
  DSG_ASSIGN_OR_RETURN(regions.rooms_, map.NodesOfLayer(layers::kRooms));
  DSG_ASSIGN_OR_RETURN(regions.places_, map.NodesOfLayer(layers::kPlaces));
  if (own.has_value()) {
    const auto is_own = [&own](const Node& node) { return own->IsOwn(node.id); };
    std::erase_if(regions.rooms_, is_own);
    std::erase_if(regions.places_, is_own);
  }
  for (const Node& room : regions.rooms_) {
    DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> children, map.Children(room.id));
    for (const NodeId child : children) regions.contains_.push_back({room.id, child});
  }
  return regions;
}

void LogRegions::Add(const GraphDelta& graph) {
  std::unordered_set<NodeId> replaced;
  for (const Node& node : graph.nodes) {
    if (IsRoom(node) || IsPlace(node)) replaced.insert(node.id);
  }
  const auto is_replaced = [&replaced](const Node& node) { return replaced.contains(node.id); };
  std::erase_if(rooms_, is_replaced);
  std::erase_if(places_, is_replaced);
  for (const Node& node : graph.nodes) {
    if (IsRoom(node)) rooms_.push_back(node);
    if (IsPlace(node)) places_.push_back(node);
  }
  for (const Edge& edge : graph.edges) {
    if (edge.relation == relations::kContains) contains_.push_back({edge.source, edge.target});
  }
}

RegionIndex LogRegions::MakeIndex(const RegionOptions& options) const {
  std::vector<Node> rooms = rooms_;
  std::vector<Node> places = places_;
  for (const Node& node : found_.nodes) {
    if (IsRoom(node)) rooms.push_back(node);
    if (IsPlace(node)) places.push_back(node);
  }
  // What has left the world holds nobody any more.
  const auto has_ended = [](const Node& node) { return node.valid.to_ns != kTimeMax; };
  std::erase_if(rooms, has_ended);
  std::erase_if(places, has_ended);
  std::vector<RegionIndex::Containment> contains = contains_;
  for (const Edge& edge : found_.edges) contains.push_back({edge.source, edge.target});
  std::sort(contains.begin(), contains.end(),
            [](const RegionIndex::Containment& a, const RegionIndex::Containment& b) {
              return std::pair(a.room, a.place) < std::pair(b.room, b.place);
            });
  return RegionIndex(std::move(rooms), std::move(places), contains, options);
}

LogPresence::LogPresence(LogRegions regions, const MapView& map, Revision first_revision,
                         bool finds_rooms, const RegionOptions& options)
    : regions_(std::move(regions)),
      map_(map),
      first_revision_(first_revision),
      finds_rooms_(finds_rooms),
      options_(options) {}

void LogPresence::Observe(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map) {
  Tracker().Observe(agent, time_ns, position_map);
}

absl::Status LogPresence::Await(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map) {
  DSG_ASSIGN_OR_RETURN(const bool is_told, IsToldBefore(agent, time_ns));
  if (!is_told) AwaitSighting(agent, time_ns, position_map);
  if (tracker_.has_value()) ReplayWaiting();
  return absl::OkStatus();
}

void LogPresence::AwaitSighting(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map) {
  mender_.Observe(agent, time_ns, position_map);
  waiting_.push_back({agent, time_ns, position_map});
}

// In which room an agent was at a time that another log has told of already is that log's business.
// What counts is what the map held before this session, also when it goes on after a break.
absl::StatusOr<bool> LogPresence::IsToldBefore(NodeId agent, TimeNs time_ns) {
  const auto [told_until, is_new] = told_until_ns_.try_emplace(agent, kTimeMin);
  if (is_new) {
    absl::StatusOr<std::optional<TrackInfo>> track =
        first_revision_ == 0 ? map_.FindTrack(agent) : map_.FindTrackAt(agent, first_revision_ - 1);
    // Nobody knows any more; most agents are new to the map.
    if (ReasonOf(track.status()) == Reason::kRevisionCompacted) track = std::nullopt;
    if (!track.ok()) return track.status();
    if (track->has_value()) told_until->second = (*track)->last_ns;
  }
  return time_ns <= told_until->second;
}

void LogPresence::TakeRegions(const Findings& findings) {
  if (!findings.has_new_layers) return;
  regions_.SetFound(findings.regions);
  sight_ = findings.sight;
  Tracker().SetRegions(MakeIndex());
}

void LogPresence::GoOn() {
  if (!finds_rooms_) Tracker();
  if (tracker_.has_value()) ReplayWaiting();
}

void LogPresence::Finish() {
  ReplayWaiting();
  Tracker().Finish();
}

std::vector<Stay> LogPresence::TakeChanges() { return Tracker().TakeChanges(); }

std::vector<Stay> LogPresence::TakeRemembered() {
  if (!tracker_.has_value()) return {};
  std::vector<Stay> stays = tracker_->TakeChanges();
  mender_.Remember(stays);
  return stays;
}

std::vector<Stay> LogPresence::Mend() {
  std::vector<Stay> stays = mender_.Mend(MakeIndex());
  mender_.Remember(stays);
  return stays;
}

void LogPresence::ReplayWaiting() {
  for (const Waiting& pose : waiting_) {
    Tracker().Observe(pose.agent, pose.time_ns, pose.position_map);
  }
  waiting_.clear();
}

RegionIndex LogPresence::MakeIndex() const {
  RegionIndex index = regions_.MakeIndex(options_);
  index.SetSight(sight_);
  return index;
}

// Made when it is first needed: by then the log's own rooms and places are known.
StayTracker& LogPresence::Tracker() {
  if (!tracker_.has_value()) tracker_.emplace(MakeIndex(), map_.spec().gap_ns_max);
  return *tracker_;
}

void LogPresence::Correct(const TrajectoryChange& change) {
  mender_.Move([&change](TimeNs time_ns) { return change.At(time_ns); });
  for (Waiting& pose : waiting_) {
    pose.position_map = change.At(pose.time_ns) * pose.position_map;
  }
}

}  // namespace dsg::ingest
