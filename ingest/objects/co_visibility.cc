// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "ingest/objects/relations.h"

namespace dsg::ingest {
namespace {

// Of one picture; a picture of more is of a store of labels gone wrong, and pairs are its square.
constexpr size_t kVisibleCountMax = 256;

using Pair = CoVisibility::Pair;

bool IsBefore(const Pair& a, const Pair& b) {
  return std::tie(a.first, a.second) < std::tie(b.first, b.second);
}

bool IsSame(const Pair& a, const Pair& b) { return a.first == b.first && a.second == b.second; }

std::vector<Pair> PairsOf(const std::vector<int64_t>& visible) {
  std::vector<Pair> pairs;
  const size_t count = std::min(visible.size(), kVisibleCountMax);
  for (size_t i = 0; i < count; ++i) {
    for (size_t j = i + 1; j < count; ++j) {
      if (visible[i] < visible[j]) pairs.push_back({visible[i], visible[j], 1});
    }
  }
  return pairs;
}

/// Adds up what is twice in sorted pairs.
void AddUp(std::vector<Pair>* pairs) {
  size_t kept = 0;
  for (size_t i = 0; i < pairs->size(); ++i) {
    if (kept > 0 && IsSame((*pairs)[kept - 1], (*pairs)[i])) {
      (*pairs)[kept - 1].picture_count += (*pairs)[i].picture_count;
    } else {
      (*pairs)[kept++] = (*pairs)[i];
    }
  }
  pairs->resize(kept);
}

}  // namespace

void CoVisibility::Observe(const std::vector<int64_t>& visible) {
  std::vector<Pair> added = PairsOf(visible);
  const auto is_known = [&](const Pair& pair) {
    const auto found = std::lower_bound(pairs_.begin(), pairs_.end(), pair, IsBefore);
    if (found == pairs_.end() || !IsSame(*found, pair)) return false;
    ++found->picture_count;
    return true;
  };
  std::erase_if(added, is_known);
  if (added.empty()) return;
  const auto middle = pairs_.insert(pairs_.end(), added.begin(), added.end());
  std::inplace_merge(pairs_.begin(), middle, pairs_.end(), IsBefore);
  AddUp(&pairs_);
  if (pairs_.size() > kPairCountMax) ForgetRarest();
}

void CoVisibility::ForgetRarest() {
  std::vector<int64_t> counts;
  counts.reserve(pairs_.size());
  for (const Pair& pair : pairs_) counts.push_back(pair.picture_count);
  const auto middle = counts.begin() + static_cast<int64_t>(counts.size() / 2);
  std::nth_element(counts.begin(), middle, counts.end());
  const int64_t threshold = *middle;
  std::erase_if(pairs_, [&](const Pair& pair) { return pair.picture_count <= threshold; });
}

void CoVisibility::Merge(int64_t from, int64_t to) {
  if (from == to) return;
  for (Pair& pair : pairs_) {
    if (pair.first == from) pair.first = to;
    if (pair.second == from) pair.second = to;
    if (pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  std::erase_if(pairs_, [](const Pair& pair) { return pair.first == pair.second; });
  std::sort(pairs_.begin(), pairs_.end(), IsBefore);
  AddUp(&pairs_);
}

void CoVisibility::Forget(int64_t id) {
  std::erase_if(pairs_, [&](const Pair& pair) { return pair.first == id || pair.second == id; });
}

std::vector<CoVisibility::Pair> CoVisibility::Pairs(int64_t picture_count_min,
                                                    int partner_count_max) const {
  std::vector<Pair> frequent;
  for (const Pair& pair : pairs_) {
    if (pair.picture_count >= picture_count_min) frequent.push_back(pair);
  }
  std::vector<size_t> order(frequent.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return frequent[a].picture_count > frequent[b].picture_count;
  });
  // A pair stays when it is among the most frequent ones of either partner.
  std::map<int64_t, int> partner_count;
  std::vector<Pair> kept;
  for (const size_t i : order) {
    int& first = partner_count[frequent[i].first];
    int& second = partner_count[frequent[i].second];
    if (first >= partner_count_max && second >= partner_count_max) continue;
    ++first;
    ++second;
    kept.push_back(frequent[i]);
  }
  std::sort(kept.begin(), kept.end(), IsBefore);
  return kept;
}

}  // namespace dsg::ingest
