// SPDX-License-Identifier: Apache-2.0
// A map with its layers one above the other, as a picture for people: mesh, objects and agents,
// places and structures, rooms, building, and what contains what.
#pragma once

#include <string>
#include <vector>

#include "query/cli/export/map_content.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

struct ExplodedOptions {
  /// kTopViewWidthMin to kTopViewWidthMax. The height follows, at most kTopViewWidthMax.
  int width_px = 1600;
  std::string title;
};

/// Seen obliquely from the south and above; layers without nodes are left out. An empty map gives a
/// title on empty paper.
/// Source: RSS 2020, figure 1.
picture::Picture DrawExplodedView(const MapContent& content, const ExplodedOptions& options);

/// A map and what is written above it.
struct TitledMap {
  const MapContent& content;
  std::string title;
};

/// Only the meshes, in the colours that they have, seen in the same way from the same place and
/// side by side in a picture of `width_px`. Requires: at least one map.
/// Source: RSS 2020, figure 5.
picture::Picture DrawMeshes(const std::vector<TitledMap>& maps, int width_px);

}  // namespace dsg::cli
