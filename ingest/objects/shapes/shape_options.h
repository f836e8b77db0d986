// SPDX-License-Identifier: Apache-2.0
// How known shapes are fitted: all numbers that decide whether one fits, and where.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

/// Of FindStarts: poses all around, and a first look at each.
struct StartOptions {
  /// Turns about the vertical.
  int turn_count = 36;
  /// Points this near to the model are on it: half a turn of 10 degrees moves the end of a couch by
  /// 9 cm.
  double near_m = 0.2;
  /// Points that are looked at.
  int look_count = 120;
  /// Off the ends of the points' box: what bled over from neighbours.
  double trim_share = 0.03;
  /// Poses this near to each other, in both, are one.
  double same_m = 0.15;
  double same_deg = 15.0;
};

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
  /// As in RSS 2020: corners of the vertices as they are, all pairs of them, six degrees of
  /// freedom, and whatever pose the solver finds.
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
  StartOptions starts;
  /// Of all stages of the alignment: what a distance to a point weighs against the distance to its
  /// plane. It keeps a pose from sliding along a single plane.
  double point_weight = 0.1;
  /// Iterations of a rough alignment, and up to which distance points count, at its beginning and
  /// at its end: from starts, and from those that are kept. No further than the table of nearest
  /// points reaches (ModelIndex).
  int rough_iteration_count = 10;
  double rough_far_m = 0.3;
  double rough_near_m = 0.12;
  double kept_far_m = 0.15;
  double kept_near_m = 0.08;
  /// Of an exact alignment, which begins at `inlier_m`.
  int exact_iteration_count = 15;
  double exact_near_m = 0.07;
  /// Points of an object: with fewer it has no shape, of more so many stand for all.
  int point_count_min = 10;
  int point_count_max = 4000;
  /// So many stand for them in rough alignments, and so many of the model in the test of free
  /// space.
  int rough_point_count = 250;
  int free_point_count = 400;
  /// Distance of the points of a model that distances are taken to.
  double surface_m = 0.025;
  /// Edge of the patches that are counted for the share of the model that is seen.
  double patch_m = 0.1;
  /// With fewer corners, evenly spread points take their place.
  int keypoint_count_min = 12;
  /// Share of points that may be strays below an object whose floor is not known.
  double stray_share = 0.02;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
