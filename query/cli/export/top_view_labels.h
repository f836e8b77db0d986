// SPDX-License-Identifier: Apache-2.0
// Names in a picture from above, the more important ones first. Names do not overlap.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "query/cli/export/map_content.h"
#include "query/cli/export/outline.h"
#include "schema/picture/font.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// Of names of agents and of marks.
inline constexpr double kAgentDotPx = 3.0;

/// A name in a picture.
struct Label {
  std::string text;
  double dot_px = 2.0;
  uint32_t rgb = 0x20242e;

  /// With its background.
  Eigen::Vector2d Size() const;
  Eigen::AlignedBox2d At(const Eigen::Vector2d& middle) const;
};

/// Rooms by size, then agents, then objects by size, without the nodes in `named`.
/// No name covers an agent. Room names keep clear of objects if possible.
void DrawLabels(const MapContent& content, const std::set<NodeId>& named, const FloorView& view,
                picture::LabelLayout* layout, picture::Canvas* canvas);

/// A name on a pale background beside a shape of the picture; a line leads to one that is further
/// away. Returns its spot, which is blocked in the layout; nothing is written without free space.
std::optional<Eigen::AlignedBox2d> WriteNameBeside(const Eigen::AlignedBox2d& thing_px,
                                                   const Label& label, picture::LabelLayout* layout,
                                                   picture::Canvas* canvas);

}  // namespace dsg::cli
