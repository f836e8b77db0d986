// SPDX-License-Identifier: Apache-2.0
// The digest of a scene graph as regions and labelled objects with centres, without geometry.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "schema/interop/scene_graph_file.h"

namespace dsg {

/// Regions "R(1)" become rooms and objects "O(2)" objects, each under its parent region. Centres
/// are "(x, y)"; z is 0, which a note says.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `file` and the field.
absl::StatusOr<ImportedGraph> ReadRegionJson(const nlohmann::json& root, const std::string& file);

}  // namespace dsg
