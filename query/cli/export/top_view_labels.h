// SPDX-License-Identifier: Apache-2.0
// Names in a picture from above, the more important ones first.
// Refuses to write a name that would touch another.
#pragma once

#include <string>
#include <vector>

#include "query/cli/export/floor_view.h"
#include "query/cli/export/map_content.h"
#include "schema/picture/label_layout.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// Rooms by size, then agents, then objects by size. Room names keep clear of objects where they
/// can.
void DrawLabels(const MapContent& content, const FloorView& view, picture::LabelLayout* layout,
                picture::Canvas* canvas);

}  // namespace dsg::cli
