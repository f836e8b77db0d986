// SPDX-License-Identifier: Apache-2.0
// Which points of two clouds look alike by the shape around them, as input for registration.
// Refuses to judge the matches: most may be wrong, and telling them apart is not its task.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/matching/registration.h"

namespace dsg::ingest {

struct FeatureOptions {
  /// One point per cube of this edge is described. Both clouds want the same density.
  double spacing_m = 0.05;
  double normal_radius_m = 0.1;
  double feature_radius_m = 0.25;
  /// Normals turn towards it: where the sensor stood, roughly.
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
  /// The share of points kept, those whose surroundings are least like the average (no point of a
  /// bare wall can be told from another).
  double distinct_share = 1.0;
};

/// Points with the shape of their surroundings, one column of `descriptors` each.
struct Features {
  std::vector<Eigen::Vector3d> points;
  Eigen::MatrixXf descriptors;
};

/// Thins the cloud and describes what is left by fast point feature histograms. Points that are not
/// finite are passed over, and so are those without neighbours.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for lengths not above zero, a share outside (0, 1], or a
/// cloud too large for its spacing.
/// Source: Rusu, Blodow and Beetz, 2009.
absl::StatusOr<Features> DescribeCloud(const std::vector<Eigen::Vector3d>& cloud,
                                       const FeatureOptions& options);

/// Pairs that are each other's nearest descriptor, the most alike first, at most `count_max`.
///
/// Cost: product of the two counts.
std::vector<Correspondence> MatchMutually(const Features& source, const Features& target,
                                          int count_max);

/// The mean point of each occupied cube of a grid, in the order of the cubes.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for a spacing not above zero, or a cloud too large for
/// it.
absl::StatusOr<std::vector<Eigen::Vector3d>> ThinCloud(const std::vector<Eigen::Vector3d>& cloud,
                                                       double spacing_m);

}  // namespace dsg::ingest
