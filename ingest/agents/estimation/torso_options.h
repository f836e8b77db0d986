// SPDX-License-Identifier: Apache-2.0
// How a torso is believed to move, and how a torso graph is solved: all its numbers.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

enum class TorsoModel {
  /// Zero-velocity links and detection priors in six degrees of freedom, and nothing else.
  /// Source: RSS 2020, section IV-A "Human Nodes".
  kPaper,
  /// White noise on acceleration with velocities that are forgotten, robust priors, an error along
  /// the ray that lasts, and cues where given.
  kSmooth,
};

struct TorsoOptions {
  TorsoModel model = TorsoModel::kSmooth;
  /// Nodes that a live solve moves; those before are held. Its iterations; of the first nodes of a
  /// track, which have no belief yet that a detection could contradict, others.
  int lag_count = 20;
  int live_iteration_count = 2;
  int young_count = 5;
  int young_iteration_count = 8;
  /// Of the zero-velocity link over one second.
  double walk_sigma_m_s = 1.2;
  double turn_sigma_rad_s = 1.05;
  /// Of white noise on acceleration, m / s^1.5.
  double acceleration_sigma = 0.8;
  /// Upright: people hardly leave their floor.
  double vertical_acceleration_sigma = 0.3;
  /// How long a velocity lasts. It limits the motion: the speed is about acceleration_sigma *
  /// sqrt(walk_memory_s), and above 2.5 m / s in four walks of a hundred.
  double walk_memory_s = 3.0;
  double vertical_memory_s = 1.0;
  /// Of the heading's random walk over one second (kSmooth).
  double turn_walk_sigma_rad = 0.6;
  /// The share of a detection's variance along the ray that the next detections share too (body
  /// height, occlusion), and how long it lasts.
  double lasting_share = 0.5;
  double lasting_s = 5.0;
  /// A body's height is no news a second time: what a height cue says is given out over this.
  double height_lasting_s = 20.0;
  /// Scale of Cauchy's loss on priors and cues (kSmooth), in standard deviations; 0 = squares.
  double loss_scale = 2.0;
  /// The same for kPaper. The paper names no loss; 0 is its letter.
  double paper_loss_scale = 0.0;
  /// Of rolling and pitching: kPaper estimates them, kSmooth leaves them as the detection has them.
  double tilt_sigma_rad = 0.1;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
