// SPDX-License-Identifier: Apache-2.0
// Colours by name: every colour has exactly one of twelve, by boxes of hue, saturation and value.
// Refuses shades: a caller who needs them compares the numbers.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "schema/model/node.h"

namespace dsg::query {

/// All names, in the order in which people are told them.
const std::vector<std::string>& ColorNames();

/// The name as ColorNames has it, for spellings such as "Gray"; empty if it is no colour.
std::string CanonicalColor(std::string_view word);

/// Alpha is not looked at.
std::string_view NameOfColor(const Color& color);

}  // namespace dsg::query
