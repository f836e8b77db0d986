// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/openings.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "query/cli/export/outline.h"

namespace dsg::cli {
namespace {

constexpr double kHalfMinM = 0.25;
constexpr double kHalfMaxM = 0.6;
// Places may lie at the floor's height, and walls begin a little above it.
constexpr double kHeightSlackM = 0.5;
constexpr double kPieceMinM = 0.02;

// Between the middles of the two shorter sides of its box, where it lies along it.
std::optional<WallLine> LineOf(const Node& wall) {
  const std::vector<Eigen::Vector2d> slanted = SlantedWall(wall);
  if (!slanted.empty()) return WallLine{slanted[0], slanted[1], 0.0};
  const Polygon2d outline = FloorOutline(wall);
  if (outline.size() == 2) return WallLine{outline[0], outline[1], 0.0};
  if (outline.size() != 4) return std::nullopt;
  const double first_m = (outline[1] - outline[0]).norm();
  const double second_m = (outline[2] - outline[1]).norm();
  const size_t end = first_m < second_m ? 0 : 1;
  return WallLine{0.5 * (outline[end] + outline[end + 1]),
                  0.5 * (outline[end + 2] + outline[(end + 3) % 4]), std::min(first_m, second_m)};
}

// How far along the wall the way crosses it.
std::optional<double> CrossingM(const WallLine& wall, const Eigen::Vector2d& from,
                                const Eigen::Vector2d& to) {
  const double length_m = (wall.to - wall.from).norm();
  const Eigen::Vector2d along = (wall.to - wall.from) / length_m;
  const double before_m = Cross(along, from - wall.from);
  const double behind_m = Cross(along, to - wall.from);
  if ((before_m < 0.0) == (behind_m < 0.0)) return std::nullopt;
  const Eigen::Vector2d at = from + before_m / (before_m - behind_m) * (to - from);
  const double at_m = along.dot(at - wall.from);
  if (at_m < 0.0 || at_m > length_m) return std::nullopt;
  return at_m;
}

// Between intervals along the wall.
std::vector<WallLine> Between(const WallLine& wall, std::vector<std::pair<double, double>> open) {
  std::sort(open.begin(), open.end());
  const double length_m = (wall.to - wall.from).norm();
  const Eigen::Vector2d along = (wall.to - wall.from) / length_m;
  open.emplace_back(length_m, length_m);
  std::vector<WallLine> pieces;
  double begin_m = 0.0;
  for (const auto& [from_m, to_m] : open) {
    if (from_m - begin_m > kPieceMinM) {
      pieces.push_back({wall.from + begin_m * along, wall.from + from_m * along, wall.thickness_m});
    }
    begin_m = std::max(begin_m, to_m);
  }
  return pieces;
}

}  // namespace

Openings::Openings(const MapContent& content) {
  const std::unordered_map<NodeId, const Node*> nodes = NodesById(content);
  for (const Edge& edge : content.edges) {
    if (edge.relation != relations::kTraversable) continue;
    const Eigen::Vector3d from = MiddleOf(*nodes.at(edge.source));
    const Eigen::Vector3d to = MiddleOf(*nodes.at(edge.target));
    ways_.push_back({from.head<2>(), to.head<2>(), 0.5 * (from.z() + to.z()),
                     std::clamp(edge.weight, kHalfMinM, kHalfMaxM)});
    reach_m_ = std::max(reach_m_, std::abs(to.x() - from.x()));
  }
  std::sort(ways_.begin(), ways_.end(),
            [](const Way& a, const Way& b) { return a.low_x() < b.low_x(); });
}

std::optional<std::vector<WallLine>> Openings::PiecesOf(const Node& wall) const {
  const std::optional<WallLine> line = LineOf(wall);
  if (!line.has_value() || line->from == line->to) return std::nullopt;
  const Box3d box_map = wall.BoxMap();
  const double low_x = std::min(line->from.x(), line->to.x()) - reach_m_;
  const double high_x = std::max(line->from.x(), line->to.x());
  const auto first = std::partition_point(ways_.begin(), ways_.end(),
                                          [=](const Way& way) { return way.low_x() < low_x; });
  std::vector<std::pair<double, double>> open;
  for (auto way = first; way != ways_.end() && way->low_x() <= high_x; ++way) {
    const bool is_beside =
        way->height_m > box_map.min().z() - kHeightSlackM && way->height_m < box_map.max().z();
    const auto at_m = is_beside ? CrossingM(*line, way->from, way->to) : std::nullopt;
    if (at_m.has_value()) open.emplace_back(*at_m - way->clear_m, *at_m + way->clear_m);
  }
  if (open.empty()) return std::nullopt;
  return Between(*line, std::move(open));
}

}  // namespace dsg::cli
