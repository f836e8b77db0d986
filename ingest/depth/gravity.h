// SPDX-License-Identifier: Apache-2.0
// Which way is up in a log whose poses are in any frame, told by floors and walls.
// Refuses to answer when what the camera saw fits two answers.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/depth/surface_normals.h"
#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

struct GravityOptions {
  /// Of all frames, and of one.
  int normal_count_max = 10'000;
  int frame_normal_count_max = 1'000;
  /// With fewer there is no answer.
  int normal_count_min = 200;
  /// Mean of the images' own ups at least: a camera that was held in all ways has none.
  double mean_up_min = 0.3;
  /// How far up may be from the images' mean up: cameras look down at tables.
  double tilt_rad_max = 75.0 * (M_PI / 180.0);
  /// How far a camera in the hand is turned about its axis, standard deviation.
  double roll_sigma_rad = 12.0 * (M_PI / 180.0);
  /// Normals this near to level or upright count, with less weight towards the limit: while up is
  /// searched for, and while it is refined.
  double search_width_rad = 8.0 * (M_PI / 180.0);
  double refine_width_rad = 5.0 * (M_PI / 180.0);
  /// Doubt: shares of the normals that are level, and that are level or upright.
  double level_share_min = 0.05;
  double explained_share_min = 0.35;
  /// Doubt: another direction, this far off, that does nearly as well.
  double other_rad = 20.0 * (M_PI / 180.0);
  double other_score_max = 0.85;
  NormalOptions normals;

  std::vector<BoundOption> Bind();
};

/// Unit vector that points up, in the frame of the frames' poses (which need not be the map's);
/// nullopt when doubtful.
///
/// Takes for granted that the camera was held upright: up is within `tilt_rad_max` of the images'
/// mean up, and the images' rows are about level. Of the directions left, up is the one that most
/// surfaces are level or upright to, refined by least squares over those surfaces.
/// Cost: about 40 ms for any number of frames; a dozen frames that look around are enough.
/// Errors: nullopt also when nothing level was seen, or hardly any flat surface.
std::optional<Eigen::Vector3d> EstimateUp(const std::vector<DepthFrame>& frames,
                                          const GravityOptions& options = {});

}  // namespace dsg::ingest
