// SPDX-License-Identifier: Apache-2.0
// Sets that merge, for telling which poses hang together.
// Refuses to split a set again.
#pragma once

#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace dsg::ingest {

/// Disjoint sets of 0 ... count-1.
class DisjointSets {
 public:
  explicit DisjointSets(size_t count) : above_(count) {
    std::iota(above_.begin(), above_.end(), 0);
  }

  /// The member that stands for the set.
  int Find(int member) {
    while (above_[static_cast<size_t>(member)] != member) {
      int& above = above_[static_cast<size_t>(member)];
      above = above_[static_cast<size_t>(above)];
      member = above;
    }
    return member;
  }

  /// False if they are in one set already. The lowest member of a set stands for it.
  bool Merge(int a, int b) {
    a = Find(a);
    b = Find(b);
    if (a == b) return false;
    if (a > b) std::swap(a, b);
    above_[static_cast<size_t>(b)] = a;
    return true;
  }

 private:
  std::vector<int> above_;
};

}  // namespace dsg::ingest
