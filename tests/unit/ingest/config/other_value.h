// SPDX-License-Identifier: Apache-2.0
// Another value of an option, for tests that change one at a time.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

/// In the range of the option, and on the right side of the other end of a range in `all`.
inline double OtherValue(const BoundOption& field, const std::vector<BoundOption>& all) {
  const auto is_end = [](const char* end, const BoundOption& of) {
    return end != nullptr && std::string_view(end) == of.name;
  };
  double low = field.min;
  double high = field.max;
  for (const BoundOption& other : all) {
    if (is_end(field.lower_end, other)) low = std::max(low, other.Get());
    if (is_end(other.lower_end, field)) high = std::min(high, other.Get());
  }
  return field.Get() == high ? low : high;
}

}  // namespace dsg::ingest
