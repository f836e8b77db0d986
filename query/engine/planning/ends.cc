// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/ends.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "query/engine/planning/planning_annex.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr size_t kAnchorsMax = 4;
// The tiers whose clearances say that the way is free.
constexpr size_t kProvenTiers = 2;
// Looking for obstacles is costly: so many lines to a position are tried.
constexpr size_t kLinesMax = 8;
constexpr int64_t kEndPlacesPerStop = 256;

void KeepNearest(size_t count_max, std::vector<Anchor>* anchors) {
  std::sort(anchors->begin(), anchors->end(), [](const Anchor& a, const Anchor& b) {
    return std::tie(a.way_m, a.place) < std::tie(b.way_m, b.place);
  });
  if (anchors->size() > count_max) anchors->resize(count_max);
}

double SquaredDistanceToSegment(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b) {
  const Eigen::Vector3d along = b - a;
  const Eigen::Vector3d from_a = point - a;
  const double square = along.squaredNorm();
  if (square == 0.0) return from_a.squaredNorm();
  const double fraction = std::clamp(from_a.dot(along) / square, 0.0, 1.0);
  return (from_a - fraction * along).squaredNorm();
}

class Attacher {
 public:
  Attacher(const PlaceGraph& graph, const Limits& limits, const LineCheck& is_free,
           const PlaceLocator& locator)
      : graph_(graph), limits_(limits), is_free_(is_free), locator_(locator) {}

  absl::StatusOr<std::vector<Anchor>> ToPosition(const Eigen::Vector3d& point_map,
                                                 NodeId node) const {
    std::array<std::vector<Anchor>, 4> tiers;
    const double reach_m = std::max(kAttachM, locator_.clearance_m_max()) +
                           0.5 * locator_.link_length_m_max() + kStoreyM;
    locator_.ForEachNear(Box3d(point_map), reach_m, [&](PlaceIndex place) {
      if (!limits_.Admits(graph_, place)) return;
      const std::optional<size_t> tier = TierOf(place, point_map);
      if (!tier.has_value()) return;
      const double way_m = (graph_.position_map(place) - point_map).norm();
      tiers[*tier].push_back({place, way_m, node});
    });
    for (size_t i = 0; i < tiers.size(); ++i) {
      if (i >= kProvenTiers) {
        KeepNearest(kLinesMax, &tiers[i]);
        DSG_RETURN_IF_ERROR(DropUnfree(point_map, &tiers[i]));
      }
      if (tiers[i].empty()) continue;
      KeepNearest(i + 1 == tiers.size() ? 1 : kAnchorsMax, &tiers[i]);
      return std::move(tiers[i]);
    }
    return std::vector<Anchor>();
  }

  std::vector<Anchor> ToBox(const PathTarget& target) const {
    const Box3d& box = *target.box_map;
    std::vector<Anchor> near;
    std::vector<Anchor> in_room;
    const double reach_m = std::max(kAttachM, locator_.clearance_m_max());
    locator_.ForEachNear(box, reach_m, [&](PlaceIndex place) {
      if (!limits_.Admits(graph_, place)) return;
      const Eigen::Vector3d& at = graph_.position_map(place);
      const double way_m = box.exteriorDistance(at);
      const double beside_m = box.exteriorDistance(AtHeight(at, box));
      if (beside_m > std::max(kAttachM, graph_.clearance_m(place))) return;
      if (at.z() < box.min().z() - kStoreyM || at.z() > box.max().z() + kStoreyM) return;
      near.push_back({place, way_m, target.node, target.position_map.has_value()});
      const bool same = !target.room.empty() && graph_.room(place) == target.room;
      if (same) in_room.push_back(near.back());
    });
    std::vector<Anchor>& chosen = in_room.empty() ? near : in_room;
    KeepNearest(kAnchorsMax, &chosen);
    return std::move(chosen);
  }

  std::vector<Anchor> ToPlaces(const PathTarget& target) const {
    std::vector<Anchor> anchors;
    for (const PlaceIndex place : target.places) {
      if (limits_.Admits(graph_, place)) anchors.push_back({place, 0.0, target.node});
    }
    return anchors;
  }

 private:
  absl::Status DropUnfree(const Eigen::Vector3d& point_map, std::vector<Anchor>* anchors) const {
    if (!is_free_) return absl::OkStatus();
    std::vector<Anchor> kept;
    for (const Anchor& anchor : *anchors) {
      DSG_ASSIGN_OR_RETURN(const bool is_free,
                           is_free_(point_map, graph_.position_map(anchor.place)));
      if (is_free) kept.push_back(anchor);
    }
    *anchors = std::move(kept);
    return absl::OkStatus();
  }

  // 0 = the best; see the header.
  std::optional<size_t> TierOf(PlaceIndex place, const Eigen::Vector3d& point_map) const {
    const Eigen::Vector3d to_place = graph_.position_map(place) - point_map;
    const double clearance_m = graph_.clearance_m(place);
    const double free_m = clearance_m - limits_.radius_m;
    if (to_place.norm() <= free_m || IsBesideLink(place, point_map)) return 0;
    if (std::abs(to_place.z()) > kStoreyM) {
      return to_place.norm() <= clearance_m ? std::optional<size_t>(2) : std::nullopt;
    }
    const double level_m = to_place.head<2>().norm();
    const Eigen::Vector3d level_map(point_map.x(), point_map.y(), graph_.position_map(place).z());
    if (level_m <= free_m || IsBesideLink(place, level_map)) return 1;
    if (level_m <= clearance_m) return 2;
    return level_m <= kAttachM ? std::optional<size_t>(3) : std::nullopt;
  }

  // The same point at a height of the box, as far as that is within the storey.
  static Eigen::Vector3d AtHeight(const Eigen::Vector3d& point, const Box3d& box) {
    return {point.x(), point.y(), std::clamp(point.z(), box.min().z(), box.max().z())};
  }

  // The space that a link has swept is convex: whoever is in it gets to both ends.
  bool IsBesideLink(PlaceIndex place, const Eigen::Vector3d& point_map) const {
    const Eigen::Vector3d& place_map = graph_.position_map(place);
    const double to_place_m = (place_map - point_map).norm();
    return std::any_of(graph_.links_begin(place), graph_.links_end(place), [&](const auto& link) {
      const double free_m = static_cast<double>(link.clearance_m) - limits_.radius_m;
      // Most links are too short to lead there: their other ends need not be looked up.
      constexpr double kRoundingM = 1e-9;
      if (to_place_m - link.length_m > free_m + kRoundingM) return false;
      return limits_.Admits(link) && free_m >= 0.0 &&
             SquaredDistanceToSegment(point_map, place_map, graph_.position_map(link.to)) <=
                 free_m * free_m;
    });
  }

  const PlaceGraph& graph_;
  const Limits& limits_;
  const LineCheck& is_free_;
  const PlaceLocator& locator_;
};

}  // namespace

void SortAnchors(std::vector<Anchor>* anchors) {
  std::sort(anchors->begin(), anchors->end(), [](const Anchor& a, const Anchor& b) {
    return std::tie(a.place, a.way_m, a.node) < std::tie(b.place, b.way_m, b.node);
  });
  anchors->erase(std::unique(anchors->begin(), anchors->end(),
                             [](const Anchor& a, const Anchor& b) { return a.place == b.place; }),
                 anchors->end());
}

absl::StatusOr<std::vector<Anchor>> Attach(const PlaceGraph& graph, const Limits& limits,
                                           const std::vector<PathTarget>& targets,
                                           const LineCheck& is_free, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const PlanningAnnex* annex, PlanningAnnex::Of(graph, stop));
  const Attacher attacher(graph, limits, is_free, annex->locator());
  std::vector<Anchor> all;
  for (size_t i = 0; i < targets.size(); ++i) {
    if (i % kEndPlacesPerStop == 0 && stop) DSG_RETURN_IF_ERROR(stop());
    const PathTarget& target = targets[i];
    std::vector<Anchor> anchors = attacher.ToPlaces(target);
    if (target.position_map.has_value()) {
      DSG_ASSIGN_OR_RETURN(anchors, attacher.ToPosition(*target.position_map, target.node));
    }
    if (anchors.empty() && target.box_map.has_value()) anchors = attacher.ToBox(target);
    all.insert(all.end(), anchors.begin(), anchors.end());
  }
  SortAnchors(&all);
  return all;
}

namespace {

absl::StatusOr<std::vector<PlaceIndex>> PlacesBelow(const PathWorld& world, NodeId top) {
  std::vector<PlaceIndex> below;
  StopCounter counter(world.stop, kEndPlacesPerStop);
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
