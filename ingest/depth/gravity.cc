// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/gravity.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "ingest/depth/surface_normals.h"

namespace dsg::ingest {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr int kNormalCountMax = 10'000;
constexpr int kNormalsPerFrameMax = 1'000;
constexpr size_t kNormalCountMin = 200;
// How far up may be from the images' mean up: cameras look down at tables.
constexpr double kTiltMax = 75.0 * kDegree;
// How far a camera in the hand is turned about its axis, standard deviation.
constexpr double kRollSigma = 12.0 * kDegree;
constexpr double kSearchStep = 3.0 * kDegree;
// Normals this near to level or upright count, with less weight towards the limit.
constexpr double kSearchWidth = 8.0 * kDegree;
constexpr double kRefineWidth = 5.0 * kDegree;
// Doubt: shares of the normals that are level, and that are level or upright.
constexpr double kLevelShareMin = 0.05;
constexpr double kExplainedShareMin = 0.35;
// Doubt: another direction, this far off, that does nearly as well.
constexpr double kOtherAngle = 20.0 * kDegree;
constexpr double kOtherScoreMax = 0.85;

struct Evidence {
  std::vector<Eigen::Vector3d> normals;
  /// Up and right of each image.
  std::vector<Eigen::Vector3d> ups;
  std::vector<Eigen::Vector3d> rights;
};

Evidence Gather(const std::vector<DepthFrame>& frames) {
  Evidence evidence;
  const int per_frame = std::min(
      kNormalsPerFrameMax, kNormalCountMax / std::max(1, static_cast<int>(frames.size())) + 1);
  for (const DepthFrame& frame : frames) {
    const Eigen::Matrix3d map_R = frame.map_T_camera.orientation.toRotationMatrix();
    evidence.ups.emplace_back(-map_R.col(1));
    evidence.rights.emplace_back(map_R.col(0));
    const std::vector<Eigen::Vector3d> normals = SurfaceNormals(frame, per_frame);
    evidence.normals.insert(evidence.normals.end(), normals.begin(), normals.end());
  }
  return evidence;
}

// 1 for a sine of 0, falling to 0 at the sine of `width`. Takes the sine's square.
double Near(double sine_squared, double width) {
  const double limit = std::sin(width) * std::sin(width);
  return sine_squared < limit ? 1.0 - sine_squared / limit : 0.0;
}

double SquaredCosine(const Eigen::Vector3d& up, const Eigen::Vector3d& normal) {
  const double cosine = up.dot(normal);
  return std::min(1.0, cosine * cosine);
}

struct Score {
  /// Shares of all normals.
  double level = 0.0;
  double upright = 0.0;
  /// How likely the images' rows are so tilted.
  double roll = 0.0;

  // A level surface tells two angles and chance hits one of 200; an upright one tells one angle
  // and chance hits one of 10. The root keeps a bare wall from outvoting the floor beside it.
  double Total() const { return std::sqrt(level) * (0.2 + level + upright) * roll; }
};

Score ScoreOf(const Evidence& evidence, const Eigen::Vector3d& up) {
  Score score;
  for (const Eigen::Vector3d& normal : evidence.normals) {
    const double squared = SquaredCosine(up, normal);
    score.level += Near(1.0 - squared, kSearchWidth);
    score.upright += Near(squared, kSearchWidth);
  }
  score.level /= static_cast<double>(evidence.normals.size());
  score.upright /= static_cast<double>(evidence.normals.size());
  double squares = 0.0;
  for (const Eigen::Vector3d& right : evidence.rights) squares += std::pow(up.dot(right), 2);
  squares /= static_cast<double>(evidence.rights.size());
  score.roll = std::exp(-0.5 * squares / (kRollSigma * kRollSigma));
  return score;
}

struct Candidate {
  Eigen::Vector3d up;
  Score score;
};

// Directions on circles around `middle`, about a step apart.
std::vector<Candidate> Search(const Evidence& evidence, const Eigen::Vector3d& middle) {
  const Eigen::Vector3d x = middle.unitOrthogonal();
  const Eigen::Vector3d y = middle.cross(x);
  std::vector<Candidate> candidates;
  for (double tilt = 0.0; tilt <= kTiltMax; tilt += kSearchStep) {
    const int count = std::max(1, static_cast<int>(2.0 * M_PI * std::sin(tilt) / kSearchStep));
    for (int i = 0; i < count; ++i) {
      const double turn = 2.0 * M_PI * i / count;
      const Eigen::Vector3d up =
          std::cos(tilt) * middle + std::sin(tilt) * (std::cos(turn) * x + std::sin(turn) * y);
      candidates.push_back({up, ScoreOf(evidence, up)});
    }
  }
  return candidates;
}

// Least squares: level normals along up, upright ones across.
Eigen::Vector3d Refine(const Evidence& evidence, Eigen::Vector3d up) {
  for (const double width : {2.0 * kRefineWidth, kRefineWidth, kRefineWidth, kRefineWidth}) {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& normal : evidence.normals) {
      const double squared = SquaredCosine(up, normal);
      const double weight = Near(1.0 - squared, width) - Near(squared, width);
      squares += weight * normal * normal.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares);
    const Eigen::Vector3d axis = solver.eigenvectors().col(2);
    up = axis.dot(up) < 0.0 ? Eigen::Vector3d(-axis) : axis;
  }
  return up;
}

}  // namespace

std::optional<Eigen::Vector3d> EstimateUp(const std::vector<DepthFrame>& frames) {
  const Evidence evidence = Gather(frames);
  if (evidence.normals.size() < kNormalCountMin) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& up : evidence.ups) middle += up;
  if (middle.norm() < 0.3 * static_cast<double>(frames.size())) return std::nullopt;
  const std::vector<Candidate> candidates = Search(evidence, middle.normalized());
  const auto best = std::max_element(
      candidates.begin(), candidates.end(),
      [](const Candidate& a, const Candidate& b) { return a.score.Total() < b.score.Total(); });
  const Eigen::Vector3d up = Refine(evidence, best->up);
  const Score score = ScoreOf(evidence, up);
  if (score.level < kLevelShareMin || score.level + score.upright < kExplainedShareMin) {
    return std::nullopt;
  }
  for (const Candidate& other : candidates) {
    const bool is_other = std::acos(std::clamp(other.up.dot(up), -1.0, 1.0)) > kOtherAngle;
    if (is_other && other.score.Total() > kOtherScoreMax * score.Total()) return std::nullopt;
  }
  return up;
}

}  // namespace dsg::ingest
