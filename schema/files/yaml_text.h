// SPDX-License-Identifier: Apache-2.0
// What is to be known of YAML text before yaml-cpp parses it.
#pragma once

#include <optional>
#include <string_view>

namespace dsg {

/// The line, counted from 0, at which a second document begins; nullopt if none does. YAML::Load
/// reads the first document and ignores what follows; YAML::LoadAll does not end on all texts.
std::optional<int> FindSecondYamlDocument(std::string_view text);

/// Whether YAML nests deeper than a file for people does: the parser recurses as deep.
bool YamlNestsTooDeep(std::string_view text);

}  // namespace dsg
