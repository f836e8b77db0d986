// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/landmarks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/matching/robust_estimators.h"

namespace dsg::merge {
namespace {

double DiagonalOf(const Node& node) {
  return node.box_node.isEmpty() ? 0.0 : node.box_node.sizes().norm();
}

// Kinds with more pairs are subsampled: they are expensive and discriminate little.
constexpr size_t kPairCountMax = 60'000;
// Most cells per side of the grid of shifts; larger maps get larger cells.
constexpr int kGridSideMax = 1500;

struct Pair {
  Eigen::Vector2d into;
  Eigen::Vector2d other;
  double weight = 0.0;
  double dz = 0.0;
};

// Common kinds have many wrong pairs per right one, so pairs of rare kinds count more; less than
// proportionally, because rare kinds are often misclassified.
double WeightOfPairs(size_t pair_count) { return std::pow(static_cast<double>(pair_count), -0.25); }

std::vector<Pair> ListPairs(const std::vector<Landmark>& into, const std::vector<Landmark>& other) {
  std::vector<Pair> pairs;
  for (const KindPair& kind : PairKinds(into, other)) {
    const size_t count = kind.into.size() * kind.other.size();
    const size_t stride = count / kPairCountMax + 1;
    const double weight = WeightOfPairs(count) * static_cast<double>(stride);
    for (size_t k = 0; k < count; k += stride) {
      const Landmark& a = into[static_cast<size_t>(kind.into[k % kind.into.size()])];
      const Landmark& b = other[static_cast<size_t>(kind.other[k / kind.into.size()])];
      if (!AreAlike(a, b)) continue;
      pairs.push_back(
          {a.position.head<2>(), b.position.head<2>(), weight, a.position.z() - b.position.z()});
    }
  }
  return pairs;
}

double ReachOf(const std::vector<Landmark>& landmarks) {
  double radius = 1.0;
  for (const Landmark& landmark : landmarks) {
    radius = std::max(radius, landmark.position.head<2>().norm());
  }
  return radius;
}

// Votes for shifts at one yaw. Sums cover a cell and its eight neighbours, because noise and the
// yaw step spread the true shift.
class ShiftGrid {
 public:
  ShiftGrid(double radius_m, double cell_m)
      : cell_m_(std::max(cell_m, 2.0 * radius_m / kGridSideMax)),
        side_(static_cast<int>(std::ceil(2.0 * radius_m / cell_m_)) + 3),
        votes_(static_cast<size_t>(side_) * static_cast<size_t>(side_), 0.0f) {}

  void Clear() { std::fill(votes_.begin(), votes_.end(), 0.0f); }

  void Add(const Eigen::Vector2d& shift, double weight) {
    const int x = CellOf(shift.x());
    const int y = CellOf(shift.y());
    if (x < 1 || y < 1 || x >= side_ - 1 || y >= side_ - 1) return;
    votes_[At(x, y)] += static_cast<float>(weight);
  }

  void Collect(double yaw_rad, double votes_min, std::vector<Guess>* guesses) const {
    for (int y = 1; y < side_ - 1; ++y) {
      for (int x = 1; x < side_ - 1; ++x) {
        if (votes_[At(x, y)] == 0.0f) continue;
        const double sum = SumAround(x, y);
        if (sum < votes_min) continue;
        guesses->push_back({yaw_rad, {PositionOf(x), PositionOf(y), 0.0}, sum});
      }
    }
  }

  double cell_m() const { return cell_m_; }

 private:
  size_t At(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(side_) + static_cast<size_t>(x);
  }
  int CellOf(double metres) const {
    return static_cast<int>(std::floor(metres / cell_m_ + 0.5)) + side_ / 2;
  }
  double PositionOf(int cell) const { return (cell - side_ / 2) * cell_m_; }
  double SumAround(int x, int y) const {
    double sum = 0.0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) sum += static_cast<double>(votes_[At(x + dx, y + dy)]);
    }
    return sum;
  }

  double cell_m_;
  int side_;
  std::vector<float> votes_;
};

double YawDifference(double a, double b) {
  return std::abs(std::remainder(a - b, 2.0 * std::numbers::pi));
}

// Best first; drops guesses close to a better one.
std::vector<Guess> Distinct(std::vector<Guess> guesses, double near_m, double near_rad,
                            int count_max) {
  std::stable_sort(guesses.begin(), guesses.end(),
                   [](const Guess& a, const Guess& b) { return a.votes > b.votes; });
  std::vector<Guess> kept;
  for (const Guess& guess : guesses) {
    const bool is_near = std::any_of(kept.begin(), kept.end(), [&](const Guess& better) {
      return (better.shift - guess.shift).norm() < near_m &&
             YawDifference(better.yaw_rad, guess.yaw_rad) < near_rad;
    });
    if (is_near) continue;
    kept.push_back(guess);
    if (static_cast<int>(kept.size()) == count_max) break;
  }
  return kept;
}

double VoteOnHeight(const std::vector<Pair>& pairs, const Guess& guess, double reach_m) {
  const Eigen::Rotation2Dd turn(guess.yaw_rad);
  std::vector<Measurement> heights;
  for (const Pair& pair : pairs) {
    const Eigen::Vector2d shift = pair.into - turn * pair.other;
    if ((shift - guess.shift.head<2>()).cwiseAbs().maxCoeff() > reach_m) continue;
    heights.push_back({pair.dz, 0.3});
  }
  return VoteAdaptively(heights).value;
}

}  // namespace

std::vector<Landmark> LandmarksOf(const MapContent& content, bool with_regions) {
  std::vector<Landmark> landmarks;
  for (int i = 0; i < static_cast<int>(content.nodes.size()); ++i) {
    const Node& node = content.nodes[static_cast<size_t>(i)];
    if (node.valid.to_ns != kTimeMax) continue;
    const NodeClass node_class = content.ClassOf(i);
    if (node_class == NodeClass::kObject && !ClassKey(node).empty()) {
      landmarks.push_back({"o " + ClassKey(node), MiddleOf(node), DiagonalOf(node)});
    } else if (with_regions && node_class == NodeClass::kRegion && node.kind == kinds::kRoom) {
      landmarks.push_back({"r " + ClassKey(node), MiddleOf(node), DiagonalOf(node)});
    } else if (with_regions && node_class == NodeClass::kPlace) {
      const double clearance_m = ClearanceOf(node);
      // Bins of 0.25 m, which separate corridors from halls.
      const int width = static_cast<int>(clearance_m / 0.25);
      landmarks.push_back({absl::StrCat("p ", width), node.map_T_node.position, clearance_m});
    }
  }
  return landmarks;
}

bool AreAlike(const Landmark& a, const Landmark& b) {
  if (a.size_m <= 0.0 || b.size_m <= 0.0) return true;
  return a.size_m < 2.0 * b.size_m && b.size_m < 2.0 * a.size_m;
}

std::vector<KindPair> PairKinds(const std::vector<Landmark>& into,
                                const std::vector<Landmark>& other) {
  std::map<std::string, KindPair> by_kind;
  for (size_t i = 0; i < into.size(); ++i) {
    by_kind[into[i].kind].into.push_back(static_cast<int>(i));
  }
  for (size_t i = 0; i < other.size(); ++i) {
    by_kind[other[i].kind].other.push_back(static_cast<int>(i));
  }
  std::vector<KindPair> pairs;
  for (auto& [kind, pair] : by_kind) {
    if (!pair.into.empty() && !pair.other.empty()) pairs.push_back(std::move(pair));
  }
  return pairs;
}

absl::StatusOr<std::vector<Guess>> VoteOnTransform(const std::vector<Landmark>& into,
                                                   const std::vector<Landmark>& other,
                                                   const VoteOptions& options,
                                                   const StopCheck& stop) {
  const std::vector<Pair> pairs = ListPairs(into, other);
  ShiftGrid grid(ReachOf(into) + ReachOf(other), options.cell_m);
  std::vector<Guess> guesses;
  double best = 0.0;
  const int step_count = static_cast<int>(std::ceil(2.0 * std::numbers::pi / options.yaw_step_rad));
  for (int step = 0; step < step_count; ++step) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    const double yaw_rad = 2.0 * std::numbers::pi * step / step_count;
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(yaw_rad).toRotationMatrix();
    grid.Clear();
    for (const Pair& pair : pairs) grid.Add(pair.into - turn * pair.other, pair.weight);
    const size_t before = guesses.size();
    grid.Collect(yaw_rad, 0.3 * best, &guesses);
    for (size_t i = before; i < guesses.size(); ++i) best = std::max(best, guesses[i].votes);
    std::erase_if(guesses, [&](const Guess& guess) { return guess.votes < 0.3 * best; });
  }
  guesses = Distinct(std::move(guesses), 3.0 * grid.cell_m(), 3.5 * options.yaw_step_rad,
                     options.guess_count_max);
  for (Guess& guess : guesses) guess.shift.z() = VoteOnHeight(pairs, guess, 1.5 * grid.cell_m());
  return guesses;
}

}  // namespace dsg::merge
