// SPDX-License-Identifier: Apache-2.0
// The early Kimera form: nodes with index and type, edges with a relation in words.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "schema/interop/scene_graph_file.h"

namespace dsg {

/// Ids are the type's letter (O, p, R, B) and the node's index; the file's node_id, which is not
/// unique, becomes an attribute. "At Location" becomes CONTAINS from the end to the start; "Near"
/// becomes TRAVERSABLE, ADJACENT or NEAR; another word stays as it is.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `file` and the field.
absl::StatusOr<ImportedGraph> ReadKimeraJson(const nlohmann::json& root, const std::string& file);

}  // namespace dsg
