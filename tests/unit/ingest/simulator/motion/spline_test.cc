// SPDX-License-Identifier: Apache-2.0
// The spline reproduces polynomials, stands still exactly, and its derivatives are its own.
#include "ingest/simulator/motion/spline.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::simulator {
namespace {

using Value = QuinticSpline::Value;

Value Waves(double t) {
  return {std::sin(t), 3.0 * std::cos(2.0 * t), std::sin(5.0 * t) + t, std::exp(-t)};
}

TEST(QuinticSpline, ReproducesStraightLines) {
  const Value slope(1.0, -2.0, 0.5, 0.0);
  const QuinticSpline spline(3.0, 0.1, [&](double t) { return Value(slope * t); });
  for (const double t : {0.0, 0.05, 1.234, 2.999, 3.0}) {
    const QuinticSpline::Sample sample = spline.At(t);
    EXPECT_LT((sample.value - slope * t).norm(), 1e-13);
    EXPECT_LT((sample.rate - slope).norm(), 1e-12);
    EXPECT_LT(sample.rate_of_rate.norm(), 1e-10);
  }
}

TEST(QuinticSpline, SmoothsParabolasByHalfAKnotSquaredTimesTheirBend) {
  // The kernel of degree five has the variance (5 + 1) / 12 knots^2.
  const double knot = 0.2;
  const QuinticSpline spline(2.0, knot, [](double t) { return Value::Constant(t * t); });
  for (const double t : {0.0, 0.33, 1.0, 1.99}) {
    const QuinticSpline::Sample sample = spline.At(t);
    EXPECT_NEAR(sample.value[0], t * t + 0.5 * knot * knot, 1e-12);
    EXPECT_NEAR(sample.rate[0], 2.0 * t, 1e-12);
    EXPECT_NEAR(sample.rate_of_rate[0], 2.0, 1e-10);
  }
}

TEST(QuinticSpline, StandsStillExactlyWhereItsControlPointsDo) {
  const auto step = [](double t) { return Value::Constant(0.1 + std::max(0.0, t - 1.0)); };
  const QuinticSpline spline(2.0, 0.1, step);
  // The first control point that moves is at 1.1 s; it acts from three knots before on.
  for (int i = 0; i <= 79; ++i) {
    const QuinticSpline::Sample sample = spline.At(0.01 * i);
    EXPECT_EQ(sample.value, Value::Constant(0.1)) << i;
    EXPECT_EQ(sample.rate, Value::Zero()) << i;
    EXPECT_EQ(sample.rate_of_rate, Value::Zero()) << i;
  }
  EXPECT_NE(spline.At(0.85).rate, Value::Zero());
}

TEST(QuinticSpline, DerivativesMatchCentralDifferences) {
  const QuinticSpline spline(4.0, 0.1, Waves);
  const double h = 1e-4;
  for (double t = h; t < 4.0 - h; t += 0.0137) {
    const auto before = spline.At(t - h);
    const auto at = spline.At(t);
    const auto after = spline.At(t + h);
    const Value rate = (after.value - before.value) / (2.0 * h);
    const Value rate_of_rate = (after.rate - before.rate) / (2.0 * h);
    EXPECT_LT((rate - at.rate).norm(), 1e-6 * at.rate.norm()) << t;
    EXPECT_LT((rate_of_rate - at.rate_of_rate).norm(), 1e-6 * at.rate_of_rate.norm()) << t;
  }
}

TEST(QuinticSpline, HasNoCornersUpToTheFourthDerivative) {
  // Divided differences of the second derivative on both sides of each knot. Where only the third
  // derivative were continuous, the second difference would jump by the size of the fourth.
  const double knot = 0.1;
  const QuinticSpline spline(4.0, knot, Waves);
  const double h = 1e-3;
  const auto bend = [&](double t) { return spline.At(t).rate_of_rate; };
  for (int k = 1; k < 40; ++k) {
    const double t = k * knot;
    const Value third_before = (bend(t) - bend(t - h)) / h;
    const Value third_after = (bend(t + h) - bend(t)) / h;
    const Value fourth_before = (bend(t) - 2.0 * bend(t - h) + bend(t - 2.0 * h)) / (h * h);
    const Value fourth_after = (bend(t + 2.0 * h) - 2.0 * bend(t + h) + bend(t)) / (h * h);
    EXPECT_LT((third_after - third_before).norm(), 1.1 * h * fourth_after.norm() + 1e-3) << t;
    EXPECT_LT((fourth_after - fourth_before).norm(), 0.02 * fourth_after.norm() + 5.0) << t;
  }
}

}  // namespace
}  // namespace dsg::simulator
