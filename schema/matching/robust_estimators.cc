// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/robust_estimators.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace dsg {
namespace {

struct IntervalEnd {
  double position;
  // Beginnings first, so that intervals that touch overlap.
  bool is_end;
  int measurement;

  bool operator<(const IntervalEnd& other) const {
    if (position != other.position) return position < other.position;
    if (is_end != other.is_end) return other.is_end;
    return measurement < other.measurement;
  }
};

std::vector<IntervalEnd> SortedEnds(const std::vector<Measurement>& measurements) {
  std::vector<IntervalEnd> ends;
  ends.reserve(measurements.size() * 2);
  for (size_t i = 0; i < measurements.size(); ++i) {
    const Measurement& m = measurements[i];
    ends.push_back({m.value - m.bound, false, static_cast<int>(i)});
    ends.push_back({m.value + m.bound, true, static_cast<int>(i)});
  }
  std::sort(ends.begin(), ends.end());
  return ends;
}

// Weighted sums over the measurements whose intervals hold the present position.
class Consensus {
 public:
  // Values are taken from `origin`, so that squares of large values do not drown small spreads.
  Consensus(double origin, size_t total_count) : origin_(origin), outside_count_(total_count) {}

  void Add(const Measurement& m, double sign) {
    const double weight = sign / (m.bound * m.bound);
    const double value = m.value - origin_;
    weight_ += weight;
    first_ += weight * value;
    second_ += weight * value * value;
    if (sign > 0.0) {
      --outside_count_;
      ++inside_count_;
    } else {
      ++outside_count_;
      --inside_count_;
    }
  }
  bool IsEmpty() const { return inside_count_ == 0; }
  Vote Best() const {
    const double mean = first_ / weight_;
    const double inside = std::max(0.0, second_ - first_ * mean);
    return {origin_ + mean, inside + static_cast<double>(outside_count_)};
  }

 private:
  double origin_;
  size_t outside_count_;
  size_t inside_count_ = 0;
  double weight_ = 0.0;
  double first_ = 0.0;
  double second_ = 0.0;
};

}  // namespace

Vote VoteAdaptively(const std::vector<Measurement>& measurements) {
  Vote best;
  if (measurements.empty()) return best;
  const std::vector<IntervalEnd> ends = SortedEnds(measurements);
  Consensus consensus(ends[ends.size() / 2].position, measurements.size());
  bool is_first = true;
  for (const IntervalEnd& end : ends) {
    consensus.Add(measurements[end.measurement], end.is_end ? -1.0 : 1.0);
    if (consensus.IsEmpty()) continue;
    const Vote vote = consensus.Best();
    if (is_first || vote.cost < best.cost) best = vote;
    is_first = false;
  }
  return best;
}

namespace {

// Weight of a squared miss under the surrogate of parameter `mu`, which grows towards truncation.
double SurrogateWeight(double miss2, double bound2, double mu) {
  if (miss2 <= mu / (mu + 1.0) * bound2) return 1.0;
  if (miss2 >= (mu + 1.0) / mu * bound2) return 0.0;
  return std::sqrt(bound2 * mu * (mu + 1.0) / miss2) - mu;
}

Eigen::VectorXd SquaredMisses(const Columns& a, const Columns& b, const Eigen::Matrix3d& rotation) {
  return (b - rotation * a).colwise().squaredNorm().transpose();
}

bool IsBinary(const Eigen::VectorXd& weights) {
  return (weights.array() == 0.0 || weights.array() == 1.0).all();
}

}  // namespace

Eigen::Matrix3d WeightedRotation(const Columns& a, const Columns& b, const Eigen::VectorXd& weights,
                                 bool is_upright) {
  const Eigen::Matrix3d correlation = (b * weights.asDiagonal()) * a.transpose();
  if (is_upright) {
    const double sine = correlation(1, 0) - correlation(0, 1);
    const double cosine = correlation(0, 0) + correlation(1, 1);
    const double yaw = std::atan2(sine, cosine);
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    rotation.topLeftCorner<2, 2>() << std::cos(yaw), -std::sin(yaw), std::sin(yaw), std::cos(yaw);
    return rotation;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d signs(1.0, 1.0, sign);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

GncRotation RotateRobustly(const Columns& a, const Columns& b, const GncOptions& options) {
  GncRotation result;
  result.weights = Eigen::VectorXd::Ones(a.cols());
  if (a.cols() == 0) return result;
  const double bound2 = options.bound * options.bound;
  result.rotation = WeightedRotation(a, b, result.weights, options.is_upright);
  Eigen::VectorXd misses2 = SquaredMisses(a, b, result.rotation);
  const double excess = 2.0 * misses2.maxCoeff() / bound2 - 1.0;
  // Every pair is within the bound already.
  if (excess <= 1.0) return result;
  double mu = 1.0 / excess;
  double last_cost = std::numeric_limits<double>::infinity();
  while (result.iteration_count < options.iteration_count_max) {
    ++result.iteration_count;
    result.weights =
        misses2.unaryExpr([&](double miss2) { return SurrogateWeight(miss2, bound2, mu); });
    if (result.weights.maxCoeff() <= 0.0) return result;
    result.rotation = WeightedRotation(a, b, result.weights, options.is_upright);
    misses2 = SquaredMisses(a, b, result.rotation);
    const double cost = result.weights.dot(misses2);
    const bool is_settled = std::abs(last_cost - cost) <= options.tolerance * cost;
    if (IsBinary(result.weights) && is_settled) return result;
    last_cost = cost;
    mu *= options.factor;
  }
  return result;
}

}  // namespace dsg
