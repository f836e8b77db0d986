// SPDX-License-Identifier: Apache-2.0
// JSON text into a tree, with every size bounded. Refuses what two readers could read differently.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/interop/json_cursor.h"

namespace dsg {

/// Parses one JSON value that spans all of `bytes`. 64-bit integers stay exact.
///
/// Errors: as JsonCursor.
absl::StatusOr<nlohmann::json> ParseJson(std::string_view bytes, const std::string& file);

}  // namespace dsg
