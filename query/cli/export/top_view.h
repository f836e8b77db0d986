// SPDX-License-Identifier: Apache-2.0
// A map from above, as a picture for people: floors, walls, places, objects, tracks, names, and the
// axes of the map frame in metres. Names do not overlap: a name without free space is left out.
#pragma once

#include <string>

#include "query/cli/export/map_content.h"
#include "query/cli/export/overlay.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

inline constexpr int kTopViewWidthMin = 200;
inline constexpr int kTopViewWidthMax = 4096;

struct TopViewOptions {
  /// kTopViewWidthMin to kTopViewWidthMax. The height follows, at most twice the width and
  /// kTopViewWidthMax.
  int width_px = 1600;
  std::string title;
  /// Drawn over the map, which is then paled.
  Overlay overlay{};
};

/// An empty map gives a title on empty paper.
picture::Picture DrawTopView(const MapContent& content, const TopViewOptions& options);

}  // namespace dsg::cli
