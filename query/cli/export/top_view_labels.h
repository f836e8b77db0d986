// SPDX-License-Identifier: Apache-2.0
// Names in a picture from above, the more important ones first.
// Refuses to write a name that would touch another.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "query/cli/export/floor_view.h"
#include "query/cli/export/map_content.h"
#include "schema/picture/font.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// Rooms by size, then agents, then objects by size, but for the nodes that are `named` already.
/// Room names keep clear of objects where they can.
void DrawLabels(const MapContent& content, const std::set<NodeId>& named, const FloorView& view,
                picture::LabelLayout* layout, picture::Canvas* canvas);

/// A name beside a thing of the picture, in letters as large as those of agents; not written where
/// all room is taken.
void WriteNameBeside(const Eigen::AlignedBox2d& thing_px, const std::string& name, uint32_t rgb,
                     picture::LabelLayout* layout, picture::Canvas* canvas);

}  // namespace dsg::cli
