// SPDX-License-Identifier: Apache-2.0
// Pose graphs made up for tests: a walk, odometry along it, loops across it.
// Refuses wrong loops: every measurement is near the truth.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/loop/pose_graph.h"
#include "schema/base/random.h"

namespace dsg::ingest {

struct RandomGraphOptions {
  bool is_planar = false;
  int pose_count = 30;
  int loop_count = 20;
  /// Standard deviations of what is measured; the information matrices stay as if they were 1.
  double noise_m = 0.0;
  double noise_rad = 0.0;
};

/// Of x, y and yaw.
inline Pose3d Planar(double x_m, double y_m, double yaw_rad) {
  return {Eigen::Vector3d(x_m, y_m, 0.0),
          Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()))};
}

Pose3d RandomPose(bool is_planar, double range_m, double range_rad, Random* random);

/// A rotation about each axis in turn has no place here: planar information is of x, y and yaw and
/// leaves the rest uncorrelated, so that a planar graph is also a sound spatial one.
Matrix6d RandomInformation(bool is_planar, Random* random);

/// `graph->poses` are the true ones.
PoseGraph RandomGraph(const RandomGraphOptions& options, Random* random);

/// The same poses elsewhere: `map_T_old` before each.
std::vector<Pose3d> Moved(const Pose3d& map_T_old, const std::vector<Pose3d>& poses);

/// Largest distance of positions or angle between rotations.
double LargestDifference(const std::vector<Pose3d>& a, const std::vector<Pose3d>& b);

}  // namespace dsg::ingest
