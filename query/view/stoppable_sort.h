// SPDX-License-Identifier: Apache-2.0
// Sorts that can be stopped half way, for the millions of entries of a large map. A stopped sort
// leaves its input in no useful order.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "schema/base/status.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

/// Sorted runs of a few thousand, merged pairwise.
/// Errors: what `stop` returned; `items` may then be in any state.
template <typename Item, typename Less>
absl::Status SortStoppably(const Less& less, const StopCheck& stop, std::vector<Item>* items) {
  constexpr size_t kRun = 4096;
  if (std::is_sorted(items->begin(), items->end(), less)) return absl::OkStatus();
  const size_t size = items->size();
  const auto at = [](std::vector<Item>* all, size_t i) {
    return all->begin() + static_cast<std::ptrdiff_t>(std::min(i, all->size()));
  };
  for (size_t begin = 0; begin < size; begin += kRun) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    std::sort(at(items, begin), at(items, begin + kRun), less);
  }
  StopCounter counter(stop);
  std::vector<Item> merged;
  for (size_t width = kRun; width < size; width *= 2) {
    merged.clear();
    merged.reserve(size);
    for (size_t begin = 0; begin < size; begin += 2 * width) {
      auto left = at(items, begin);
      const auto left_end = at(items, begin + width);
      auto right = left_end;
      const auto right_end = at(items, begin + 2 * width);
      while (left != left_end || right != right_end) {
        DSG_RETURN_IF_ERROR(counter.Check());
        const bool is_right = left == left_end || (right != right_end && less(*right, *left));
        merged.push_back(std::move(is_right ? *right++ : *left++));
      }
    }
    items->swap(merged);
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
