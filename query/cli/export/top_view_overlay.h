// SPDX-License-Identifier: Apache-2.0
// Draws what an answer adds to the picture of a map.
// Refuses to hide it: the map below is paled, and no name covers a way.
#pragma once

#include "query/cli/export/floor_view.h"
#include "query/cli/export/overlay.h"
#include "schema/picture/font.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// Everything that is drawn, from above; empty if nothing is.
Eigen::AlignedBox2d BoundsOf(const Overlay& overlay);

/// Lines, outlines and marks, without their labels; takes their room in `layout`.
void DrawOverlay(const Overlay& overlay, const FloorView& view, picture::LabelLayout* layout,
                 picture::Canvas* canvas);

/// Labels of the marks, in their order; call before other names are written.
void DrawOverlayLabels(const Overlay& overlay, const FloorView& view, picture::LabelLayout* layout,
                       picture::Canvas* canvas);

/// One row; keys that find no room before `x_end` are left out.
void DrawOverlayLegend(const Overlay& overlay, const Eigen::Vector2d& low, double x_end,
                       picture::Canvas* canvas);

}  // namespace dsg::cli
