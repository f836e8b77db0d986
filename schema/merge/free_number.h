// SPDX-License-Identifier: Apache-2.0
// A number for something new among things that are numbered.
// Refuses to run over: where the largest number is taken, it looks for a gap.
#pragma once

#include <algorithm>
#include <limits>
#include <set>

namespace dsg::merge {

/// Above all that are used or, where those reach up to the largest number, the least that is free;
/// from 1.
template <typename Number>
Number FreeNumber(const std::set<Number>& used) {
  if (used.empty()) return 1;
  if (*used.rbegin() < std::numeric_limits<Number>::max()) {
    return std::max<Number>(0, *used.rbegin()) + 1;
  }
  Number free = 1;
  while (used.contains(free)) ++free;
  return free;
}

}  // namespace dsg::merge
