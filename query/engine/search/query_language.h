// SPDX-License-Identifier: Apache-2.0
// The query language of docs/search.md: text to pattern and back.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "query/engine/search/pattern.h"

namespace dsg::query {

/// Reads the query language of docs/search.md.
/// Errors: QUERY_MALFORMED with `position` (bytes) and `expected`; the message shows the line.
absl::StatusOr<NodePattern> ParseQuery(std::string_view text);

/// The one way to write a pattern; parses back to the same.
std::string FormatQuery(const NodePattern& pattern);

}  // namespace dsg::query
