// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/association.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "schema/matching/assignment.h"

namespace dsg::ingest {
namespace {

/// A track as it is expected at the image's stamp.
struct Expected {
  const TrackEntry* track = nullptr;
  TorsoPrediction torso;
  double reach_m = 0.0;
  TimeNs gap_ns = 0;
};

double LogDeterminant(const Eigen::Matrix3d& covariance) {
  return std::log(covariance.determinant());
}

// options.alone_cost for pairs that must not be.
double PairCost(const Expected& expected, const SeenPerson& seen, const ShapeStatistics& shapes,
                const TrackerOptions& options) {
  const SkeletonDistance apart = Distance(expected.track->skeleton(), seen.skeleton);
  if (!(apart.largest_m <= expected.reach_m)) return options.alone_cost;
  const Eigen::Matrix3d& noise = seen.observation.position_covariance_map;
  const Eigen::Matrix3d covariance = expected.torso.covariance_map + noise;
  const Eigen::Vector3d off = seen.skeleton.torso - expected.torso.position_map;
  const double squared = off.dot(covariance.ldlt().solve(off));
  if (!(squared <= options.gate)) return options.alone_cost;
  double cost = squared + options.joint_weight_per_m * apart.mean_m;
  // A track that could be anywhere is near everything: its width counts against it.
  cost += std::max(0.0, LogDeterminant(covariance) - LogDeterminant(noise));
  if (seen.shape.count > 0 && expected.track->shape().count > 0) {
    const double distance = shapes.SquaredDistance(expected.track->shape(), seen.shape);
    if (distance > options.shape_gate) return options.alone_cost;
    cost += options.shape_weight * distance;
  } else if (expected.gap_ns > options.coast_ns) {
    return options.alone_cost;
  }
  return std::min(cost, options.alone_cost - 1.0);
}

}  // namespace

double ReachM(const TrackerOptions& options, TimeNs gap_ns) {
  const double gap_s = static_cast<double>(gap_ns) / static_cast<double>(kNsPerSecond);
  return options.joint_speed_m_s_max * std::max(1.0, gap_s);
}

std::vector<int> AssignAll(const std::vector<TrackEntry*>& tracks,
                           const std::vector<SeenPerson>& seen, TimeNs time_ns,
                           const ShapeStatistics& shapes, const TrackerOptions& options) {
  std::vector<int> track_of(seen.size(), -1);
  if (tracks.empty() || seen.empty()) return track_of;
  Eigen::MatrixXd cost(static_cast<Eigen::Index>(seen.size()),
                       static_cast<Eigen::Index>(tracks.size()));
  for (size_t j = 0; j < tracks.size(); ++j) {
    const TimeNs gap_ns = time_ns - tracks[j]->last_ns();
    const Expected expected{tracks[j], tracks[j]->track().graph.Predict(time_ns),
                            ReachM(options, gap_ns), gap_ns};
    for (size_t i = 0; i < seen.size(); ++i) {
      cost(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          PairCost(expected, seen[i], shapes, options);
    }
  }
  track_of = MinimumAssignment(cost);
  for (size_t i = 0; i < seen.size(); ++i) {
    if (track_of[i] >= 0 && cost(static_cast<Eigen::Index>(i), track_of[i]) >= options.alone_cost) {
      track_of[i] = -1;
    }
  }
  return track_of;
}

std::vector<int> AssignFirst(const std::vector<TrackEntry*>& tracks,
                             const std::vector<SeenPerson>& seen, TimeNs time_ns,
                             const TrackerOptions& options) {
  std::vector<int> track_of(seen.size(), -1);
  std::vector<bool> is_taken(tracks.size(), false);
  for (size_t i = 0; i < seen.size(); ++i) {
    for (size_t j = 0; j < tracks.size() && track_of[i] < 0; ++j) {
      if (is_taken[j]) continue;
      const double reach_m = ReachM(options, time_ns - tracks[j]->last_ns());
      if (!(Distance(tracks[j]->skeleton(), seen[i].skeleton).largest_m <= reach_m)) continue;
      track_of[i] = static_cast<int>(j);
      is_taken[j] = true;
    }
  }
  return track_of;
}

}  // namespace dsg::ingest
