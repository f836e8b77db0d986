// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/targets.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Nodes between two questions to the stop check.
constexpr int64_t kStopPeriod = 256;

absl::StatusOr<std::vector<PlaceIndex>> PlacesBelow(const PathWorld& world, NodeId top) {
  std::vector<PlaceIndex> below;
  StopCounter counter(world.stop, kStopPeriod);
  absl::Status status;
  world.view.ForEachDescendant(top, [&](const ViewNode& node) {
    const std::optional<PlaceIndex> place = world.places.Find(node.id);
    if (place.has_value()) below.push_back(*place);
    status = counter.Check();
    return status.ok();
  });
  DSG_RETURN_IF_ERROR(status);
  return below;
}

int32_t RankOf(const GraphView& view, LayerId layer) {
  const std::vector<Layer>& layers = view.layers();
  const auto found = std::find_if(layers.begin(), layers.end(),
                                  [layer](const Layer& known) { return known.id == layer; });
  return found == layers.end() ? 0 : found->rank;
}

bool IsAbovePlaces(const GraphView& view, const ViewNode& node) {
  return RankOf(view, node.layer) > RankOf(view, layers::kPlaces);
}

absl::StatusOr<Eigen::Vector3d> PositionOf(const PathWorld& world, NodeId agent) {
  TimeNs at_ns = 0;
  if (world.at_ns.has_value()) {
    at_ns = *world.at_ns;
  } else {
    DSG_ASSIGN_OR_RETURN(const TrackInfo track, world.snapshot.GetTrack(agent));
    if (track.pose_count == 0) {
      return MakeError(Reason::kTimeOutsideTrack,
                       absl::StrCat("agent ", ToString(agent), " has no pose; give a position"),
                       {{"agent", ToString(agent)}});
    }
    at_ns = track.last_ns;
  }
  DSG_ASSIGN_OR_RETURN(const LocatedPose located, world.snapshot.Locate(agent, at_ns));
  if (located.quality == PoseQuality::kInGap) {
    return MakeError(
        Reason::kTimeOutsideTrack,
        absl::StrCat("agent ", ToString(agent), " was not seen between ", located.before_ns,
                     " ns and ", located.after_ns, " ns; ask for another instant than ", at_ns,
                     " or give a position"),
        {{"agent", ToString(agent)},
         {"at_ns", absl::StrCat(at_ns)},
         {"first_ns", absl::StrCat(located.before_ns)},
         {"last_ns", absl::StrCat(located.after_ns)}});
  }
  return located.map_T_agent.position;
}

}  // namespace

bool IsAgent(const GraphView& view, const ViewNode& node) {
  return IsAgentKind(view.symbols().Text(node.kind));
}

absl::StatusOr<PathTarget> TargetOf(const PathWorld& world, const ViewNode& node) {
  PathTarget target;
  target.node = node.id;
  if (const std::optional<PlaceIndex> place = world.places.Find(node.id); place.has_value()) {
    target.places.push_back(*place);
    return target;
  }
  if (IsAgent(world.view, node)) {
    DSG_ASSIGN_OR_RETURN(target.position_map, PositionOf(world, node.id));
    // People sit in chairs: then near is all that one gets.
    target.box_map = Box3d(*target.position_map);
    return target;
  }
  if (IsAbovePlaces(world.view, node)) {
    DSG_ASSIGN_OR_RETURN(target.places, PlacesBelow(world, node.id));
    if (!target.places.empty()) return target;
  }
  target.box_map = node.BoxMap();
  for (const NodeId ancestor : world.view.Ancestors(node.id)) {
    const ViewNode* above = world.view.FindNode(ancestor);
    if (above == nullptr || above->layer != layers::kRooms) continue;
    target.room = ancestor;
    break;
  }
  return target;
}

absl::StatusOr<bool> Block(const PathWorld& world, const ViewNode& node,
                           std::vector<uint8_t>* blocked) {
  std::vector<PlaceIndex> below;
  if (const std::optional<PlaceIndex> place = world.places.Find(node.id); place.has_value()) {
    below.push_back(*place);
  } else if (IsAbovePlaces(world.view, node)) {
    DSG_ASSIGN_OR_RETURN(below, PlacesBelow(world, node.id));
  } else {
    return false;
  }
  blocked->resize(static_cast<size_t>(world.places.size()), 0);
  for (const PlaceIndex place : below) (*blocked)[static_cast<size_t>(place)] = 1;
  return true;
}

}  // namespace dsg::query
