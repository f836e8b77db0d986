// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/contacts/path_pieces.h"

#include <algorithm>

namespace dsg::ingest {
namespace {

constexpr size_t kBlockPieces = 32;
// Metres; squares of what is farther would overflow, or leave no digits for the distance.
constexpr double kCoordinateMax = 1e9;

// Stamps may lie at both ends of the clock, where a signed difference overflows.
bool IsGap(TimeNs from_ns, TimeNs to_ns, TimeNs gap_ns_max) {
  const uint64_t gap_ns = static_cast<uint64_t>(to_ns) - static_cast<uint64_t>(from_ns);
  return gap_ns > static_cast<uint64_t>(std::max<TimeNs>(0, gap_ns_max));
}

std::vector<TimedPoint> CleanPoints(const std::vector<TimedPoint>& points) {
  std::vector<TimedPoint> clean;
  clean.reserve(points.size());
  for (const TimedPoint& point : points) {
    // False for what is not a number.
    if (point.position_map.cwiseAbs().maxCoeff() <= kCoordinateMax &&
        point.position_map.allFinite()) {
      clean.push_back(point);
    }
  }
  const auto is_earlier = [](const TimedPoint& a, const TimedPoint& b) {
    return a.time_ns < b.time_ns;
  };
  const auto is_same = [](const TimedPoint& a, const TimedPoint& b) {
    return a.time_ns == b.time_ns;
  };
  std::stable_sort(clean.begin(), clean.end(), is_earlier);
  clean.erase(std::unique(clean.begin(), clean.end(), is_same), clean.end());
  return clean;
}

void AddBlocks(PathPieces* path) {
  for (size_t begin = 0; begin < path->pieces.size(); begin += kBlockPieces) {
    PathBlock block;
    block.begin = begin;
    block.end = std::min(begin + kBlockPieces, path->pieces.size());
    block.from_ns = path->pieces[begin].from_ns;
    block.to_ns = path->pieces[block.end - 1].to_ns;
    for (size_t i = block.begin; i < block.end; ++i) {
      block.box_map.extend(path->pieces[i].start_map);
      block.box_map.extend(path->pieces[i].end_map);
    }
    path->box_map.extend(block.box_map);
    path->blocks.push_back(block);
  }
}

}  // namespace

Eigen::Vector3d PathPiece::At(TimeNs time_ns) const {
  // The ends as they were given, without rounding.
  if (time_ns == from_ns) return start_map;
  if (time_ns == to_ns) return end_map;
  const double fraction =
      static_cast<double>(time_ns - from_ns) / static_cast<double>(to_ns - from_ns);
  return start_map + fraction * (end_map - start_map);
}

PathPieces CutPath(const std::vector<TimedPoint>& points, TimeNs gap_ns_max) {
  const std::vector<TimedPoint> clean = CleanPoints(points);
  PathPieces path;
  bool is_joined = false;
  for (size_t i = 0; i < clean.size(); ++i) {
    const bool is_last =
        i + 1 == clean.size() || IsGap(clean[i].time_ns, clean[i + 1].time_ns, gap_ns_max);
    if (is_last && is_joined) {
      is_joined = false;
      continue;
    }
    const TimedPoint& end = is_last ? clean[i] : clean[i + 1];
    path.pieces.push_back({.from_ns = clean[i].time_ns,
                           .to_ns = end.time_ns,
                           .start_map = clean[i].position_map,
                           .end_map = end.position_map});
    is_joined = !is_last;
  }
  AddBlocks(&path);
  return path;
}

}  // namespace dsg::ingest
