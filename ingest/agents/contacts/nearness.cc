// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/contacts/nearness.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dsg::ingest {
namespace {

// Metres squared. Moves shorter than a picometre change no distance that anyone asks for, and
// dividing by their length would.
constexpr double kStillStep2 = 1e-24;

// Fractions at which a move begins, crosses planes of the box's faces, and ends.
struct Crossings {
  std::array<double, 8> fractions{};
  size_t count = 0;

  void Add(double fraction) { fractions[count++] = fraction; }
};

Crossings FindCrossings(const Move& move, const Box3d& box) {
  Crossings crossings;
  crossings.Add(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    if (move.step[axis] == 0.0) continue;
    for (const double face : {box.min()[axis], box.max()[axis]}) {
      const double fraction = (face - move.start[axis]) / move.step[axis];
      if (fraction > 0.0 && fraction < 1.0) crossings.Add(fraction);
    }
  }
  crossings.Add(1.0);
  std::sort(crossings.fractions.begin(), crossings.fractions.begin() + crossings.count);
  return crossings;
}

// Between two crossings only those axes count on which the point is outside of the box.
Move RelativeToFaces(const Move& move, const Box3d& box, double from, double to) {
  const Eigen::Vector3d middle = move.At(0.5 * (from + to));
  Move relative;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_below = middle[axis] < box.min()[axis];
    const bool is_above = middle[axis] > box.max()[axis];
    if (!is_below && !is_above) continue;
    const double face = is_below ? box.min()[axis] : box.max()[axis];
    relative.start[axis] = move.start[axis] - face + from * move.step[axis];
    relative.step[axis] = (to - from) * move.step[axis];
  }
  relative.fraction_slack = move.fraction_slack / (to - from);
  return relative;
}

}  // namespace

std::optional<NearSpan> NearOrigin(const Move& move, double limit_m) {
  const double step2 = move.step.squaredNorm();
  if (step2 < kStillStep2) {
    const double distance_m = move.start.norm();
    if (!(distance_m <= limit_m + kTouchTolerance)) return std::nullopt;
    return NearSpan{.from = 0.0, .to = 1.0, .closest = 0.0, .distance_m = distance_m};
  }
  // Of the whole line, beyond both ends of the move.
  const double closest = -move.start.dot(move.step) / step2;
  const double distance_m = move.At(closest).norm();
  if (!(distance_m <= limit_m + kTouchTolerance)) return std::nullopt;
  const double half =
      std::sqrt(std::max(0.0, (limit_m - distance_m) * (limit_m + distance_m)) / step2);
  if (!(closest + half >= -move.fraction_slack && closest - half <= 1.0 + move.fraction_slack)) {
    return std::nullopt;
  }
  NearSpan span;
  span.from = std::clamp(closest - half, 0.0, 1.0);
  span.to = std::clamp(closest + half, 0.0, 1.0);
  span.closest = std::clamp(closest, 0.0, 1.0);
  span.distance_m = move.At(span.closest).norm();
  return span;
}

std::optional<NearSpan> NearBox(const Move& move, const Box3d& box, double limit_m) {
  const double reach_m = limit_m + kTouchTolerance + move.step.norm();
  if (!(DistanceToBox(move.start, box) <= reach_m)) return std::nullopt;
  const Crossings crossings = FindCrossings(move, box);
  std::optional<NearSpan> whole;
  for (size_t i = 0; i + 1 < crossings.count; ++i) {
    const double from = crossings.fractions[i];
    const double length = crossings.fractions[i + 1] - from;
    if (!(length > 0.0)) continue;
    const Move relative = RelativeToFaces(move, box, from, from + length);
    const std::optional<NearSpan> part = NearOrigin(relative, limit_m);
    if (!part.has_value()) continue;
    if (!whole.has_value()) whole = {.from = from + part->from * length, .distance_m = INFINITY};
    whole->to = from + part->to * length;
    if (part->distance_m < whole->distance_m) {
      whole->closest = from + part->closest * length;
      whole->distance_m = part->distance_m;
    }
  }
  return whole;
}

}  // namespace dsg::ingest
