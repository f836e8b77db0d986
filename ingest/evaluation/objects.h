// SPDX-License-Identifier: Apache-2.0
// Whether objects were found, how far from where they are, and CAD models how well turned.
// Refuses to match across classes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::evaluation {

struct TrueObject {
  std::string class_name;
  Pose3d map_T_object;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// Where else it stood, having been carried there.
  std::vector<Pose3d> later_map_T_object;
  bool has_cad = false;
  int symmetry_order = 1;
  double observed = 1.0;
};

struct EstimatedObject {
  std::string class_name;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  /// Empty when it has no extent.
  Box3d box_map;
  /// The CAD model's pose, origin in the middle of the model's floor face.
  std::optional<Pose3d> map_T_model;
  /// When it was there, as the map says.
  Interval valid{};
};

struct ObjectOptions {
  double gate_m = 1.0;
  /// True objects that were seen less are neither asked for nor held against whoever found them.
  double observed_min = 0.3;
  /// Slack of boxes when merges and splits are looked for.
  double box_slack_m = 0.1;
};

/// Of one kind of object. Units: metres, degrees; shares from 0 to 1.
struct ObjectScore {
  std::optional<double> mean_error_m;
  /// The same without a gate: as many pairs of a class as there can be, however far apart; and the
  /// share of the true objects that then have one.
  std::optional<double> mean_ungated_m;
  std::optional<double> found_ratio_ungated;
  /// Known shapes only; modulo the object's symmetry.
  std::optional<double> mean_yaw_deg;
  std::optional<double> found_ratio;
  std::optional<double> precision;
  std::optional<double> f1;
  int64_t truth_count = 0;
  int64_t estimate_count = 0;
  int64_t match_count = 0;
};

struct ObjectResult {
  /// True objects without a CAD model against nodes without one. Error: of the centre.
  ObjectScore unknown;
  /// True objects with a CAD model against nodes with one. Error: of the centre of the true box and
  /// that of the model there.
  ObjectScore known;
  /// Share of the asked-for objects that are unmatched and lie in a node matched to another one of
  /// their class; share of the matched ones that hold another, unmatched node of their class.
  std::optional<double> merge_rate;
  std::optional<double> split_rate;
  /// For each estimated object its true one, -1 = none.
  std::vector<int> truth_of;
};

/// For each estimate its true object of the same class, as many pairs within the gate as possible
/// and then the least total distance; every true object takes part, seen or not.
std::vector<int> MatchObjects(const std::vector<EstimatedObject>& estimate,
                              const std::vector<TrueObject>& truth, double gate_m);

/// Source: Rosinol et al. 2020, Table III.
ObjectResult EvaluateObjects(const std::vector<EstimatedObject>& estimate,
                             const std::vector<TrueObject>& truth, const ObjectOptions& options);

}  // namespace dsg::evaluation
