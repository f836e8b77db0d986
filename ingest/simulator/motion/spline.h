// SPDX-License-Identifier: Apache-2.0
// A uniform B-spline of degree five with exact first and second derivatives.
// Refuses to interpolate: control points pull the curve, they do not lie on it.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace dsg::simulator {

/// C4, so that even the derivative of the acceleration has no corners.
///
/// Source: Cox, 1972, and de Boor, 1972 (the recursion of the basis).
class QuinticSpline {
 public:
  using Value = Eigen::Vector4d;

  struct Sample {
    Value value = Value::Zero();
    Value rate = Value::Zero();
    Value rate_of_rate = Value::Zero();
  };

  /// `reference` is read at the knots from -2 to the end + 3 knots; the curve is the reference
  /// smoothed over six knots. Where these six values are the same the curve stands still exactly.
  /// Requires: knot_s > 0, duration_s > 0.
  QuinticSpline(double duration_s, double knot_s, const std::function<Value(double)>& reference);

  /// Clamped to the first and the last segment. Requires: a finite time.
  Sample At(double time_s) const;

 private:
  double knot_s_;
  std::vector<Value> control_;
};

}  // namespace dsg::simulator
