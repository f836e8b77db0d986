// SPDX-License-Identifier: Apache-2.0
// The mesh as a pale ground for a picture from above.
#pragma once

#include <vector>

#include "query/cli/export/floor_view.h"
#include "schema/model/mesh.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// Cut at breast height above its floor, so that neither ceilings nor lamps hide the rooms.
void DrawMesh(const std::vector<MeshBlock>& mesh, const FloorView& view, picture::Canvas* canvas);

}  // namespace dsg::cli
