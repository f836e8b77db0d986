// SPDX-License-Identifier: Apache-2.0
// Predictions of simulated people on the true places, beside constant velocity.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <limits>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "tests/unit/query/prediction/truth_walks.h"

namespace dsg::query {
namespace {

constexpr TimeNs kTenthNs = 100'000'000;
/// Of tenths of a second ahead.
constexpr std::array<size_t, 3> kHorizons = {20, 48, 80};
/// Truth has five states a second; a walk is seen at every second of them, for eight seconds.
constexpr size_t kStride = 2;
constexpr size_t kSeenCount = 21;
constexpr double kWalkingMS = 0.3;

struct Errors {
  std::array<double, kHorizons.size()> ade_m{};
  std::array<double, kHorizons.size()> fde_m{};
};

struct Tally {
  std::string name;
  Errors sums;
  int crossing_count = 0;
  int path_count = 0;
};

struct World {
  ingest::DistanceField field;
  GoalField goals;
  std::vector<std::vector<PathPoint>> paths;
};

/// The walk leaves free cells after it has been in one.
bool LeavesFreeSpace(const World& world, const std::vector<Eigen::Vector3d>& walk_map) {
  bool was_free = false;
  Eigen::Vector3d before = walk_map.front();
  for (const Eigen::Vector3d& next : walk_map) {
    const int part_count = 1 + static_cast<int>((next - before).norm() / 0.05);
    for (int part = 1; part <= part_count; ++part) {
      Eigen::Vector3d at_map = before + (next - before) * part / part_count;
      at_map.z() = 0.0;
      const bool is_free = world.field.grid().AtPoint(at_map) == ingest::Occupancy::kFree;
      if (was_free && !is_free) return true;
      was_free = was_free || is_free;
    }
    before = next;
  }
  return false;
}

/// Linear between the points. Requires: the time within the path.
Eigen::Vector3d TruthAt(const std::vector<PathPoint>& path, TimeNs time_ns) {
  const auto after =
      std::lower_bound(path.begin() + 1, path.end() - 1, time_ns,
                       [](const PathPoint& point, TimeNs t_ns) { return point.time_ns < t_ns; });
  const auto before = after - 1;
  const double share = static_cast<double>(time_ns - before->time_ns) /
                       static_cast<double>(after->time_ns - before->time_ns);
  return before->position_map + share * (after->position_map - before->position_map);
}

/// The least error of any of the paths, mean and last ones apart, as is the custom.
Errors LeastErrors(const std::vector<PredictedPath>& paths, size_t count,
                   const std::vector<Eigen::Vector3d>& truth_map) {
  Errors least;
  least.ade_m.fill(std::numeric_limits<double>::infinity());
  least.fde_m = least.ade_m;
  for (size_t i = 0; i < std::min(count, paths.size()); ++i) {
    double sum_m = 0.0;
    size_t horizon = 0;
    for (size_t k = 0; k < truth_map.size(); ++k) {
      const double error_m = (paths[i].positions_map[k] - truth_map[k]).head<2>().norm();
      sum_m += error_m;
      if (k + 1 != kHorizons[horizon]) continue;
      least.ade_m[horizon] = std::min(least.ade_m[horizon], sum_m / static_cast<double>(k + 1));
      least.fde_m[horizon] = std::min(least.fde_m[horizon], error_m);
      ++horizon;
    }
  }
  return least;
}

void Count(const World& world, const PathPoint& last, const std::vector<PredictedPath>& paths,
           size_t count, const std::vector<Eigen::Vector3d>& truth_map, Tally* tally) {
  const Errors errors = LeastErrors(paths, count, truth_map);
  for (size_t i = 0; i < kHorizons.size(); ++i) {
    tally->sums.ade_m[i] += errors.ade_m[i];
    tally->sums.fde_m[i] += errors.fde_m[i];
  }
  for (size_t i = 0; i < std::min(count, paths.size()); ++i) {
    std::vector<Eigen::Vector3d> walk_map = {last.position_map};
    walk_map.insert(walk_map.end(), paths[i].positions_map.begin(), paths[i].positions_map.end());
    tally->crossing_count += LeavesFreeSpace(world, walk_map);
    ++tally->path_count;
  }
}

std::vector<PathPoint> SeenUntil(const std::vector<PathPoint>& path, size_t end) {
  std::vector<PathPoint> seen;
  for (size_t i = end + 1 - kStride * (kSeenCount - 1) - 1; i <= end; i += kStride) {
    seen.push_back(path[i]);
  }
  return seen;
}

/// Straight, straight and damped, the best goal, six goals, and what people really did.
std::array<Tally, 5> PredictAll(const World& world, int* window_count) {
  std::array<Tally, 5> tallies;
  tallies[0].name = "straight";
  tallies[1].name = "weighted";
  tallies[2].name = "goals @1";
  tallies[3].name = "goals @6";
  tallies[4].name = "(truth)";
  for (const std::vector<PathPoint>& path : world.paths) {
    for (size_t end = kStride * kSeenCount; end + 41 < path.size(); end += 10) {
      const std::vector<PathPoint> seen = SeenUntil(path, end);
      if (LastVelocity(seen).velocity_map.norm() < kWalkingMS) continue;
      std::vector<TimeNs> at_ns;
      PredictedPath truth;
      for (size_t i = 1; i <= kHorizons.back(); ++i) {
        at_ns.push_back(seen.back().time_ns + static_cast<TimeNs>(i) * kTenthNs);
        truth.positions_map.push_back(TruthAt(path, at_ns.back()));
      }
      ++*window_count;
      const std::vector<PredictedPath> to_goals = PredictToGoals(seen, at_ns, world.goals, {});
      const std::array<std::vector<PredictedPath>, 5> all = {
          std::vector<PredictedPath>{PredictConstantVelocity(seen, at_ns, {})},
          {PredictWeightedVelocity(seen, at_ns, {})},
          to_goals,
          to_goals,
          {truth}};
      for (size_t i = 0; i < all.size(); ++i) {
        Count(world, seen.back(), all[i], i == 3 ? 6 : 1, truth.positions_map, &tallies[i]);
      }
    }
  }
  return tallies;
}

/// Of walks between two rests: whether the goal nearest to the end is among the likeliest three
/// when half of the way is behind.
void CountDestinations(const World& world, int* walk_count, int* hit_count) {
  const WalkGraph& graph = world.goals.graph();
  for (const std::vector<PathPoint>& path : world.paths) {
    size_t begin = 0;
    for (size_t i = 1; i < path.size(); ++i) {
      const double step_m = (path[i].position_map - path[i - 1].position_map).head<2>().norm();
      if (step_m >= kWalkingMS * 0.2) continue;
      const std::vector<PathPoint> walk(path.begin() + begin, path.begin() + i);
      begin = i;
      if (walk.size() < 25) continue;
      const std::vector<PathPoint> half(walk.begin(), walk.begin() + walk.size() / 2);
      const std::vector<double> probabilities = GoalProbabilities(half, world.goals, {});
      std::vector<int> order(probabilities.size());
      std::iota(order.begin(), order.end(), 0);
      std::stable_sort(order.begin(), order.end(),
                       [&](int a, int b) { return probabilities[a] > probabilities[b]; });
      const auto way_m = [&](int goal) {
        const Eigen::Vector3d& goal_map = graph.places_map[world.goals.goals()[goal].place];
        return (goal_map - walk.back().position_map).head<2>().norm();
      };
      const int nearest = *std::min_element(order.begin(), order.end(),
                                            [&](int a, int b) { return way_m(a) < way_m(b); });
      ++*walk_count;
      *hit_count += std::find(order.begin(), order.begin() + 3, nearest) != order.begin() + 3;
    }
  }
}

void PrintTally(const Tally& tally, int window_count) {
  std::cout << "  " << std::left << std::setw(10) << tally.name << std::fixed
            << std::setprecision(2);
  for (size_t i = 0; i < kHorizons.size(); ++i) {
    std::cout << "  " << tally.sums.ade_m[i] / window_count << " / "
              << tally.sums.fde_m[i] / window_count;
  }
  std::cout << "   " << tally.crossing_count << " of " << tally.path_count << " leave free space\n";
}

class SimulatedPeople : public testing::TestWithParam<std::string> {};

TEST_P(SimulatedPeople, AreForeseenBetterOnPlacesThanStraightOn) {
  const char* root = std::getenv("DSG_LOGS");
  const std::string folder = std::string(root != nullptr ? root : "") + "/" + GetParam() + "/truth";
  if (root == nullptr || !std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "set DSG_LOGS to a folder with simulated logs named apt1, office1, ...";
  }
  const absl::StatusOr<truth::Truth> truth = truth::ReadTruth(folder);
  ASSERT_TRUE(truth.ok()) << truth.status();
  ingest::DistanceField field = FreeField(*truth);
  const WalkGraph graph = GraphOf(field);
  const World world{std::move(field), GoalField(graph, GoalsOf(*truth, graph)), PathsOf(*truth)};
  int window_count = 0;
  const std::array<Tally, 5> tallies = PredictAll(world, &window_count);
  int walk_count = 0;
  int hit_count = 0;
  CountDestinations(world, &walk_count, &hit_count);
  std::cout << GetParam() << ": " << graph.places_map.size() << " places, "
            << world.goals.goals().size() << " goals, " << window_count
            << " windows; ADE / FDE in metres after 2, 4.8 and 8 s\n";
  for (const Tally& tally : tallies) PrintTally(tally, window_count);
  std::cout << "  destination among three at half way: " << hit_count << " of " << walk_count
            << "\n";
  ASSERT_GT(window_count, 0);
  EXPECT_EQ(tallies[2].crossing_count, 0);
  EXPECT_EQ(tallies[3].crossing_count, 0);
  EXPECT_LT(tallies[2].sums.fde_m[1], 0.8 * tallies[0].sums.fde_m[1]);
  EXPECT_LT(tallies[2].sums.fde_m[2], 0.8 * tallies[0].sums.fde_m[2]);
  EXPECT_LT(tallies[3].sums.fde_m[1], 0.6 * tallies[0].sums.fde_m[1]);
}

/// DSG_LOG_NAMES, parted by commas, or those that the parameters were found on.
std::vector<std::string> LogNames() {
  const char* names = std::getenv("DSG_LOG_NAMES");
  std::istringstream text(names != nullptr ? names : "apt1,apt2,apt3,office1,wing1");
  std::vector<std::string> found;
  for (std::string name; std::getline(text, name, ',');) found.push_back(name);
  return found;
}

INSTANTIATE_TEST_SUITE_P(Logs, SimulatedPeople, testing::ValuesIn(LogNames()));

}  // namespace
}  // namespace dsg::query
