// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/torso_terms.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace dsg::ingest {
namespace {

using WalkMatrix = Eigen::Matrix<double, kSmoothStateCount, kSmoothStateCount>;
using WalkTerm = ChainTerm<kSmoothStateCount>;

constexpr int kVelocity = 3;
constexpr int kLasting = 6;
// Keeps a chain solvable that nothing ties to the map; far below any detection.
constexpr double kWeakInformation = 1e-8;
constexpr double kRayLengthMinM = 0.1;
// A belief further off the detection's ray says nothing of the ray.
constexpr double kRayCosineMin = 0.9;
// Of a position; a matrix nearer to singular comes from broken input.
constexpr double kVarianceMinM2 = 1e-10;
constexpr double kVarianceMaxM2 = 1e8;
// Beyond any map; squares of what is beyond would overflow in the end.
constexpr double kPositionMaxM = 1e7;
constexpr double kInformationMax = 1e10;
constexpr double kHeadingSigmaMinRad = 1e-4;
// Something has to be left for the detection itself.
constexpr double kLastingShareMax = 0.95;

/// Position and velocity of one axis after `step_s`: a velocity that is forgotten, driven by white
/// noise (the integrated Ornstein-Uhlenbeck process).
struct AxisWalk {
  double travelled_s = 0.0;
  double kept = 0.0;
  double position_variance = 0.0;
  double mixed_variance = 0.0;
  double velocity_variance = 0.0;
};

AxisWalk WalkAxis(double sigma, double memory_s, double step_s) {
  AxisWalk walk;
  const double lost = -std::expm1(-step_s / memory_s);
  const double lost_twice = -std::expm1(-2.0 * step_s / memory_s);
  const double density = sigma * sigma;
  walk.kept = 1.0 - lost;
  walk.travelled_s = memory_s * lost;
  walk.position_variance = density * memory_s * memory_s *
                           (step_s - 2.0 * memory_s * lost + 0.5 * memory_s * lost_twice);
  walk.mixed_variance = 0.5 * density * memory_s * memory_s * lost * lost;
  walk.velocity_variance = 0.5 * density * memory_s * lost_twice;
  return walk;
}

AxisWalk WalkAxis(const TorsoOptions& options, int axis, double step_s) {
  if (axis == 2) {
    return WalkAxis(options.vertical_acceleration_sigma, options.vertical_memory_s, step_s);
  }
  return WalkAxis(options.acceleration_sigma, options.walk_memory_s, step_s);
}

/// U with U'U = the inverse of a covariance.
Eigen::Matrix3d Whitening(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d information = covariance.llt().solve(Eigen::Matrix3d::Identity());
  return (0.5 * (information + information.transpose())).llt().matrixU();
}

/// Columns: two directions across, and the ray from the camera last.
Eigen::Matrix3d RayFrame(const PersonObservation& observation) {
  const Eigen::Vector3d ray = observation.map_T_torso.position - observation.camera_map;
  if (ray.norm() < kRayLengthMinM) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d frame;
  frame.col(2) = ray.normalized();
  frame.col(0) = frame.col(2).unitOrthogonal();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

WalkTerm CueTerm(const TorsoOptions& options, const PositionCue& cue, double share) {
  // Semidefinite is common, so no plain Cholesky.
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(share * cue.information_map);
  const Eigen::Vector3d scale = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
  const Eigen::Matrix3d upper = ldlt.matrixU();
  const Eigen::Matrix3d permuted = upper * (ldlt.transpositionsP() * Eigen::Matrix3d::Identity());
  WalkTerm term;
  term.loss_scale = options.loss_scale;
  term.jacobian.leftCols<3>() = scale.asDiagonal() * permuted;
  term.target = term.jacobian.leftCols<3>() * cue.torso_map;
  return term;
}

bool IsPosition(const Eigen::Vector3d& position_map) {
  return position_map.allFinite() && position_map.cwiseAbs().maxCoeff() < kPositionMaxM;
}

bool IsUsableCue(const PositionCue& cue) {
  return IsPosition(cue.torso_map) && cue.information_map.allFinite() &&
         cue.information_map.cwiseAbs().maxCoeff() < kInformationMax;
}

}  // namespace

bool IsUsable(const PersonObservation& observation) {
  const Eigen::Matrix3d& covariance = observation.position_covariance_map;
  if (!IsValidPose(observation.map_T_torso) || !IsPosition(observation.map_T_torso.position) ||
      !IsPosition(observation.camera_map)) {
    return false;
  }
  if (!covariance.allFinite() || covariance.maxCoeff() > kVarianceMaxM2) return false;
  const Eigen::LLT<Eigen::Matrix3d> llt(covariance);
  if (llt.info() != Eigen::Success) return false;
  const Eigen::Matrix3d lower = llt.matrixL();
  if (lower.diagonal().minCoeff() < std::sqrt(kVarianceMinM2)) return false;
  if (observation.has_heading && !(std::isfinite(observation.heading_sigma_rad) &&
                                   observation.heading_sigma_rad >= kHeadingSigmaMinRad)) {
    return false;
  }
  return std::all_of(observation.cues.begin(), observation.cues.end(), IsUsableCue);
}

double HeadingOf(const Eigen::Quaterniond& map_Q_torso) {
  const Eigen::Vector3d forward = map_Q_torso * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

ChainLink<3> StandingLink(const TorsoOptions& options, double step_s) {
  ChainLink<3> link;
  const double sigma_m = options.walk_sigma_m_s * step_s;
  link.covariance = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
  return link;
}

ChainLink<kSmoothStateCount> WalkingLink(const TorsoOptions& options, double step_s) {
  ChainLink<kSmoothStateCount> link;
  link.covariance.setZero();
  for (int axis = 0; axis < 3; ++axis) {
    const AxisWalk walk = WalkAxis(options, axis, step_s);
    const int velocity = kVelocity + axis;
    link.transition(axis, velocity) = walk.travelled_s;
    link.transition(velocity, velocity) = walk.kept;
    link.covariance(axis, axis) = walk.position_variance;
    link.covariance(axis, velocity) = link.covariance(velocity, axis) = walk.mixed_variance;
    link.covariance(velocity, velocity) = walk.velocity_variance;
  }
  link.transition(kLasting, kLasting) = std::exp(-step_s / options.lasting_s);
  link.covariance(kLasting, kLasting) = -std::expm1(-2.0 * step_s / options.lasting_s);
  return link;
}

ChainLink<1> TurningLink(const TorsoOptions& options, double step_s) {
  ChainLink<1> link;
  const double sigma_rad = options.turn_walk_sigma_rad * std::sqrt(step_s);
  link.covariance(0, 0) = sigma_rad * sigma_rad;
  return link;
}

Eigen::Matrix3d StandingStart() { return kWeakInformation * Eigen::Matrix3d::Identity(); }

WalkMatrix WalkingStart(const TorsoOptions& options) {
  WalkMatrix information = kWeakInformation * WalkMatrix::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    // A long time after anything was known.
    const double variance = WalkAxis(options, axis, 1e3).velocity_variance;
    information(kVelocity + axis, kVelocity + axis) = 1.0 / variance;
  }
  information(kLasting, kLasting) = 1.0;
  return information;
}

std::vector<ChainTerm<3>> StandingTerms(const TorsoOptions& options,
                                        const PersonObservation& observation) {
  ChainTerm<3> term;
  term.loss_scale = options.paper_loss_scale;
  term.jacobian = Whitening(observation.position_covariance_map);
  term.target = term.jacobian * observation.map_T_torso.position;
  return {term};
}

RayDetection::RayDetection(const TorsoOptions& options, const PersonObservation& observation)
    : camera_map_(observation.camera_map),
      position_map_(observation.map_T_torso.position),
      map_Q_ray_(RayFrame(observation)),
      loss_scale_(options.loss_scale) {
  Eigen::Matrix3d covariance =
      map_Q_ray_.transpose() * observation.position_covariance_map * map_Q_ray_;
  const Eigen::Matrix3d information = covariance.llt().solve(Eigen::Matrix3d::Identity());
  // Never more than the variance along the ray that directions across do not explain.
  const double share = std::clamp(options.lasting_share, 0.0, kLastingShareMax);
  const double lasting_variance = share / information(2, 2);
  covariance(2, 2) -= lasting_variance;
  whitening_ray_ = Whitening(covariance);
  lasting_sigma_m_ = std::sqrt(lasting_variance);
}

std::array<WalkTerm, 2> RayDetection::TermsAt(const Eigen::Vector3d& believed_map) const {
  Eigen::Matrix3d frame = map_Q_ray_;
  const Eigen::Vector3d offset = believed_map - camera_map_;
  const double range_m = offset.norm();
  if (range_m > kRayLengthMinM && offset.dot(frame.col(2)) > kRayCosineMin * range_m) {
    frame = Eigen::Quaterniond::FromTwoVectors(frame.col(2), offset) * frame;
  }
  const Eigen::Matrix3d weighted = whitening_ray_ * frame.transpose();
  const Eigen::Vector3d target = weighted * position_map_;
  std::array<WalkTerm, 2> terms;
  WalkTerm& across = terms[0];
  WalkTerm& along = terms[1];
  across.loss_scale = along.loss_scale = loss_scale_;
  across.jacobian.topLeftCorner<2, 3>() = weighted.topRows<2>();
  across.jacobian.col(kLasting).head<2>() = whitening_ray_.col(2).head<2>() * lasting_sigma_m_;
  across.target.head<2>() = target.head<2>();
  along.jacobian.row(2).head<3>() = weighted.row(2);
  along.jacobian(2, kLasting) = whitening_ray_(2, 2) * lasting_sigma_m_;
  along.target(2) = target(2);
  return terms;
}

std::vector<WalkTerm> CueTerms(const TorsoOptions& options, const PersonObservation& observation,
                               double step_s) {
  std::vector<WalkTerm> terms;
  for (const PositionCue& cue : observation.cues) {
    const double share = cue.kind == PositionCue::Kind::kTorsoHeight
                             ? std::min(1.0, step_s / options.height_lasting_s)
                             : 1.0;
    terms.push_back(CueTerm(options, cue, share));
  }
  return terms;
}

std::vector<ChainTerm<1>> HeadingTerms(const TorsoOptions& options,
                                       const PersonObservation& observation) {
  if (!observation.has_heading) return {};
  ChainTerm<1> term;
  const double information = 1.0 / observation.heading_sigma_rad;
  term.loss_scale = options.loss_scale;
  term.jacobian(0, 0) = information;
  term.target(0) = information * HeadingOf(observation.map_T_torso.orientation);
  term.period = 2.0 * std::numbers::pi * information;
  return {term};
}

}  // namespace dsg::ingest
