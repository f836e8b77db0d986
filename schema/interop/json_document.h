// SPDX-License-Identifier: Apache-2.0
// JSON text into a tree, with every size bounded. Refuses what two readers could read differently.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg {

/// Deeper nesting is refused: no scene graph needs it, and walking it would eat the stack.
inline constexpr size_t kJsonDepthMax = 64;

/// More values than this would need several GiB as a tree; W2 (120,101 nodes) has 12 million.
inline constexpr size_t kJsonValueCountMax = 50'000'000;

/// Parses one JSON value that spans all of `bytes`. 64-bit integers stay exact.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `file` and the byte offset or the repeated key:
/// malformed or cut text, text that is not UTF-8, duplicate keys, numbers beyond a double, nesting
/// beyond kJsonDepthMax, more than kJsonValueCountMax values.
absl::StatusOr<nlohmann::json> ParseJson(std::string_view bytes, const std::string& file);

}  // namespace dsg
