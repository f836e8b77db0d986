// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/objects.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "ingest/evaluation/rigid_fit.h"
#include "schema/matching/assignment.h"

namespace dsg::evaluation {
namespace {

// Where the object stood when it was nearest to `point`.
Pose3d NearestPose(const TrueObject& object, const Eigen::Vector3d& point) {
  Pose3d best = object.map_T_object;
  for (const Pose3d& later : object.later_map_T_object) {
    if ((later.position - point).norm() < (best.position - point).norm()) best = later;
  }
  return best;
}

double DistanceTo(const TrueObject& object, const Eigen::Vector3d& point) {
  return (NearestPose(object, point).position - point).norm();
}

double YawOf(const Eigen::Quaterniond& q) {
  const Eigen::Vector3d x = q * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

// 0 to half the angle after which the object looks the same.
double YawError(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b, int symmetry_order) {
  return std::abs(std::remainder(YawOf(a) - YawOf(b), 2.0 * M_PI / symmetry_order));
}

/// Sums of one kind.
struct Sums {
  double error_m = 0.0;
  double yaw_rad = 0.0;
  int64_t truth_count = 0;
  int64_t estimate_count = 0;
  int64_t match_count = 0;
};

void AddKnownMatch(const TrueObject& object, const Pose3d& map_T_model, Sums* sums) {
  const Pose3d pose = NearestPose(object, map_T_model.position);
  const Eigen::Vector3d center = map_T_model * Eigen::Vector3d(0.0, 0.0, 0.5 * object.size.z());
  sums->error_m += (center - pose.position).norm();
  sums->yaw_rad += YawError(map_T_model.orientation, pose.orientation, object.symmetry_order);
  ++sums->match_count;
}

ObjectScore ScoreOf(const Sums& sums, bool is_known) {
  ObjectScore score;
  score.truth_count = sums.truth_count;
  score.estimate_count = sums.estimate_count;
  score.match_count = sums.match_count;
  const auto matches = static_cast<double>(sums.match_count);
  if (sums.match_count > 0) {
    score.mean_error_m = sums.error_m / matches;
    if (is_known) score.mean_yaw_deg = kDegreesPerRadian * sums.yaw_rad / matches;
  }
  if (sums.truth_count > 0) {
    score.found_ratio = matches / static_cast<double>(sums.truth_count);
    score.f1 = 2.0 * matches / static_cast<double>(sums.truth_count + sums.estimate_count);
  }
  if (sums.estimate_count > 0) {
    score.precision = matches / static_cast<double>(sums.estimate_count);
  }
  return score;
}

// A second node where a carried object stood before or after, or one of an object that was hardly
// seen: not asked for, not wrong.
bool IsExcused(const EstimatedObject& node, const std::vector<TrueObject>& truth,
               const ObjectOptions& options) {
  return std::any_of(truth.begin(), truth.end(), [&](const TrueObject& object) {
    const bool is_open =
        object.observed < options.observed_min || !object.later_map_T_object.empty();
    return is_open && object.class_name == node.class_name &&
           DistanceTo(object, node.position_map) <= options.gate_m;
  });
}

void AddEstimates(const std::vector<EstimatedObject>& estimate,
                  const std::vector<TrueObject>& truth, const ObjectOptions& options,
                  const std::vector<int>& truth_of, Sums* unknown, Sums* known) {
  for (size_t i = 0; i < estimate.size(); ++i) {
    const EstimatedObject& node = estimate[i];
    Sums* sums = node.map_T_model.has_value() ? known : unknown;
    if (truth_of[i] < 0) {
      if (!IsExcused(node, truth, options)) ++sums->estimate_count;
      continue;
    }
    const TrueObject& object = truth[static_cast<size_t>(truth_of[i])];
    if (object.observed < options.observed_min) continue;
    // A couch found without its model is no match of either kind, but no ghost either.
    if (object.has_cad && !node.map_T_model.has_value()) continue;
    ++sums->estimate_count;
    if (!object.has_cad && node.map_T_model.has_value()) continue;
    if (object.has_cad) {
      AddKnownMatch(object, *node.map_T_model, known);
    } else {
      unknown->error_m += DistanceTo(object, node.position_map);
      ++unknown->match_count;
    }
  }
}

// Further apart than any two things of a map.
constexpr double kNoGateM = 1e6;

void AddUngated(const std::vector<EstimatedObject>& estimate, const std::vector<TrueObject>& truth,
                ObjectOptions options, ObjectScore* unknown_score, ObjectScore* known_score) {
  options.gate_m = kNoGateM;
  Sums unknown;
  Sums known;
  AddEstimates(estimate, truth, options, MatchObjects(estimate, truth, options.gate_m), &unknown,
               &known);
  unknown.truth_count = unknown_score->truth_count;
  known.truth_count = known_score->truth_count;
  for (const auto& [sums, score] : {std::pair(unknown, unknown_score), {known, known_score}}) {
    const ObjectScore ungated = ScoreOf(sums, /*is_known=*/false);
    score->mean_ungated_m = ungated.mean_error_m;
    score->found_ratio_ungated = ungated.found_ratio;
  }
}

bool Holds(const Box3d& box, const Eigen::Vector3d& point, double slack_m) {
  return !box.isEmpty() && DistanceToBox(point, box) <= slack_m;
}

void CountMergesAndSplits(const std::vector<EstimatedObject>& estimate,
                          const std::vector<TrueObject>& truth, const ObjectOptions& options,
                          ObjectResult* result) {
  std::vector<bool> is_matched(truth.size(), false);
  for (const int match : result->truth_of) {
    if (match >= 0) is_matched[static_cast<size_t>(match)] = true;
  }
  int64_t asked = 0, matched = 0, merged = 0, split = 0;
  for (size_t t = 0; t < truth.size(); ++t) {
    const TrueObject& object = truth[t];
    if (object.observed < options.observed_min) continue;
    const Box3d true_box =
        TransformBox(object.map_T_object, Box3d(-0.5 * object.size, 0.5 * object.size));
    bool is_merged = false;
    bool is_split = false;
    for (size_t i = 0; i < estimate.size(); ++i) {
      if (estimate[i].class_name != object.class_name) continue;
      is_merged |= result->truth_of[i] >= 0 &&
                   Holds(estimate[i].box_map, object.map_T_object.position, options.box_slack_m);
      is_split |=
          result->truth_of[i] < 0 && Holds(true_box, estimate[i].position_map, options.box_slack_m);
    }
    ++asked;
    matched += is_matched[t] ? 1 : 0;
    merged += !is_matched[t] && is_merged ? 1 : 0;
    split += is_matched[t] && is_split ? 1 : 0;
  }
  if (asked > 0) result->merge_rate = static_cast<double>(merged) / static_cast<double>(asked);
  if (matched > 0) result->split_rate = static_cast<double>(split) / static_cast<double>(matched);
}

}  // namespace

std::vector<int> MatchObjects(const std::vector<EstimatedObject>& estimate,
                              const std::vector<TrueObject>& truth, double gate_m) {
  std::map<std::string, std::pair<std::vector<size_t>, std::vector<size_t>>> classes;
  for (size_t i = 0; i < estimate.size(); ++i) classes[estimate[i].class_name].first.push_back(i);
  for (size_t i = 0; i < truth.size(); ++i) classes[truth[i].class_name].second.push_back(i);
  std::vector<int> truth_of(estimate.size(), -1);
  for (const auto& [name, members] : classes) {
    const auto& [nodes, objects] = members;
    Eigen::MatrixXd cost(static_cast<Eigen::Index>(nodes.size()),
                         static_cast<Eigen::Index>(objects.size()));
    for (Eigen::Index i = 0; i < cost.rows(); ++i) {
      for (Eigen::Index j = 0; j < cost.cols(); ++j) {
        cost(i, j) = DistanceTo(truth[objects[static_cast<size_t>(j)]],
                                estimate[nodes[static_cast<size_t>(i)]].position_map);
      }
    }
    const std::vector<int> assigned = GatedAssignment(cost, gate_m);
    for (size_t i = 0; i < assigned.size(); ++i) {
      if (assigned[i] >= 0) {
        truth_of[nodes[i]] = static_cast<int>(objects[static_cast<size_t>(assigned[i])]);
      }
    }
  }
  return truth_of;
}

ObjectResult EvaluateObjects(const std::vector<EstimatedObject>& estimate,
                             const std::vector<TrueObject>& truth, const ObjectOptions& options) {
  ObjectResult result;
  result.truth_of.assign(estimate.size(), -1);
  if (estimate.empty()) return result;
  result.truth_of = MatchObjects(estimate, truth, options.gate_m);
  Sums unknown;
  Sums known;
  for (const TrueObject& object : truth) {
    if (object.observed < options.observed_min) continue;
    ++(object.has_cad ? known : unknown).truth_count;
  }
  AddEstimates(estimate, truth, options, result.truth_of, &unknown, &known);
  const bool has_models =
      std::any_of(estimate.begin(), estimate.end(),
                  [](const EstimatedObject& node) { return node.map_T_model.has_value(); });
  result.unknown = ScoreOf(unknown, /*is_known=*/false);
  // Not one model: nobody tried to fit any.
  if (has_models) result.known = ScoreOf(known, /*is_known=*/true);
  AddUngated(estimate, truth, options, &result.unknown, &result.known);
  CountMergesAndSplits(estimate, truth, options, &result);
  return result;
}

}  // namespace dsg::evaluation
