// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/shape_statistics.h"

namespace dsg::ingest {
namespace {

// Networks that give everybody the same numbers must not divide by zero.
constexpr double kVarianceMin = 1e-4;

}  // namespace

std::optional<ShapeVector> ReadShape(const std::vector<float>& coefficients) {
  if (coefficients.size() != static_cast<size_t>(kShapeCount)) return std::nullopt;
  ShapeVector shape;
  for (int i = 0; i < kShapeCount; ++i) {
    shape[i] = static_cast<double>(coefficients[static_cast<size_t>(i)]);
  }
  if (!shape.allFinite() || shape.isZero(0.0)) return std::nullopt;
  return shape;
}

void ShapeMean::Add(const ShapeVector& shape) {
  sum += shape;
  ++count;
}

void ShapeMean::Add(const ShapeMean& other) {
  sum += other.sum;
  count += other.count;
}

ShapeStatistics::ShapeStatistics(double noise_sigma, double spread_sigma, const ShapePrior& prior)
    : noise_variance_(noise_sigma * noise_sigma),
      spread_variance_(spread_sigma * spread_sigma),
      prior_(prior) {}

void ShapeStatistics::LearnNoise(const ShapeMean& person, const ShapeVector& shape) {
  if (person.count == 0) return;
  // A mean of n errs too: the difference scatters by 1 + 1/n times the noise.
  const double share = 1.0 + 1.0 / static_cast<double>(person.count);
  noise_sum_ += (shape - person.mean()).cwiseAbs2() / share;
  ++noise_count_;
}

void ShapeStatistics::LearnSpread(const ShapeMean& person) {
  if (person.count == 0) return;
  const ShapeVector mean = person.mean();
  person_sum_ += mean;
  person_square_sum_ += mean.cwiseAbs2();
  ++person_count_;
}

ShapeVector ShapeStatistics::NoiseOfMean(int64_t count) const {
  const ShapeVector single = (prior_.noise_count * noise_variance_ + noise_sum_.array()).matrix() /
                             (prior_.noise_count + static_cast<double>(noise_count_));
  const double share = 1.0 / static_cast<double>(count) + prior_.shared_noise;
  return (share * single).cwiseMax(kVarianceMin);
}

ShapeVector ShapeStatistics::Center() const {
  return person_sum_ / (prior_.person_count + static_cast<double>(person_count_));
}

ShapeVector ShapeStatistics::Spread() const {
  const double count = prior_.person_count + static_cast<double>(person_count_);
  const ShapeVector square =
      (prior_.person_count * spread_variance_ + person_square_sum_.array()).matrix() / count;
  return (square - Center().cwiseAbs2()).cwiseMax(kVarianceMin);
}

double ShapeStatistics::SquaredDistance(const ShapeMean& a, const ShapeMean& b) const {
  const ShapeVector variance = NoiseOfMean(a.count) + NoiseOfMean(b.count);
  return (a.mean() - b.mean()).cwiseAbs2().cwiseQuotient(variance).sum();
}

double ShapeStatistics::LogRatio(const ShapeMean& a, const ShapeMean& b) const {
  const Eigen::Array<double, kShapeCount, 1> spread = Spread().array();
  const auto variance_a = (spread + NoiseOfMean(a.count).array()).eval();
  const auto variance_b = (spread + NoiseOfMean(b.count).array()).eval();
  const auto from_a = (a.mean() - Center()).array().eval();
  const auto from_b = (b.mean() - Center()).array().eval();
  const auto apart = (from_a.square() / variance_a + from_b.square() / variance_b).eval();
  // Of one person, the two differ from the centre together: their covariance is the spread.
  const auto determinant = (variance_a * variance_b - spread.square()).eval();
  const auto together = ((variance_b * from_a.square() - 2.0 * spread * from_a * from_b +
                          variance_a * from_b.square()) /
                         determinant)
                            .eval();
  return 0.5 * ((variance_a * variance_b / determinant).log() + apart - together).sum();
}

}  // namespace dsg::ingest
