// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/free_space.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "query/prediction/prediction.h"
#include "query/prediction/route.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr double kStepM = 0.1;
constexpr double kCellM = 1.0;
/// Larger clearances are used up to here, so that a place in a hall does not fill a thousand cells.
constexpr double kRadiusMMax = 3.0;
/// Places between two questions to the stop check.
constexpr int64_t kStopPeriod = 256;

struct Ball {
  Eigen::Vector2d centre;
  double radius_m = 0.0;
};

/// Clearances of the storey that reach into what the path covers.
std::vector<Ball> BallsAround(const PathPoint& last, const PredictedPath& predicted,
                              const WalkGraph& graph) {
  Eigen::AlignedBox2d covered(last.position_map.head<2>().eval());
  for (const Eigen::Vector3d& position_map : predicted.positions_map) {
    covered.extend(position_map.head<2>().eval());
  }
  std::vector<Ball> balls;
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    const Eigen::Vector2d centre = graph.places_map[i].head<2>();
    if (std::abs(graph.places_map[i].z() - last.position_map.z()) > kStoreyHeightM) continue;
    if (covered.exteriorDistance(centre) > graph.clearance_m[i]) continue;
    balls.push_back({centre, graph.clearance_m[i]});
  }
  return balls;
}

/// Whether one ball holds both points, so that the line between is free.
bool InOneBall(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const std::vector<Ball>& balls) {
  return std::any_of(balls.begin(), balls.end(), [&](const Ball& ball) {
    return (a - ball.centre).norm() <= ball.radius_m && (b - ball.centre).norm() <= ball.radius_m;
  });
}

/// How far towards `to_map` all is known to be free.
absl::StatusOr<Eigen::Vector3d> LastFree(const Eigen::Vector3d& from_map,
                                         const Eigen::Vector3d& to_map,
                                         const std::vector<Ball>& balls, const StopCheck& stop) {
  const Eigen::Vector3d way = to_map - from_map;
  const int part_count = 1 + static_cast<int>(std::min(way.norm() / kStepM, 1e6));
  Eigen::Vector3d reached_map = from_map;
  for (int part = 1; part <= part_count; ++part) {
    const Eigen::Vector3d next_map =
        part == part_count ? to_map : (from_map + way * part / part_count).eval();
    DSG_RETURN_IF_ERROR(AskStop(stop));
    if (!InOneBall(reached_map.head<2>(), next_map.head<2>(), balls)) break;
    reached_map = next_map;
  }
  return reached_map;
}

}  // namespace

FreeSpace::FreeSpace() : cells_(kCellM) {}

absl::StatusOr<FreeSpace> FreeSpace::Make(const WalkGraph& graph, const StopCheck& stop) {
  FreeSpace space;
  StopCounter counter(stop, kStopPeriod);
  space.balls_.reserve(graph.places_map.size());
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    space.balls_.push_back({graph.places_map[i], std::min(graph.clearance_m[i], kRadiusMMax)});
  }
  std::sort(space.balls_.begin(), space.balls_.end(),
            [](const auto& a, const auto& b) { return a.radius_m > b.radius_m; });
  for (size_t i = 0; i < space.balls_.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    space.cells_.Add(space.balls_[i].centre_map, space.balls_[i].radius_m, static_cast<int>(i));
  }
  return space;
}

double FreeSpace::RadiusM(const Eigen::Vector3d& point_map) const {
  double best_m = -std::numeric_limits<double>::infinity();
  for (const int i : cells_.At(point_map)) {
    const Ball& ball = balls_[i];
    // Those that follow are no larger.
    if (ball.radius_m <= best_m) break;
    if (std::abs(ball.centre_map.z() - point_map.z()) > kStoreyHeightM) continue;
    best_m = std::max(best_m, ball.radius_m - (ball.centre_map - point_map).head<2>().norm());
  }
  return best_m;
}

bool FreeSpace::IsClear(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                        double margin_m) const {
  const Eigen::Vector3d way = to_map - from_map;
  const double length_m = way.head<2>().norm();
  double along_m = 0.0;
  while (true) {
    const double share = length_m > 0.0 ? std::min(1.0, along_m / length_m) : 1.0;
    const double radius_m = RadiusM(from_map + share * way);
    if (radius_m < margin_m) return false;
    if (share >= 1.0) return true;
    // All within the radius is free, and with the margin all within what is left of it.
    along_m += std::max(kStepM, radius_m - margin_m);
  }
}

absl::Status StopAtEdge(const PathPoint& last, const WalkGraph& graph, const StopCheck& stop,
                        PredictedPath* predicted) {
  const std::vector<Ball> balls = BallsAround(last, *predicted, graph);
  Eigen::Vector3d reached_map = last.position_map;
  bool waits = false;
  for (Eigen::Vector3d& position_map : predicted->positions_map) {
    if (!waits) {
      DSG_ASSIGN_OR_RETURN(reached_map, LastFree(reached_map, position_map, balls, stop));
    }
    waits = waits || reached_map != position_map;
    position_map = reached_map;
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
