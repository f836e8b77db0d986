// SPDX-License-Identifier: Apache-2.0
// The places that people may be on their way to. What draws people comes as points with weights;
// maps stay unknown.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "query/prediction/goal_prediction.h"

namespace dsg::query {

/// Something that people walk to: a door, a chair, a way out.
struct Attraction {
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  /// Against that of others; the number of times people were seen there is a good one.
  double prior = 1.0;
};

struct GoalChoiceOptions {
  /// An attraction without a place that near draws nobody.
  double reach_m = 1.5;
  /// Goals of one prior are no nearer to each other; the first one stands for both.
  double apart_m = 2.0;
  /// Anywhere else: one goal in each square of this size that has places and no other goal.
  double anywhere_m = 2.0;
  /// What anywhere is worth; 0 = nobody goes there.
  double anywhere_prior = 0.5;
};

/// A goal, and what it was made of.
struct ChosenGoal {
  Goal goal;
  /// Index of the attraction; -1 = anywhere.
  int attraction = -1;
};

/// In the order of the attractions, then of the places. The nearest place of the storey stands for
/// an attraction, distances are horizontal.
/// Errors: what `stop` returned. Cost: places + attractions * (places and goals around each).
absl::StatusOr<std::vector<ChosenGoal>> ChooseGoals(const WalkGraph& graph,
                                                    const std::vector<Attraction>& attractions,
                                                    const GoalChoiceOptions& options,
                                                    const StopCheck& stop);

/// The same without an end before it is done.
std::vector<ChosenGoal> ChooseGoals(const WalkGraph& graph,
                                    const std::vector<Attraction>& attractions,
                                    const GoalChoiceOptions& options);

/// Whether people sit at or use things of this class: "chair", "office chair", "Sink". The last
/// word of a name decides.
bool DrawsPeople(std::string_view class_name);

}  // namespace dsg::query
