// SPDX-License-Identifier: Apache-2.0
// A small map with one of everything, for tests of what is written and drawn.
#pragma once

#include "query/cli/export/map_content.h"

namespace dsg::test {

/// Room R1 (a square footprint, x and y 0 to 4, z 0 to 3), named in UTF-8 with quotes; room R2
/// (a box, x 4 to 8); places p1, p2 joined by TRAVERSABLE; object O1 of class 3 "chair", turned by
/// 30 degrees; a wall; human H1 who walked with a gap; two mesh blocks that join at x = 2.
cli::MapContent ExampleContent();

/// Two triangles in the plane z = 0, of label 3 and instance 9, without normals and colours.
MeshBlock FlatBlock(int32_t x);

}  // namespace dsg::test
