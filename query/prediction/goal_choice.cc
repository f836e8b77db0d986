// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/goal_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>

#include "query/prediction/route.h"
#include "schema/base/check.h"

namespace dsg::query {
namespace {

using Square = std::tuple<int64_t, int64_t, int64_t>;

double Horizontal(const Eigen::Vector3d& a_map, const Eigen::Vector3d& b_map) {
  return (a_map - b_map).head<2>().norm();
}

/// Places by x, so that few are looked at for each attraction.
class PlaceStrips {
 public:
  explicit PlaceStrips(const WalkGraph& graph) : graph_(graph) {
    for (size_t i = 0; i < graph.places_map.size(); ++i) {
      by_x_.push_back({graph.places_map[i].x(), static_cast<int>(i)});
    }
    std::sort(by_x_.begin(), by_x_.end());
  }

  /// Of the storey, nearer than `reach_m`; of equals the lowest; -1 = none.
  int Nearest(const Eigen::Vector3d& position_map, double reach_m) const {
    int best = -1;
    double best_m = reach_m;
    const std::pair<double, int> low{position_map.x() - reach_m, 0};
    for (auto at = std::lower_bound(by_x_.begin(), by_x_.end(), low);
         at != by_x_.end() && at->first <= position_map.x() + reach_m; ++at) {
      const Eigen::Vector3d& place_map = graph_.places_map[at->second];
      if (std::abs(place_map.z() - position_map.z()) > kStoreyHeightM) continue;
      const double way_m = Horizontal(place_map, position_map);
      if (way_m > best_m || (way_m == best_m && (best < 0 || at->second > best))) continue;
      best_m = way_m;
      best = at->second;
    }
    return best;
  }

 private:
  const WalkGraph& graph_;
  std::vector<std::pair<double, int>> by_x_;
};

Square SquareOf(const Eigen::Vector3d& position_map, double size_m) {
  return {std::llround(std::floor(position_map.x() / size_m)),
          std::llround(std::floor(position_map.y() / size_m)),
          std::llround(std::floor(position_map.z() / (2.0 * kStoreyHeightM)))};
}

/// The place with the most room around it stands for its square.
void AppendAnywhere(const WalkGraph& graph, const GoalChoiceOptions& options,
                    std::vector<ChosenGoal>* goals) {
  std::map<Square, int> best;
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    const int place = static_cast<int>(i);
    const auto [found, is_new] =
        best.emplace(SquareOf(graph.places_map[i], options.anywhere_m), place);
    if (!is_new && graph.clearance_m[i] > graph.clearance_m[found->second]) found->second = place;
  }
  std::set<Square> taken;
  for (const ChosenGoal& goal : *goals) {
    taken.insert(SquareOf(graph.places_map[goal.goal.place], options.anywhere_m));
  }
  for (const auto& [square, place] : best) {
    if (!taken.contains(square)) goals->push_back({{place, options.anywhere_prior}, -1});
  }
}

}  // namespace

std::vector<ChosenGoal> ChooseGoals(const WalkGraph& graph,
                                    const std::vector<Attraction>& attractions,
                                    const GoalChoiceOptions& options) {
  DSG_CHECK(options.anywhere_m > 0.0 && options.anywhere_prior >= 0.0);
  std::vector<ChosenGoal> goals;
  const PlaceStrips strips(graph);
  for (size_t i = 0; i < attractions.size(); ++i) {
    const int place = strips.Nearest(attractions[i].position_map, options.reach_m);
    if (place < 0) continue;
    const bool is_known = std::any_of(goals.begin(), goals.end(), [&](const ChosenGoal& goal) {
      const Eigen::Vector3d& other_map = graph.places_map[goal.goal.place];
      const Eigen::Vector3d way = other_map - graph.places_map[place];
      // Most are far away, which one coordinate tells.
      return std::abs(way.x()) < options.apart_m && std::abs(way.z()) <= kStoreyHeightM &&
             Horizontal(other_map, graph.places_map[place]) < options.apart_m;
    });
    if (is_known) continue;
    goals.push_back({{place, attractions[i].prior}, static_cast<int>(i)});
  }
  if (options.anywhere_prior > 0.0) AppendAnywhere(graph, options, &goals);
  return goals;
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
