// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/loop/wrong_loops.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "ingest/loop/optimize.h"
#include "ingest/loop/twist.h"
#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

Eigen::Quaterniond RandomRotation(bool is_planar, Random* random) {
  if (is_planar) {
    const double angle = random->Uniform(-std::numbers::pi, std::numbers::pi);
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
  }
  Eigen::Vector4d numbers;
  for (int i = 0; i < 4; ++i) numbers(i) = random->Normal();
  return Eigen::Quaterniond(numbers.normalized());
}

Matrix6d MedianInformation(const PoseGraph& graph) {
  std::vector<const RelativePose*> loops;
  for (const RelativePose& edge : graph.edges) {
    if (edge.is_loop) loops.push_back(&edge);
  }
  std::stable_sort(loops.begin(), loops.end(), [](const RelativePose* a, const RelativePose* b) {
    return a->information.trace() < b->information.trace();
  });
  return loops.empty() ? Matrix6d::Identity() : loops[loops.size() / 2]->information;
}

// A measurement with the noise that its information admits to.
Pose3d Noisy(const Pose3d& pose, const RelativePose& edge, bool is_planar, Random* random) {
  const Matrix6d covariance = CovarianceOf(edge, is_planar) + 1e-12 * Matrix6d::Identity();
  Vector6d normal;
  for (int i = 0; i < 6; ++i) normal(i) = random->Normal();
  Vector6d twist = Eigen::LLT<Matrix6d>(covariance).matrixL() * normal;
  if (is_planar) twist.segment<3>(2).setZero();
  const Eigen::Vector3d turn = twist.tail<3>();
  return pose * Pose3d{twist.head<3>(),
                       Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()))};
}

class Spoiler {
 public:
  Spoiler(const PoseGraph& graph, const std::vector<Pose3d>& true_poses, double right_below,
          const WrongLoopOptions& options)
      : spoilt_(graph),
        true_poses_(true_poses),
        right_below_(right_below),
        options_(options),
        random_(options.seed, 77),
        information_(MedianInformation(graph)) {
    for (const Pose3d& pose : true_poses) box_.extend(pose.position);
  }

  PoseGraph Run() {
    const auto loop_count = std::count_if(spoilt_.edges.begin(), spoilt_.edges.end(),
                                          [](const RelativePose& edge) { return edge.is_loop; });
    const double wrong_count =
        std::round(options_.share / (1.0 - options_.share) * static_cast<double>(loop_count));
    const size_t edge_count = spoilt_.edges.size() + static_cast<size_t>(wrong_count);
    while (spoilt_.edges.size() < edge_count) AddGroup(edge_count);
    return std::move(spoilt_);
  }

 private:
  void AddGroup(size_t edge_count) {
    const int pose_count = static_cast<int>(true_poses_.size());
    const int from = random_.Index(pose_count);
    const int to = random_.Index(pose_count);
    if (std::abs(from - to) <= options_.group_size) return;
    Pose3d thought;
    for (int i = 0; i < 3; ++i) {
      thought.position(i) = random_.Uniform(box_.min()(i), box_.max()(i));
    }
    thought.orientation = RandomRotation(spoilt_.is_planar, &random_);
    // Where the second stretch of the trajectory is thought to be, against where it is.
    const Pose3d map_T_wrong = thought * true_poses_[Index(to)].Inverse();
    for (int k = 0; k < options_.group_size && spoilt_.edges.size() < edge_count; ++k) {
      if (from + k >= pose_count || to + k >= pose_count) return;
      RelativePose edge;
      edge.from = from + k;
      edge.to = to + k;
      edge.is_loop = true;
      edge.information = information_;
      edge.from_T_to =
          true_poses_[Index(edge.from)].Inverse() * map_T_wrong * true_poses_[Index(edge.to)];
      if (options_.group_size > 1) {
        edge.from_T_to = Noisy(edge.from_T_to, edge, spoilt_.is_planar, &random_);
      }
      edge.from_T_to.orientation.normalize();
      const double squared = SquaredResidual(edge, spoilt_.is_planar, true_poses_[Index(edge.from)],
                                             true_poses_[Index(edge.to)]);
      if (squared > right_below_) spoilt_.edges.push_back(edge);
    }
  }

  PoseGraph spoilt_;
  const std::vector<Pose3d>& true_poses_;
  double right_below_;
  const WrongLoopOptions& options_;
  Random random_;
  Matrix6d information_;
  Eigen::AlignedBox3d box_;
};

}  // namespace

PoseGraph WithWrongLoops(const PoseGraph& graph, const std::vector<Pose3d>& true_poses,
                         double right_below, const WrongLoopOptions& options) {
  return Spoiler(graph, true_poses, right_below, options).Run();
}

double PositionError(const std::vector<Pose3d>& poses, const std::vector<Pose3d>& true_poses) {
  const Eigen::Index count = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd found(3, count);
  Eigen::Matrix3Xd wanted(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    found.col(i) = poses[static_cast<size_t>(i)].position;
    wanted.col(i) = true_poses[static_cast<size_t>(i)].position;
  }
  const Eigen::Matrix4d alignment = Eigen::umeyama(found, wanted, false);
  const Eigen::Matrix3Xd moved =
      (alignment.topLeftCorner<3, 3>() * found).colwise() + alignment.topRightCorner<3, 1>();
  return std::sqrt((moved - wanted).squaredNorm() / static_cast<double>(count));
}

}  // namespace dsg::ingest
