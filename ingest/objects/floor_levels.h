// SPDX-License-Identifier: Apache-2.0
// The heights at which a mesh has large horizontal surfaces to stand on.
// Refuses to count the tops of objects.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/objects/object_options.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// Ascending, one for each storey. By vertices that look up and whose class is not among
/// `class_ids` (ascending); without normals, by all of these, which adds ceilings.
std::vector<double> FindFloorLevels(const std::vector<const MeshBlock*>& mesh,
                                    const std::vector<int32_t>& class_ids,
                                    const FloorLevelOptions& options = {});

/// The highest level that is not above `z_m` by more than a step.
std::optional<double> FloorBelow(const std::vector<double>& levels, double z_m,
                                 const FloorLevelOptions& options = {});

}  // namespace dsg::ingest
