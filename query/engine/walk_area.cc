// SPDX-License-Identifier: Apache-2.0
#include "query/engine/walk_area.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "query/prediction/goal_choice.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Tells apart what was made at the same address one after the other.
template <typename T>
bool IsSameOwner(const std::weak_ptr<const T>& kept, const std::shared_ptr<const T>& wanted) {
  return !kept.owner_before(wanted) && !wanted.owner_before(kept);
}

constexpr double kTileHeightM = 3.0;
// Stairs lead up and down; whole storeys above do not matter.
constexpr double kReachUpM = 6.0;
// Places nearer to the outline of their building than this may lead out of it.
constexpr double kExitM = 1.5;
// Places or objects between two questions to the stop check.
constexpr int64_t kStopPeriod = 256;

int64_t IndexOf(double coordinate_m, double size_m) {
  return std::llround(std::clamp(std::floor(coordinate_m / size_m), -1e9, 1e9));
}

// Whether something is there at an instant, and from when to when that is so.
class Instant {
 public:
  explicit Instant(TimeNs at_ns) : at_ns_(at_ns) {}

  bool IsIn(const Interval& valid) {
    const bool is_in = valid.Contains(at_ns_);
    for (const TimeNs change_ns : {valid.from_ns, valid.to_ns}) {
      if (change_ns <= at_ns_) same_.from_ns = std::max(same_.from_ns, change_ns);
      if (change_ns > at_ns_) same_.to_ns = std::min(same_.to_ns, change_ns);
    }
    return is_in;
  }

  // While all answers were the same.
  const Interval& same() const { return same_; }

 private:
  const TimeNs at_ns_;
  Interval same_;
};

// What draws people, and the nodes that stand for it.
struct Draws {
  std::vector<Attraction> attractions;
  std::vector<NodeId> nodes;

  void Add(const Eigen::Vector3d& position_map, NodeId node) {
    attractions.push_back({position_map, 1.0});
    nodes.push_back(node);
  }
};

// Where one room passes into another.
absl::Status AddDoors(const PlaceGraph& all, const WalkGrounds& grounds, const StopCheck& stop,
                      Draws* draws) {
  StopCounter counter(stop, kStopPeriod);
  for (const PlaceIndex place : grounds.places) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const bool is_door = std::any_of(
        all.links_begin(place), all.links_end(place), [&](const PlaceGraph::Link& link) {
          return !all.room(place).empty() && !all.room(link.to).empty() &&
                 all.room(place) != all.room(link.to);
        });
    if (is_door) draws->Add(all.position_map(place), all.id(place));
  }
  return absl::OkStatus();
}

absl::Status AddFurniture(const GraphView& view, const WalkTile& tile, const StopCheck& stop,
                          Instant* instant, Draws* draws) {
  StopCounter counter(stop, kStopPeriod);
  absl::Status status;
  const SpaceFilter filter{layers::kObjects, std::nullopt};
  std::vector<std::pair<NodeId, Eigen::Vector3d>> found;
  view.ForEachTouching(tile.BoxMap(), filter, [&](const ViewNode& node) {
    if (DrawsPeople(view.symbols().Text(node.class_name)) && instant->IsIn(node.valid)) {
      found.push_back({node.id, node.BoxMap().center()});
    }
    status = counter.Check();
    return status.ok();
  });
  DSG_RETURN_IF_ERROR(status);
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [id, position_map] : found) draws->Add(position_map, id);
  return absl::OkStatus();
}

// Dead ends at the outline of their building.
absl::Status AddExits(const GraphView& view, const PlaceGraph& all, const WalkGrounds& grounds,
                      const StopCheck& stop, Draws* draws) {
  StopCounter counter(stop, kStopPeriod);
  for (const PlaceIndex place : grounds.places) {
    DSG_RETURN_IF_ERROR(counter.Check());
    if (all.links_end(place) - all.links_begin(place) != 1) continue;
    for (const NodeId above : view.Ancestors(all.id(place))) {
      const ViewNode* node = view.FindNode(above);
      if (node == nullptr || node->layer != layers::kBuildings) continue;
      const Box3d box = node->BoxMap();
      const Eigen::Vector2d position = all.position_map(place).head<2>();
      const double edge_m = std::min((position - box.min().head<2>()).minCoeff(),
                                     (box.max().head<2>() - position).minCoeff());
      if (edge_m <= kExitM) draws->Add(all.position_map(place), all.id(place));
      break;
    }
  }
  return absl::OkStatus();
}

// Those of a tile at an instant, and which of all places they are.
absl::StatusOr<std::vector<PlaceIndex>> AddPlaces(const PlaceGraph& all, const WalkTile& tile,
                                                  const StopCheck& stop, Instant* instant,
                                                  WalkGraph* graph) {
  const Box3d box = tile.BoxMap();
  StopCounter counter(stop, kStopPeriod);
  std::vector<PlaceIndex> places;
  for (PlaceIndex place = 0; place < all.size(); ++place) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const Eigen::Vector3d& position_map = all.position_map(place);
    if (!box.contains(position_map) || !instant->IsIn(all.valid(place))) continue;
    places.push_back(place);
    graph->places_map.push_back(position_map);
    graph->clearance_m.push_back(std::max(0.0, all.clearance_m(place)));
  }
  return places;
}

absl::Status AddLinks(const PlaceGraph& all, const std::vector<PlaceIndex>& places,
                      const StopCheck& stop, Instant* instant, WalkGraph* graph) {
  std::vector<int> index_of(static_cast<size_t>(all.size()), -1);
  for (size_t i = 0; i < places.size(); ++i) {
    index_of[static_cast<size_t>(places[i])] = static_cast<int>(i);
  }
  StopCounter counter(stop, kStopPeriod);
  for (size_t from = 0; from < places.size(); ++from) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const PlaceGraph::Link* end = all.links_end(places[from]);
    for (const PlaceGraph::Link* link = all.links_begin(places[from]); link != end; ++link) {
      if (link->to <= places[from]) continue;
      const int to = index_of[static_cast<size_t>(link->to)];
      if (to < 0 || !instant->IsIn(link->valid)) continue;
      graph->links.push_back({static_cast<int>(from), to});
      graph->link_clearance_m.push_back(std::max(0.0, static_cast<double>(link->clearance_m)));
    }
  }
  return absl::OkStatus();
}

}  // namespace

Box3d WalkTile::BoxMap() const {
  const Eigen::Vector3d size(kTileM, kTileM, kTileHeightM);
  const Eigen::Vector3d low =
      Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z))
          .cwiseProduct(size);
  const Eigen::Vector3d reach(reach_m, reach_m, kReachUpM);
  return Box3d(low - reach, low + size + reach);
}

WalkTile TileOf(const Eigen::Vector3d& position_map, double reach_m) {
  return {IndexOf(position_map.x(), WalkTile::kTileM), IndexOf(position_map.y(), WalkTile::kTileM),
          IndexOf(position_map.z(), kTileHeightM), reach_m};
}

size_t WalkArea::memory_bytes() const {
  return sizeof(WalkArea) + field.memory_bytes() + goal_nodes.capacity() * sizeof(NodeId);
}

absl::StatusOr<WalkGraph> PlacesOfTile(const PlaceGraph& all, const WalkTile& tile, TimeNs at_ns,
                                       const StopCheck& stop) {
  Instant instant(at_ns);
  WalkGraph graph;
  DSG_RETURN_IF_ERROR(AddPlaces(all, tile, stop, &instant, &graph).status());
  return graph;
}

absl::StatusOr<WalkGrounds> MakeWalkGrounds(const PlaceGraph& all, const WalkTile& tile,
                                            TimeNs at_ns, const StopCheck& stop) {
  Instant instant(at_ns);
  WalkGraph graph;
  DSG_ASSIGN_OR_RETURN(std::vector<PlaceIndex> places,
                       AddPlaces(all, tile, stop, &instant, &graph));
  DSG_RETURN_IF_ERROR(AddLinks(all, places, stop, &instant, &graph));
  DSG_ASSIGN_OR_RETURN(GoalField field, GoalField::Make(std::move(graph), {}, stop));
  return WalkGrounds{std::move(field), std::move(places), instant.same()};
}

absl::StatusOr<WalkArea> MakeWalkArea(const GraphView& view, const PlaceGraph& all,
                                      const WalkGrounds& grounds, const WalkTile& tile,
                                      TimeNs at_ns, const StopCheck& stop) {
  Instant instant(at_ns);
  instant.IsIn(grounds.valid);
  Draws draws;
  DSG_RETURN_IF_ERROR(AddDoors(all, grounds, stop, &draws));
  DSG_RETURN_IF_ERROR(AddFurniture(view, tile, stop, &instant, &draws));
  DSG_RETURN_IF_ERROR(AddExits(view, all, grounds, stop, &draws));
  DSG_ASSIGN_OR_RETURN(const std::vector<ChosenGoal> all_chosen,
                       ChooseGoals(grounds.field.graph(), draws.attractions, {}, stop));
  std::vector<Goal> goals;
  std::vector<NodeId> nodes;
  for (const ChosenGoal& chosen : all_chosen) {
    goals.push_back(chosen.goal);
    nodes.push_back(chosen.attraction >= 0
                        ? draws.nodes[static_cast<size_t>(chosen.attraction)]
                        : all.id(grounds.places[static_cast<size_t>(chosen.goal.place)]));
  }
  return WalkArea{grounds.field.WithGoals(std::move(goals)), std::move(nodes), instant.same()};
}

std::shared_ptr<const WalkArea> WalkAreaCache::FindArea(
    const std::shared_ptr<const GraphView>& view, const WalkTile& tile, TimeNs at_ns) {
  const std::lock_guard lock(mutex_);
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
    if (entry->tile != tile || !entry->area->valid.Contains(at_ns) ||
        !IsSameOwner(entry->view, view)) {
      continue;
    }
    ++stats_.hit_count;
    entries_.splice(entries_.begin(), entries_, entry);
    return entry->area;
  }
  return nullptr;
}

std::shared_ptr<const WalkGrounds> WalkAreaCache::FindGrounds(
    const std::shared_ptr<const PlaceGraph>& places, const WalkTile& tile, TimeNs at_ns) const {
  const std::lock_guard lock(mutex_);
  for (const Entry& entry : entries_) {
    if (entry.tile == tile && entry.grounds->valid.Contains(at_ns) &&
        IsSameOwner(entry.places, places)) {
      return entry.grounds;
    }
  }
  return nullptr;
}

void WalkAreaCache::Insert(Entry entry) {
  const std::lock_guard lock(mutex_);
  std::erase_if(entries_, [this](const Entry& kept) {
    if (!kept.places.expired() && !kept.view.expired()) return false;
    stats_.bytes -= kept.bytes;
    return true;
  });
  stats_.bytes += entry.bytes;
  entries_.push_front(std::move(entry));
  // The newest stays, however large: it is in use anyway.
  while (stats_.bytes > bytes_max_ && entries_.size() > 1) {
    stats_.bytes -= entries_.back().bytes;
    entries_.pop_back();
  }
}

absl::StatusOr<std::shared_ptr<const WalkArea>> WalkAreaCache::Get(
    const std::shared_ptr<const GraphView>& view, const Eigen::Vector3d& position_map,
    double reach_m, TimeNs at_ns, const StopCheck& stop) {
  const WalkTile tile = TileOf(position_map, reach_m);
  if (std::shared_ptr<const WalkArea> kept = FindArea(view, tile, at_ns)) return kept;
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const PlaceGraph> places, view->Places(stop));
  std::shared_ptr<const WalkGrounds> grounds = FindGrounds(places, tile, at_ns);
  const bool is_shared = grounds != nullptr;
  if (!is_shared) {
    DSG_ASSIGN_OR_RETURN(WalkGrounds made, MakeWalkGrounds(*places, tile, at_ns, stop));
    grounds = std::make_shared<const WalkGrounds>(std::move(made));
  }
  DSG_ASSIGN_OR_RETURN(WalkArea made, MakeWalkArea(*view, *places, *grounds, tile, at_ns, stop));
  const auto area = std::make_shared<const WalkArea>(std::move(made));
  const size_t bytes =
      area->memory_bytes() + sizeof(Entry) + grounds->places.capacity() * sizeof(PlaceIndex);
  Insert({view, places, tile, grounds, area, bytes});
  const std::lock_guard lock(mutex_);
  ++stats_.made_count;
  stats_.shared_count += is_shared ? 1 : 0;
  return area;
}

WalkAreaCache::Stats WalkAreaCache::stats() const {
  const std::lock_guard lock(mutex_);
  Stats stats = stats_;
  stats.area_count = static_cast<int64_t>(entries_.size());
  return stats;
}

}  // namespace dsg::query
