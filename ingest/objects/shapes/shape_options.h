// SPDX-License-Identifier: Apache-2.0
// How known shapes are fitted: all numbers that decide whether one fits, and where.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

struct ShapeOptions {
  /// RSS 2020: Harris keypoints within 0.15 m, threshold 1e-4.
  double keypoint_radius_m = 0.15;
  double keypoint_threshold = 1e-4;
  double noise_bound_m = 0.08;
  /// Points of both surfaces are resampled to this distance.
  double point_distance_m = 0.05;
  int keypoint_count_max = 60;
  /// The object stands upright: only yaw and position are sought.
  bool is_upright = true;
  /// As in RSS 2020: all pairs of keypoints, six degrees of freedom, and nothing after the solver
  /// but the two tests below.
  bool is_paper = false;
  /// Least share of the object's points near the model, and largest share of the model's surface in
  /// space that was seen to be free.
  double inlier_share_min = 0.6;
  double free_share_max = 0.05;
  /// What is near, of the inlier share and of the cost that ranks poses.
  double inlier_m = 0.1;
  /// Space counts as free where it is free this far around: a pose that is off by less, at the edge
  /// of what a camera saw past, is not yet contradicted.
  double free_around_m = 0.1;
  double floor_tolerance_m = 0.05;
  /// What a share of surface in free space, and a share of surface explained, weighs against the
  /// share of points that are off the model.
  double free_weight = 1.0;
  double covered_weight = 0.1;
  /// How many poses are aligned roughly, kept, and aligned exactly.
  int start_count = 40;
  int candidate_count = 8;
  int finalist_count = 3;
  /// Around the best poses: something beside the object (a table before a couch) pulls a pose off
  /// by this much, and a tight gate from a start beyond lets go of it.
  int shaken_count = 3;
  double shake_m = 0.1;
  double shake_deg = 8.0;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
