// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/robot_graph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "ingest/loop/chi_square.h"
#include "ingest/loop/repeated_loops.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Keyframes that are too many are taken further apart in steps, up to where only loops make them.
// No options: they say how the limit is come near to, not what it is.
constexpr double kKeyframeSpreadStep = 1.5;
constexpr double kKeyframeSpreadMax = 1e6;

constexpr OptionField<RobotGraphOptions> kGraphFields[] = {
    {"loop-keyframe", &RobotGraphOptions::keyframe_m, 0.01, 100.0,
     "A keyframe is taken after so much way, metres: the path bends by less in between"},
    {"loop-keyframe-turn", &RobotGraphOptions::keyframe_rad, 0.01, 3.2,
     "... or turn, radians: 20 degrees"},
    {"loop-keyframe-time", &RobotGraphOptions::keyframe_ns_max, 0.01, 3600.0,
     "... or time, seconds: a robot that stands still drifts little"},
    {"loop-keyframes", &RobotGraphOptions::keyframe_count_max, 2, 1'000'000,
     "A log of more keyframes takes them further apart, at the same rate everywhere: the path of "
     "so many is solved in seconds"},
    {"loop-covariances", &RobotGraphOptions::covariance_count_max, 0,
     static_cast<double>(kCovariancePosesMax),
     "Poses of a path of more keyframes have no covariances from loop closures: memory"},
    {"loop-odometry-turn", &RobotGraphOptions::odometry_rad_per_rad, 1e-5, 1.0,
     "How far off the heading is after a turn of one radian, radians: of wheels and cheap gyros"},
    {"loop-odometry-min", &RobotGraphOptions::odometry_m_min, 1e-5, 1.0,
     "How far off the robot is after a keyframe at least, metres: noise of a pose"},
    {"loop-odometry-turn-min", &RobotGraphOptions::odometry_rad_min, 1e-6, 1.0,
     "The same of its heading, radians: a twentieth of a degree"},
    {"loop-odometry-tilt", &RobotGraphOptions::odometry_tilt_rad, 1e-6, 1.0,
     "How far off roll and pitch are after a keyframe, radians: an inertial unit sees gravity, and "
     "a map that loops tilt is worse than a turned one"},
    {"loop-correct-period", &RobotGraphOptions::correct_period_ns, 0.0, 86400.0,
     "Least log time between two corrections of the path, seconds: each is solved anew"},
    {"loop-correct-share", &RobotGraphOptions::correct_share, 0.0, 1.0,
     "Least share of the log so far between two corrections: each writes track and mesh anew, "
     "twenty times their size in all"},
    {"loop-correct-move", &RobotGraphOptions::correct_min_m, 0.0, 100.0,
     "Corrections that move the path by less wait for the end of the log, metres: a voxel"},
    {"loop-correct-loops", &RobotGraphOptions::correct_loop_count_max, 0, 1e6,
     "With more loop closures the path is corrected at the end of the log only: each is compared "
     "with each"},
};

constexpr OptionField<OptimizeOptions> kOptimizeFields[] = {
    {"loop-iterations", &OptimizeOptions::iteration_count_max, 1, 100'000,
     "Steps of each solution of the path at most: few take more than ten"},
};

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

std::vector<BoundOption> RobotGraphOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<RobotGraphOptions>(kGraphFields, this, &bound);
  BindFields<OptimizeOptions>(kOptimizeFields, &robust.optimize, &bound);
  const std::vector<BoundOption> robust_bound = robust.Bind();
  bound.insert(bound.end(), robust_bound.begin(), robust_bound.end());
  return bound;
}

// A loop and the two poses that it is to bind.
struct RobotGraph::BoundLoop {
  /// Index in loops_.
  size_t loop = 0;
  /// Indices of poses of the path.
  size_t from = 0;
  size_t to = 0;
  /// Between those two poses.
  Pose3d from_T_to;
};

RobotGraph::RobotGraph(const RobotGraphOptions& options, const RobotPath& path)
    : options_(options), path_(path) {}

void RobotGraph::AddLoop(const LoopClosure& loop) { loops_.push_back(loop); }

Pose3d RobotGraph::Given(size_t index) const { return path_.poses()[index].map_T_agent; }
TimeNs RobotGraph::TimeOf(size_t index) const { return path_.poses()[index].time_ns; }

std::vector<RobotGraph::BoundLoop> RobotGraph::BindLoops() const {
  std::vector<BoundLoop> bound;
  const PoseList& poses = path_.poses();
  if (poses.empty()) return bound;
  const auto is_inside = [&poses](TimeNs time_ns) {
    return time_ns >= poses.front().time_ns && time_ns <= poses.back().time_ns;
  };
  for (size_t i = 0; i < loops_.size(); ++i) {
    const LoopClosure& loop = loops_[i];
    if (!is_inside(loop.from_ns) || !is_inside(loop.to_ns)) continue;
    BoundLoop item{i, path_.NearestIndex(loop.from_ns), path_.NearestIndex(loop.to_ns), {}};
    if (item.from == item.to) continue;
    // The robot moved on between the stamps and the poses that stand for them.
    const Pose3d pose_T_from = Given(item.from).Inverse() * path_.GivenNear(loop.from_ns);
    const Pose3d to_T_pose = path_.GivenNear(loop.to_ns).Inverse() * Given(item.to);
    item.from_T_to = pose_T_from * loop.from_T_to * to_T_pose;
    item.from_T_to.orientation.normalize();
    bound.push_back(item);
  }
  return bound;
}

std::vector<RobotGraph::BoundLoop> RobotGraph::WithoutRepeated(
    const std::vector<BoundLoop>& bound, std::vector<bool>* is_repeated) const {
  std::vector<RelativePose> measured;
  for (const BoundLoop& loop : bound) {
    RelativePose& edge = measured.emplace_back();
    edge.from = static_cast<int>(loop.from);
    edge.to = static_cast<int>(loop.to);
    edge.from_T_to = loop.from_T_to;
    edge.information = loops_[loop.loop].information;
  }
  const std::vector<bool> is_told =
      FindRepeated(measured, ChiSquareGate(options_.robust.confidence, /*is_planar=*/false));
  is_repeated->assign(loops_.size(), false);
  std::vector<BoundLoop> distinct;
  for (size_t i = 0; i < bound.size(); ++i) {
    (*is_repeated)[bound[i].loop] = is_told[i];
    if (!is_told[i]) distinct.push_back(bound[i]);
  }
  return distinct;
}

std::vector<size_t> RobotGraph::ChooseKeyframes(const std::vector<BoundLoop>& loops,
                                                double spread) const {
  std::vector<size_t> bound;
  for (const BoundLoop& loop : loops) bound.insert(bound.end(), {loop.from, loop.to});
  std::sort(bound.begin(), bound.end());
  std::vector<size_t> keyframes;
  for (size_t i = 0; i < path_.poses().size(); ++i) {
    bool is_keyframe = i == 0 || i + 1 == path_.poses().size() ||
                       std::binary_search(bound.begin(), bound.end(), i);
    if (!is_keyframe) {
      const Pose3d& last = Given(keyframes.back());
      is_keyframe =
          (Given(i).position - last.position).norm() >= spread * options_.keyframe_m ||
          AngleBetween(last.orientation, Given(i).orientation) >= spread * options_.keyframe_rad ||
          static_cast<double>(TimeOf(i) - TimeOf(keyframes.back())) >=
              spread * static_cast<double>(options_.keyframe_ns_max);
    }
    if (is_keyframe) keyframes.push_back(i);
  }
  return keyframes;
}

// How much of the way, turn or time that makes a keyframe lies between two: 1 of those that are
// taken by the options. Loop closures make keyframes of their ends; what odometry may err at least
// is divided among them, or loops that are not believed would loosen it.
double RobotGraph::ShareOfAStep(double way_m, double turn_rad, TimeNs time_ns) const {
  // Numerical, no option: odometry of no way at all would be certain.
  constexpr double kShareMin = 1e-4;
  const double share =
      std::max({way_m / options_.keyframe_m, turn_rad / options_.keyframe_rad,
                static_cast<double>(time_ns) / static_cast<double>(options_.keyframe_ns_max)});
  return std::clamp(share, kShareMin, 1.0);
}

RelativePose RobotGraph::Odometry(size_t from, size_t to) const {
  RelativePose edge;
  edge.from_T_to = Given(from).Inverse() * Given(to);
  edge.from_T_to.orientation.normalize();
  const double way_m = edge.from_T_to.position.norm();
  const double turn_rad = AngleBetween(Given(from).orientation, Given(to).orientation);
  const double share = ShareOfAStep(way_m, turn_rad, TimeOf(to) - TimeOf(from));
  const double variance_m2 = std::max(std::pow(options_.odometry_m_per_m, 2) * way_m,
                                      std::pow(options_.odometry_m_min, 2) * share);
  const double variance_rad2 = std::max(std::pow(options_.odometry_rad_per_m, 2) * way_m +
                                            std::pow(options_.odometry_rad_per_rad, 2) * turn_rad,
                                        std::pow(options_.odometry_rad_min, 2) * share);
  edge.information.setZero();
  edge.information.diagonal().head<3>().setConstant(1.0 / variance_m2);
  // The turn about the vertical alone drifts; the residual is in the axes of `to`.
  const Eigen::Vector3d up_to = Given(to).orientation.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d about_up = up_to * up_to.transpose();
  edge.information.bottomRightCorner<3, 3>() =
      about_up / variance_rad2 +
      (Eigen::Matrix3d::Identity() - about_up) / (std::pow(options_.odometry_tilt_rad, 2) * share);
  return edge;
}

PoseGraph RobotGraph::MakeGraph(const std::vector<size_t>& keyframes,
                                const std::vector<BoundLoop>& loops) const {
  PoseGraph graph;
  std::map<size_t, int> keyframe_of_pose;
  for (size_t k = 0; k < keyframes.size(); ++k) {
    keyframe_of_pose[keyframes[k]] = static_cast<int>(k);
    graph.ids.push_back(static_cast<int64_t>(k));
    graph.poses.push_back(Given(keyframes[k]));
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

absl::StatusOr<RobotGraph::Solution> RobotGraph::Solve(bool has_covariances) const {
  Solution solution;
  const std::vector<BoundLoop> bound = BindLoops();
  solution.loop_count = std::ssize(loops_);
  solution.unusable_count = std::ssize(loops_) - std::ssize(bound);
  const std::vector<BoundLoop> loops = WithoutRepeated(bound, &solution.is_repeated);
  solution.repeated_count = std::ssize(loops_) - solution.unusable_count - std::ssize(loops);
  std::vector<size_t> keyframes = ChooseKeyframes(loops, solution.keyframe_spread);
  while (keyframes.size() > static_cast<size_t>(options_.keyframe_count_max) &&
         solution.keyframe_spread < kKeyframeSpreadMax) {
    solution.keyframe_spread *= kKeyframeSpreadStep;
    keyframes = ChooseKeyframes(loops, solution.keyframe_spread);
  }
  for (const size_t keyframe : keyframes) solution.keyframe_times.push_back(TimeOf(keyframe));
  solution.is_kept.assign(loops_.size(), false);
  if (loops.empty()) return solution;

  const PoseGraph graph = MakeGraph(keyframes, loops);
  RobustOptions robust = options_.robust;
  robust.optimize.fixed_pose = 0;
  robust.optimize.has_covariance =
      has_covariances && keyframes.size() <= static_cast<size_t>(options_.covariance_count_max);
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
    const size_t from = path_.NearestIndex(solution.keyframe_times[k - 1]);
    const size_t to = path_.NearestIndex(solution.keyframe_times[k]);
    const RelativePose edge = Odometry(from, to);
    factors.push_back(
        MakeFactor("odometry", TimeOf(from), TimeOf(to), edge.from_T_to, edge.information));
  }
  std::vector<bool> is_repeated;
  for (const BoundLoop& loop : WithoutRepeated(BindLoops(), &is_repeated)) {
    const bool is_kept = loop.loop < solution.is_kept.size() && solution.is_kept[loop.loop];
    factors.push_back(MakeFactor(is_kept ? "loop_closure" : "loop_closure_rejected",
                                 TimeOf(loop.from), TimeOf(loop.to), loop.from_T_to,
                                 loops_[loop.loop].information));
  }
  return factors;
}

}  // namespace dsg::ingest
