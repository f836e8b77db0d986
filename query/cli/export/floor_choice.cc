// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/floor_choice.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

constexpr double kAroundHeightM = 1.5;

HeightRange HeightsOf(const Node& node) {
  if (node.region.has_value() && node.region->z_max_m > node.region->z_min_m) {
    return {node.region->z_min_m, node.region->z_max_m};
  }
  const Box3d box = node.BoxMap();
  return {box.min().z(), box.max().z()};
}

HeightRange HeightsAround(const MapContent& content, double z_m) {
  HeightRange around{z_m, z_m};
  bool has_room = false;
  for (const Node& node : content.nodes) {
    if (node.kind != kinds::kRoom) continue;
    const HeightRange heights = HeightsOf(node);
    if (heights.high_m <= heights.low_m || !heights.Contains(z_m)) continue;
    around = {std::min(around.low_m, heights.low_m), std::max(around.high_m, heights.high_m)};
    has_room = true;
  }
  return has_room ? around : HeightRange{z_m - kAroundHeightM, z_m + kAroundHeightM};
}

double MiddleHeight(const Node& node) {
  if (!node.region.has_value()) return MiddleOf(node).z();
  const HeightRange heights = HeightsOf(node);
  return 0.5 * (heights.low_m + heights.high_m);
}

using Points = std::vector<Eigen::Vector3d>;

// Where things that stand or lie on the floor are, with the errors of their heights.
HeightRange Standing(const HeightRange& floor) {
  constexpr double kErrorM = 0.3;
  return {floor.low_m - kErrorM, floor.high_m};
}

// The pieces of a way on the floor; a way that leaves and comes back is cut.
std::vector<Points> PiecesOn(const HeightRange& floor, const Points& way) {
  std::vector<Points> pieces;
  bool is_inside = false;
  for (const Eigen::Vector3d& point : way) {
    const bool was_inside = is_inside;
    is_inside = Standing(floor).Contains(point.z());
    if (is_inside && !was_inside) pieces.emplace_back();
    if (is_inside) pieces.back().push_back(point);
  }
  return pieces;
}

Track TrackOn(const HeightRange& floor, const Track& track) {
  Track kept{.agent = track.agent, .pieces = {}};
  for (const Points& piece : track.pieces) {
    for (Points& part : PiecesOn(floor, piece)) kept.pieces.push_back(std::move(part));
  }
  return kept;
}

}  // namespace

absl::StatusOr<HeightRange> ChooseFloor(const MapContent& content, const std::string& floor) {
  for (const Node& node : content.nodes) {
    if (ToString(node.id) == floor || node.name == floor) return HeightsOf(node);
  }
  double z_m = 0.0;
  if (absl::SimpleAtod(floor, &z_m) && std::isfinite(z_m)) return HeightsAround(content, z_m);
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("--floor \"", floor,
                                "\": no node has this id or name; give a level or room (dsg ls "
                                "--kind room) or a height in metres"),
                   {{"field", "--floor"}, {"value", floor}});
}

void KeepFloor(const HeightRange& floor, MapContent* content) {
  std::unordered_set<NodeId> kept;
  for (const Track& track : content->tracks) kept.insert(track.agent);
  std::erase_if(content->nodes, [&](const Node& node) {
    if (kept.contains(node.id)) return false;
    if (!floor.Contains(MiddleHeight(node))) return true;
    kept.insert(node.id);
    return false;
  });
  std::erase_if(content->edges, [&](const Edge& edge) {
    return !kept.contains(edge.source) || !kept.contains(edge.target);
  });
  for (Track& track : content->tracks) track = TrackOn(floor, track);
  std::erase_if(content->tracks, [](const Track& track) { return track.pieces.empty(); });
  for (MeshBlock& block : content->mesh) {
    std::erase_if(block.faces, [&](const std::array<uint32_t, 3>& face) {
      return std::none_of(face.begin(), face.end(), [&](uint32_t vertex) {
        return floor.Contains(static_cast<double>(block.positions_map[vertex].z()));
      });
    });
  }
}

void KeepFloor(const HeightRange& floor, Overlay* overlay) {
  const HeightRange heights = Standing(floor);
  std::vector<OverlayLine> lines;
  for (const OverlayLine& line : overlay->lines) {
    for (Points& piece : PiecesOn(floor, line.points_map)) {
      OverlayLine& kept = lines.emplace_back(line);
      kept.points_map = std::move(piece);
    }
  }
  overlay->lines = std::move(lines);
  std::erase_if(overlay->marks,
                [&](const OverlayMark& mark) { return !heights.Contains(mark.position_map.z()); });
  std::erase_if(overlay->outlines,
                [&](const OverlayOutline& outline) { return !heights.Contains(outline.height_m); });
}

}  // namespace dsg::cli
