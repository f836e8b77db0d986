// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/prediction/truth_walks.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

#include "query/prediction/goal_choice.h"

namespace dsg::query {
namespace {

constexpr double kSquareM = 0.6;
constexpr double kLinkClearanceM = 0.2;
constexpr double kPlaceClearanceM = 0.25;
constexpr double kTorsoHeightM = 0.9;

using Square = std::pair<int, int>;

}  // namespace

ingest::DistanceField FreeField(const truth::Truth& truth) {
  const truth::FreeGrid& from = truth.free_grid;
  ingest::OccupancyGrid grid;
  grid.frame.origin_map = {from.origin_map.x(), from.origin_map.y(), 0.0};
  // One cell high enough for all torsos would not be a cube, so there is one layer, asked at z = 0.
  grid.frame.cell_m = from.cell_m;
  grid.frame.size = {from.width, from.height, 1};
  grid.cells.reserve(from.cells.size());
  for (const uint8_t cell : from.cells) {
    grid.cells.push_back((cell & truth::kCellFree) != 0 ? ingest::Occupancy::kFree
                                                        : ingest::Occupancy::kOccupied);
  }
  return ingest::DistanceField(std::move(grid));
}

WalkGraph GraphOf(const ingest::DistanceField& field) {
  const ingest::GridFrame& frame = field.frame();
  std::map<Square, int64_t> best_cells;
  for (int64_t i = 0; i < frame.CellCount(); ++i) {
    if (field.CellClearanceM(i) < kPlaceClearanceM) continue;
    const Eigen::Vector3d centre = frame.Center(frame.Cell(i)) - frame.origin_map;
    const Square square{static_cast<int>(centre.x() / kSquareM),
                        static_cast<int>(centre.y() / kSquareM)};
    const auto [found, is_new] = best_cells.emplace(square, i);
    if (!is_new && field.DistanceM(i) > field.DistanceM(found->second)) found->second = i;
  }
  WalkGraph graph;
  std::map<Square, int> places;
  for (const auto& [square, cell] : best_cells) {
    places[square] = static_cast<int>(graph.places_map.size());
    graph.places_map.push_back(frame.Center(frame.Cell(cell)));
    graph.clearance_m.push_back(field.CellClearanceM(cell));
  }
  constexpr std::array<Square, 4> kAround = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  for (const auto& [square, place] : places) {
    for (const auto& [dx, dy] : kAround) {
      const auto other = places.find({square.first + dx, square.second + dy});
      if (other == places.end()) continue;
      if (!field.HasClearance(graph.places_map[place], graph.places_map[other->second],
                              kLinkClearanceM)) {
        continue;
      }
      graph.links.emplace_back(place, other->second);
    }
  }
  for (Eigen::Vector3d& place_map : graph.places_map) place_map.z() = kTorsoHeightM;
  return graph;
}

std::vector<Goal> GoalsOf(const truth::Truth& truth, const WalkGraph& graph) {
  std::vector<Eigen::Vector2d> wanted;
  for (const truth::Door& door : truth.doors) wanted.push_back(0.5 * (door.from_map + door.to_map));
  for (const truth::Room& room : truth.rooms) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const auto& corner : room.footprint_map) middle += Eigen::Vector2d(corner.x(), corner.y());
    wanted.push_back(middle / static_cast<double>(room.footprint_map.size()));
  }
  for (const truth::Object& object : truth.objects) {
    if (DrawsPeople(object.class_name)) wanted.push_back(object.map_T_object.position.head<2>());
  }
  std::vector<Attraction> attractions;
  for (const Eigen::Vector2d& point : wanted) {
    attractions.push_back({{point.x(), point.y(), kTorsoHeightM}, 1.0});
  }
  std::vector<Goal> goals;
  for (const ChosenGoal& chosen : ChooseGoals(graph, attractions, {})) goals.push_back(chosen.goal);
  return goals;
}

std::vector<std::vector<PathPoint>> PathsOf(const truth::Truth& truth) {
  std::vector<std::vector<PathPoint>> paths(truth.humans.size());
  for (const truth::HumanState& state : truth.human_states) {
    paths[state.human].push_back({state.time_ns, state.map_T_torso.position});
  }
  return paths;
}

}  // namespace dsg::query
