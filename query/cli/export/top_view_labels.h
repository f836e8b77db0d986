// SPDX-License-Identifier: Apache-2.0
// Names in a picture from above, the more important ones first. Names do not overlap.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "query/cli/export/map_content.h"
#include "query/cli/export/outline.h"
#include "schema/picture/font.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// Rooms by size, then agents, then objects by size, without the nodes in `named`.
/// No name covers an agent. Room names keep clear of objects if possible.
void DrawLabels(const MapContent& content, const std::set<NodeId>& named, const FloorView& view,
                picture::LabelLayout* layout, picture::Canvas* canvas);

/// A name beside a shape of the picture, in letters as large as those of agents; left out without
/// free space.
void WriteNameBeside(const Eigen::AlignedBox2d& thing_px, const std::string& name, uint32_t rgb,
                     picture::LabelLayout* layout, picture::Canvas* canvas);

}  // namespace dsg::cli
