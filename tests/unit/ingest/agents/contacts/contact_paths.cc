// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/agents/contacts/contact_paths.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {

TimedPoint At(double seconds, double x, double y, double z) {
  return {.time_ns = std::llround(seconds * 1e9), .position_map = {x, y, z}};
}

std::vector<TimedPoint> RandomWalk(Random* random, int sample_count, double size_m) {
  std::vector<TimedPoint> path;
  TimeNs time_ns = random->Integer(0, 1'000'000'000);
  Eigen::Vector3d position(random->Uniform(0, size_m), random->Uniform(0, size_m), 1.0);
  for (int i = 0; i < sample_count; ++i) {
    path.push_back({.time_ns = time_ns, .position_map = position});
    time_ns += random->Chance(0.1) ? 3 * kSecond : random->Integer(50'000'000, 900'000'000);
    if (random->Chance(0.2)) continue;
    position += Eigen::Vector3d(random->Normal(), random->Normal(), 0.3 * random->Normal());
    position = position.cwiseMax(0.0).cwiseMin(size_m);
  }
  return path;
}

std::optional<Eigen::Vector3d> PositionAt(const std::vector<TimedPoint>& path, TimeNs time_ns,
                                          TimeNs gap_ns_max) {
  for (size_t i = 0; i < path.size(); ++i) {
    if (path[i].time_ns == time_ns) return path[i].position_map;
    if (path[i].time_ns > time_ns) {
      if (i == 0 || path[i].time_ns - path[i - 1].time_ns > gap_ns_max) return std::nullopt;
      const double fraction = static_cast<double>(time_ns - path[i - 1].time_ns) /
                              static_cast<double>(path[i].time_ns - path[i - 1].time_ns);
      return (1.0 - fraction) * path[i - 1].position_map + fraction * path[i].position_map;
    }
  }
  return std::nullopt;
}

std::vector<Span> MergePauses(const std::vector<Span>& spans, TimeNs pause_ns) {
  std::vector<Span> merged;
  for (const Span& span : spans) {
    if (!merged.empty() && span.from_ns - merged.back().to_ns < pause_ns) {
      merged.back().to_ns = span.to_ns;
    } else {
      merged.push_back(span);
    }
  }
  return merged;
}

bool IsSame(const Contact& a, const Contact& b) {
  return a.agent == b.agent && a.other == b.other && a.from_ns == b.from_ns && a.to_ns == b.to_ns &&
         a.closest_ns == b.closest_ns && a.distance_m == b.distance_m && a.hand_map == b.hand_map &&
         a.is_left_hand == b.is_left_hand;
}

bool AreSame(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), IsSame);
}

}  // namespace dsg::ingest
