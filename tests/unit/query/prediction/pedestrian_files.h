// SPDX-License-Identifier: Apache-2.0
// Recorded pedestrians as tables of frames, and the windows that predictions are scored on.
// Refuses to repair: a row that is no row ends the test that reads it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "query/prediction/goal_prediction.h"

namespace dsg::query {

/// Positions on the ground in metres, by person, then by frame number.
using Pedestrians = std::map<int64_t, std::map<int64_t, Eigen::Vector2d>>;

/// One row a position, numbers parted by blanks; the columns are counted from 0. Empty when the
/// file is missing.
Pedestrians ReadPedestrians(const std::string& file, int x_column, int y_column);

/// Steps that are seen and steps that are to be predicted, 0.4 s each.
inline constexpr int kSeenCount = 8;
inline constexpr int kPredictedCount = 12;

/// Mean and last error over windows, metres.
struct WindowScore {
  double ade_m = 0.0;
  double fde_m = 0.0;
  int window_count = 0;
};

/// From eight seen points to twelve instants.
using Predictor =
    std::function<PredictedPath(const std::vector<PathPoint>&, const std::vector<TimeNs>&)>;

/// Constant velocity of the last step.
Predictor LastStep();
/// Steps weighted by 0.4^age, the velocity shrinks to 0.98 of itself each 0.4 s.
Predictor Weighted();
/// What PredictAgent calls WEIGHTED_VELOCITY.
Predictor Adaptive(const WeightedVelocityOptions& options);

/// Over every run of 20 frames of one person that are each `frame_step` after the one before.
/// Scores add up: those of several files are one table.
void ScoreWindows(const Pedestrians& pedestrians, int64_t frame_step, const Predictor& predictor,
                  WindowScore* score);

/// From sums to means.
WindowScore Means(const WindowScore& sums);

/// Positions at multiples of `step`, linear between a person's rows, from the multiple nearest to
/// the first row to the one nearest to the last (drawn on there), to the centimetre. So came the
/// literature's file of the ETH scene to be: the rule gives its 5492 rows.
Pedestrians Resample(const Pedestrians& pedestrians, int64_t step);

}  // namespace dsg::query
