// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/floor_line.h"

#include <algorithm>
#include <cmath>

namespace dsg::simulator {
namespace {

constexpr double kSpacingM = 0.1;

struct Band {
  int rounds;
  double tension;
  double repulsion;
  /// Obstacles nearer than this push.
  double reach_m;
};

void Relax(const Band& band, const NearbyObstacles& obstacles, std::vector<Point>* line) {
  for (int round = 0; round < band.rounds; ++round) {
    for (size_t i = 1; i + 1 < line->size(); ++i) {
      Point& point = (*line)[i];
      const Point bend = 0.5 * ((*line)[i - 1] + (*line)[i + 1]) - point;
      const Point push = band.repulsion * obstacles.Push(point, band.reach_m);
      point += band.tension * bend + push;
    }
  }
}

}  // namespace

double LineClearance(const std::vector<Point>& line, const NearbyObstacles& obstacles) {
  double smallest = obstacles.Clearance(line.front());
  for (const Point& point : line) smallest = std::min(smallest, obstacles.Clearance(point));
  return smallest;
}

std::vector<Point> BendLine(const Path& path, const NearbyObstacles& obstacles) {
  const int piece_count = static_cast<int>(std::ceil(path.length_m() / kSpacingM));
  std::vector<Point> line = {path.At(0.0)};
  for (int i = 1; i <= piece_count; ++i) {
    line.push_back(path.At(path.length_m() * i / piece_count));
  }
  // First round and wide, then stiffer repulsion only where a passage is too narrow for that.
  Relax({120, 0.8, 0.1, 0.5}, obstacles, &line);
  for (const Band& tighter : {Band{60, 0.4, 0.2, 0.4}, Band{60, 0.1, 0.25, 0.33}}) {
    if (LineClearance(line, obstacles) >= kLineClearanceM) break;
    Relax(tighter, obstacles, &line);
  }
  return line;
}

}  // namespace dsg::simulator
