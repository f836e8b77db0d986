// SPDX-License-Identifier: Apache-2.0
// Clouds moved by a known motion, with known wrong pairs.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "schema/base/random.h"
#include "schema/matching/registration.h"

namespace dsg {

inline constexpr double kRadianDeg = 180.0 / 3.14159265358979323846;

inline Eigen::Vector3d RandomInCube(Random* random, double size_m) {
  const double x = random->Uniform(0.0, size_m);
  const double y = random->Uniform(0.0, size_m);
  return {x, y, random->Uniform(0.0, size_m)};
}

inline Eigen::Vector3d RandomNormal(Random* random, double sigma_m) {
  const double x = random->Normal();
  const double y = random->Normal();
  return sigma_m * Eigen::Vector3d(x, y, random->Normal());
}

inline Eigen::Vector3d RandomInBall(Random* random, double radius_m) {
  while (true) {
    const Eigen::Vector3d p =
        2.0 * RandomInCube(random, radius_m) - Eigen::Vector3d::Constant(radius_m);
    if (p.norm() <= radius_m) return p;
  }
}

inline Eigen::Matrix3d RandomRotation(Random* random) {
  Eigen::Vector4d q;
  for (int i = 0; i < 4; ++i) q(i) = random->Normal();
  return Eigen::Quaterniond(q.normalized()).toRotationMatrix();
}

inline Eigen::Matrix3d Yaw(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

struct KnownMotion {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
};

inline double RotationErrorDeg(const Registration& found, const KnownMotion& truth) {
  return Eigen::AngleAxisd(found.rotation.transpose() * truth.rotation).angle() * kRadianDeg;
}
inline double TranslationErrorM(const Registration& found, const KnownMotion& truth) {
  return (found.translation - truth.translation).norm();
}

struct Clouds {
  std::vector<Eigen::Vector3d> source;
  std::vector<Eigen::Vector3d> target;
  std::vector<Correspondence> correspondences;
  KnownMotion truth;
  int outlier_count = 0;
};

struct CloudsKind {
  int count = 100;
  double outlier_share = 0.0;
  double sigma_m = 0.01;
  /// Wrong targets lie anywhere in a ball this large around the middle of the true ones; 0 puts
  /// them among the true ones.
  double outlier_radius_m = 0.0;
  double scale = 1.0;
  bool is_upright = false;
};

/// Points of the unit cube, point i with point i; the first `outlier_count` are wrong.
inline Clouds RandomClouds(const CloudsKind& kind, Random* random) {
  Clouds clouds;
  clouds.truth.scale = kind.scale;
  clouds.truth.rotation =
      kind.is_upright ? Yaw(random->Uniform(-3.1, 3.1)) : RandomRotation(random);
  clouds.truth.translation = RandomInBall(random, 1.0);
  clouds.outlier_count = static_cast<int>(std::lround(kind.outlier_share * kind.count));
  const Eigen::Vector3d middle = clouds.truth * Eigen::Vector3d::Constant(0.5);
  for (int i = 0; i < kind.count; ++i) {
    const Eigen::Vector3d point = RandomInCube(random, 1.0);
    clouds.source.push_back(point);
    clouds.correspondences.emplace_back(i, i);
    if (i >= clouds.outlier_count) {
      clouds.target.push_back(clouds.truth * point + RandomNormal(random, kind.sigma_m));
    } else if (kind.outlier_radius_m > 0.0) {
      clouds.target.push_back(middle + RandomInBall(random, kind.outlier_radius_m));
    } else {
      clouds.target.push_back(clouds.truth * RandomInCube(random, 1.0));
    }
  }
  return clouds;
}

inline double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace dsg
