// SPDX-License-Identifier: Apache-2.0
// Whether a YAML text goes on after its first document, of which parsers say nothing.
// Refuses to parse: marks of documents stand at the beginning of a line, whatever is around them.
#pragma once

#include <optional>
#include <string_view>

namespace dsg {

/// The line, counted from 0, at which a second document begins; nullopt if none does.
std::optional<int> FindSecondDocument(std::string_view text);

}  // namespace dsg
