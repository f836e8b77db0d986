// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/robot_graph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Keyframes that are too many are taken further apart in steps, up to where only loops make them.
constexpr double kKeyframeSpreadStep = 1.5;
constexpr double kKeyframeSpreadMax = 1e6;

// Between samples at either side of an instant.
Pose3d InterpolateAt(const std::vector<TimeNs>& times, const std::vector<Pose3d>& poses,
                     TimeNs time_ns) {
  const auto after = std::upper_bound(times.begin(), times.end(), time_ns);
  if (after == times.begin()) return poses.front();
  if (after == times.end()) return poses.back();
  const auto next = static_cast<size_t>(after - times.begin());
  const double fraction = static_cast<double>(time_ns - times[next - 1]) /
                          static_cast<double>(times[next] - times[next - 1]);
  return Interpolate(poses[next - 1], poses[next], fraction);
}

size_t NearestIndex(const std::vector<TimeNs>& times, TimeNs time_ns) {
  const auto after = std::lower_bound(times.begin(), times.end(), time_ns);
  if (after == times.end()) return times.size() - 1;
  const auto index = static_cast<size_t>(after - times.begin());
  if (index == 0 || *after - time_ns < time_ns - times[index - 1]) return index;
  return index - 1;
}

Covariance6 UpperTriangle(const Matrix6d& matrix) {
  Covariance6 values{};
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      values[next++] = static_cast<float>(matrix(row, column));
    }
  }
  return values;
}

PoseFactor MakeFactor(const std::string& type, TimeNs from_ns, TimeNs to_ns, const Pose3d& relative,
                      const Matrix6d& information) {
  PoseFactor factor;
  factor.type = type;
  factor.from_ns = from_ns;
  factor.to_ns = to_ns;
  factor.relative_pose = relative;
  factor.information = UpperTriangle(information);
  return factor;
}

}  // namespace

TrajectoryChange::TrajectoryChange(std::vector<TimeNs> times, std::vector<Pose3d> new_T_old)
    : times_(std::move(times)), old_T_body_(times_.size()), new_T_body_(std::move(new_T_old)) {
  DSG_CHECK(new_T_body_.size() == times_.size());
  for (const Pose3d& pose : new_T_body_) {
    largest_m_ = std::max(largest_m_, pose.position.norm());
  }
}

TrajectoryChange::TrajectoryChange(std::vector<TimeNs> times, std::vector<Pose3d> old_T_body,
                                   std::vector<Pose3d> new_T_body)
    : times_(std::move(times)),
      old_T_body_(std::move(old_T_body)),
      new_T_body_(std::move(new_T_body)) {
  DSG_CHECK(old_T_body_.size() == times_.size() && new_T_body_.size() == times_.size());
  for (size_t i = 0; i < times_.size(); ++i) {
    const double shift_m = (new_T_body_[i].position - old_T_body_[i].position).norm();
    largest_m_ = std::max(largest_m_, shift_m);
  }
}

Pose3d TrajectoryChange::At(TimeNs time_ns) const {
  if (times_.empty()) return {};
  Pose3d new_T_old = InterpolateAt(times_, new_T_body_, time_ns) *
                     InterpolateAt(times_, old_T_body_, time_ns).Inverse();
  new_T_old.orientation.normalize();
  return new_T_old;
}

// A loop and the two poses that it is to bind.
struct RobotGraph::BoundLoop {
  /// Index in loops_.
  size_t loop = 0;
  /// Indices in poses_.
  size_t from = 0;
  size_t to = 0;
  /// Between those two poses.
  Pose3d from_T_to;
};

RobotGraph::RobotGraph(const RobotGraphOptions& options) : options_(options) {}

void RobotGraph::AddPose(TimeNs time_ns, const Pose3d& map_T_body) {
  if (!times_.empty() && time_ns <= times_.back()) return;
  times_.push_back(time_ns);
  poses_.push_back(map_T_body);
}

void RobotGraph::AddLoop(const LoopClosure& loop) { loops_.push_back(loop); }

Pose3d RobotGraph::PoseAt(TimeNs time_ns) const { return InterpolateAt(times_, poses_, time_ns); }

std::vector<RobotGraph::BoundLoop> RobotGraph::BindLoops() const {
  std::vector<BoundLoop> bound;
  if (times_.empty()) return bound;
  const auto is_inside = [this](TimeNs time_ns) {
    return time_ns >= times_.front() && time_ns <= times_.back();
  };
  for (size_t i = 0; i < loops_.size(); ++i) {
    const LoopClosure& loop = loops_[i];
    if (!is_inside(loop.from_ns) || !is_inside(loop.to_ns)) continue;
    BoundLoop item{i, NearestIndex(times_, loop.from_ns), NearestIndex(times_, loop.to_ns), {}};
    if (item.from == item.to) continue;
    // The robot moved on between the stamps and the poses that stand for them.
    const Pose3d pose_T_from = poses_[item.from].Inverse() * PoseAt(loop.from_ns);
    const Pose3d to_T_pose = PoseAt(loop.to_ns).Inverse() * poses_[item.to];
    item.from_T_to = pose_T_from * loop.from_T_to * to_T_pose;
    item.from_T_to.orientation.normalize();
    bound.push_back(item);
  }
  return bound;
}

std::vector<size_t> RobotGraph::ChooseKeyframes(const std::vector<BoundLoop>& loops,
                                                double spread) const {
  std::vector<size_t> bound;
  for (const BoundLoop& loop : loops) bound.insert(bound.end(), {loop.from, loop.to});
  std::sort(bound.begin(), bound.end());
  std::vector<size_t> keyframes;
  for (size_t i = 0; i < poses_.size(); ++i) {
    bool is_keyframe =
        i == 0 || i + 1 == poses_.size() || std::binary_search(bound.begin(), bound.end(), i);
    if (!is_keyframe) {
      const Pose3d& last = poses_[keyframes.back()];
      is_keyframe =
          (poses_[i].position - last.position).norm() >= spread * options_.keyframe_m ||
          AngleBetween(last.orientation, poses_[i].orientation) >= spread * options_.keyframe_rad ||
          static_cast<double>(times_[i] - times_[keyframes.back()]) >=
              spread * static_cast<double>(options_.keyframe_ns_max);
    }
    if (is_keyframe) keyframes.push_back(i);
  }
  return keyframes;
}

RelativePose RobotGraph::Odometry(size_t from, size_t to) const {
  RelativePose edge;
  edge.from_T_to = poses_[from].Inverse() * poses_[to];
  edge.from_T_to.orientation.normalize();
  const double way_m = edge.from_T_to.position.norm();
  const double turn_rad = AngleBetween(poses_[from].orientation, poses_[to].orientation);
  const double variance_m2 = std::max(std::pow(options_.odometry_m_per_m, 2) * way_m,
                                      std::pow(options_.odometry_m_min, 2));
  const double variance_rad2 = std::max(std::pow(options_.odometry_rad_per_m, 2) * way_m +
                                            std::pow(options_.odometry_rad_per_rad, 2) * turn_rad,
                                        std::pow(options_.odometry_rad_min, 2));
  edge.information.setZero();
  edge.information.diagonal().head<3>().setConstant(1.0 / variance_m2);
  // The turn about the vertical alone drifts; the residual is in the axes of `to`.
  const Eigen::Vector3d up_to = poses_[to].orientation.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d about_up = up_to * up_to.transpose();
  edge.information.bottomRightCorner<3, 3>() =
      about_up / variance_rad2 +
      (Eigen::Matrix3d::Identity() - about_up) / std::pow(options_.odometry_tilt_rad, 2);
  return edge;
}

PoseGraph RobotGraph::MakeGraph(const std::vector<size_t>& keyframes,
                                const std::vector<BoundLoop>& loops) const {
  PoseGraph graph;
  std::map<size_t, int> keyframe_of_pose;
  for (size_t k = 0; k < keyframes.size(); ++k) {
    keyframe_of_pose[keyframes[k]] = static_cast<int>(k);
    graph.ids.push_back(static_cast<int64_t>(k));
    graph.poses.push_back(poses_[keyframes[k]]);
    if (k == 0) continue;
    RelativePose& edge = graph.edges.emplace_back(Odometry(keyframes[k - 1], keyframes[k]));
    edge.from = static_cast<int>(k) - 1;
    edge.to = static_cast<int>(k);
  }
  for (const BoundLoop& loop : loops) {
    RelativePose& edge = graph.edges.emplace_back();
    edge.from = keyframe_of_pose.at(loop.from);
    edge.to = keyframe_of_pose.at(loop.to);
    edge.from_T_to = loop.from_T_to;
    edge.information = loops_[loop.loop].information;
    edge.is_loop = true;
    edge.line = static_cast<int64_t>(loop.loop) + 1;
  }
  return graph;
}

absl::StatusOr<RobotGraph::Solution> RobotGraph::Solve() const {
  Solution solution;
  const std::vector<BoundLoop> loops = BindLoops();
  std::vector<size_t> keyframes = ChooseKeyframes(loops, solution.keyframe_spread);
  while (keyframes.size() > options_.keyframe_count_max &&
         solution.keyframe_spread < kKeyframeSpreadMax) {
    solution.keyframe_spread *= kKeyframeSpreadStep;
    keyframes = ChooseKeyframes(loops, solution.keyframe_spread);
  }
  for (const size_t keyframe : keyframes) solution.keyframe_times.push_back(times_[keyframe]);
  solution.loop_count = static_cast<int64_t>(loops_.size());
  solution.unusable_count = static_cast<int64_t>(loops_.size() - loops.size());
  solution.is_kept.assign(loops_.size(), false);
  if (loops.empty()) return solution;

  const PoseGraph graph = MakeGraph(keyframes, loops);
  RobustOptions robust = options_.robust;
  robust.optimize.fixed_pose = 0;
  robust.optimize.has_covariance = keyframes.size() <= options_.covariance_count_max;
  DSG_ASSIGN_OR_RETURN(const RobustResult result, OptimizeRobustly(graph, robust));
  for (size_t i = 0; i < loops.size(); ++i) {
    const bool is_kept = result.is_kept[keyframes.size() - 1 + i];
    solution.is_kept[loops[i].loop] = is_kept;
    solution.kept_count += is_kept ? 1 : 0;
  }
  for (const Matrix6d& covariance : result.optimized.covariances) {
    solution.covariances.push_back(UpperTriangle(covariance));
  }
  // Without a loop that is believed, odometry stands as it was.
  if (solution.kept_count > 0) {
    solution.change =
        TrajectoryChange(solution.keyframe_times, graph.poses, result.optimized.poses);
  }
  return solution;
}

std::vector<PoseFactor> RobotGraph::Factors(const Solution& solution) const {
  std::vector<PoseFactor> factors;
  for (size_t k = 1; k < solution.keyframe_times.size(); ++k) {
    const size_t from = NearestIndex(times_, solution.keyframe_times[k - 1]);
    const size_t to = NearestIndex(times_, solution.keyframe_times[k]);
    const RelativePose edge = Odometry(from, to);
    factors.push_back(
        MakeFactor("odometry", times_[from], times_[to], edge.from_T_to, edge.information));
  }
  for (const BoundLoop& loop : BindLoops()) {
    const bool is_kept = loop.loop < solution.is_kept.size() && solution.is_kept[loop.loop];
    factors.push_back(MakeFactor(is_kept ? "loop_closure" : "loop_closure_rejected",
                                 times_[loop.from], times_[loop.to], loop.from_T_to,
                                 loops_[loop.loop].information));
  }
  return factors;
}

}  // namespace dsg::ingest
