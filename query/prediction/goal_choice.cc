// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/goal_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "query/prediction/route.h"
#include "query/prediction/walk_space.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

using Square = std::tuple<int64_t, int64_t, int64_t>;

constexpr double kChoiceCellM = 1.0;
/// Places or attractions between two questions to the stop check.
constexpr int64_t kChoicePlacesPerStop = 256;

/// Of the storey, nearer than `reach_m`; of equals the lowest; -1 = none. `places` are those of the
/// graph.
int NearestPlace(const WalkGraph& graph, const CellMap& places, const Eigen::Vector3d& position_map,
                 double reach_m) {
  int best = -1;
  double best_m = reach_m;
  places.ForEachAround(position_map, reach_m, [&](int place) {
    const Eigen::Vector3d& place_map = graph.places_map[place];
    if (std::abs(place_map.z() - position_map.z()) > kStoreyHeightM) return;
    const double way_m = Horizontal(place_map, position_map);
    if (way_m > best_m || (way_m == best_m && (best < 0 || place > best))) return;
    best_m = way_m;
    best = place;
  });
  return best;
}

/// Whether one of the chosen places is of the storey and nearer than `apart_m`.
bool IsTaken(const WalkGraph& graph, const CellMap& chosen, int place, double apart_m) {
  const Eigen::Vector3d& place_map = graph.places_map[place];
  bool is_taken = false;
  chosen.ForEachAround(place_map, apart_m, [&](int other) {
    const Eigen::Vector3d& other_map = graph.places_map[other];
    is_taken = is_taken || (std::abs(other_map.z() - place_map.z()) <= kStoreyHeightM &&
                            Horizontal(other_map, place_map) < apart_m);
  });
  return is_taken;
}

Square SquareOf(const Eigen::Vector3d& position_map, double size_m) {
  return {std::llround(std::floor(position_map.x() / size_m)),
          std::llround(std::floor(position_map.y() / size_m)),
          std::llround(std::floor(position_map.z() / (2.0 * kStoreyHeightM)))};
}

struct SquareHash {
  size_t operator()(const Square& square) const {
    const auto [x, y, z] = square;
    size_t hash = 0;
    for (const int64_t part : {x, y, z}) {
      hash = (hash ^ static_cast<size_t>(part)) * 0x9e3779b97f4a7c15ull;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

/// The place with the most room around it stands for its square.
absl::Status AppendAnywhere(const WalkGraph& graph, const GoalChoiceOptions& options,
                            const StopCheck& stop, std::vector<ChosenGoal>* goals) {
  StopCounter counter(stop, kChoicePlacesPerStop);
  std::unordered_map<Square, int, SquareHash> best;
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const int place = static_cast<int>(i);
    const auto [found, is_new] =
        best.emplace(SquareOf(graph.places_map[i], options.anywhere_m), place);
    if (!is_new && graph.clearance_m[i] > graph.clearance_m[found->second]) found->second = place;
  }
  for (const ChosenGoal& goal : *goals) {
    best.erase(SquareOf(graph.places_map[goal.goal.place], options.anywhere_m));
  }
  std::vector<std::pair<Square, int>> ordered(best.begin(), best.end());
  std::sort(ordered.begin(), ordered.end());
  for (const auto& [square, place] : ordered)
    goals->push_back({{place, options.anywhere_prior}, -1});
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<ChosenGoal>> ChooseGoals(const WalkGraph& graph,
                                                    const std::vector<Attraction>& attractions,
                                                    const GoalChoiceOptions& options,
                                                    const StopCheck& stop) {
  DSG_CHECK(options.anywhere_m > 0.0 && options.anywhere_prior >= 0.0);
  StopCounter counter(stop, kChoicePlacesPerStop);
  CellMap places(kChoiceCellM);
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    places.Add(graph.places_map[i], 0.0, static_cast<int>(i));
  }
  CellMap chosen(kChoiceCellM);
  std::vector<ChosenGoal> goals;
  for (size_t i = 0; i < attractions.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const int place = NearestPlace(graph, places, attractions[i].position_map, options.reach_m);
    if (place < 0 || IsTaken(graph, chosen, place, options.apart_m)) continue;
    goals.push_back({{place, attractions[i].prior}, static_cast<int>(i)});
    chosen.Add(graph.places_map[place], 0.0, place);
  }
  if (options.anywhere_prior > 0.0) {
    DSG_RETURN_IF_ERROR(AppendAnywhere(graph, options, stop, &goals));
  }
  return goals;
}

std::vector<ChosenGoal> ChooseGoals(const WalkGraph& graph,
                                    const std::vector<Attraction>& attractions,
                                    const GoalChoiceOptions& options) {
  return *ChooseGoals(graph, attractions, options, StopCheck());
}

bool DrawsPeople(std::string_view class_name) {
  constexpr std::array<std::string_view, 22> kNames = {
      "chair", "armchair", "couch",        "sofa",   "desk",    "table",  "bed",  "counter",
      "sink",  "toilet",   "bench",        "stool",  "printer", "fridge", "oven", "stove",
      "tv",    "monitor",  "refrigerator", "copier", "machine", "bathtub"};
  const size_t blank = class_name.find_last_of(" _-");
  std::string word(blank == std::string_view::npos ? class_name : class_name.substr(blank + 1));
  for (char& letter : word) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return std::find(kNames.begin(), kNames.end(), word) != kNames.end();
}

}  // namespace dsg::query
