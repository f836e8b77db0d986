// SPDX-License-Identifier: Apache-2.0
// How far two bodies' shape coefficients tell persons apart.
// Refuses to look at places: a shape alone never decides who somebody is.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/agents/tracking/tracker_options.h"
#include "ingest/sensor/human_detection.h"

namespace dsg::ingest {

using ShapeVector = Eigen::Matrix<double, kShapeCount, 1>;

/// Nullopt for other counts than kShapeCount, numbers that are not finite, and all zero, which
/// networks without a shape of their own write.
std::optional<ShapeVector> ReadShape(const std::vector<float>& coefficients);

/// Of one person's detections.
struct ShapeMean {
  int64_t count = 0;
  ShapeVector sum = ShapeVector::Zero();

  void Add(const ShapeVector& shape);
  void Add(const ShapeMean& other);
  /// Requires: count > 0.
  ShapeVector mean() const { return sum / static_cast<double>(count); }
};

/// The scatter of one person's shapes and of persons among each other, learnt on the way from what
/// is assumed: a network that tells all people the same shape must not make them one.
class ShapeStatistics {
 public:
  /// Standard deviations of each coefficient: of one detection, and of people.
  ShapeStatistics(double noise_sigma, double spread_sigma, const ShapePrior& prior = {});

  /// Another shape of a person whose mean before it is `person`.
  void LearnNoise(const ShapeMean& person, const ShapeVector& shape);
  /// A person who was not there before.
  void LearnSpread(const ShapeMean& person);

  /// Mahalanobis distance, kShapeCount degrees of freedom if they are of one person.
  /// Requires: counts > 0.
  double SquaredDistance(const ShapeMean& a, const ShapeMean& b) const;
  /// Logarithm of how much likelier the two are of one person than of two. Requires: counts > 0.
  double LogRatio(const ShapeMean& a, const ShapeMean& b) const;

 private:
  ShapeVector NoiseOfMean(int64_t count) const;
  ShapeVector Spread() const;
  ShapeVector Center() const;

  double noise_variance_;
  double spread_variance_;
  ShapePrior prior_;
  int64_t noise_count_ = 0;
  ShapeVector noise_sum_ = ShapeVector::Zero();
  int64_t person_count_ = 0;
  ShapeVector person_sum_ = ShapeVector::Zero();
  ShapeVector person_square_sum_ = ShapeVector::Zero();
};

}  // namespace dsg::ingest
