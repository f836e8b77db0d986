// SPDX-License-Identifier: Apache-2.0
// Disjoint sets of small integers, merged step by step (union-find).
#pragma once

#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace dsg {

/// Sets over the members 0 ... count-1. The lowest member of a set is its representative, so
/// results do not depend on the order of the merges.
///
/// Threads: one caller at a time; Find shortens paths.
/// Cost: amortised logarithmic per call.
class DisjointSets {
 public:
  /// Each member is a set of its own.
  explicit DisjointSets(size_t count = 0) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  /// Adds a member as a set of its own, and returns it.
  int Add() {
    parent_.push_back(static_cast<int>(parent_.size()));
    return parent_.back();
  }

  /// The representative of the set that holds `member`.
  int Find(int member) {
    while (parent_[static_cast<size_t>(member)] != member) {
      int& parent = parent_[static_cast<size_t>(member)];
      parent = parent_[static_cast<size_t>(parent)];
      member = parent;
    }
    return member;
  }

  /// Returns false if both members are in one set already.
  bool Merge(int a, int b) {
    a = Find(a);
    b = Find(b);
    if (a == b) return false;
    if (a > b) std::swap(a, b);
    parent_[static_cast<size_t>(b)] = a;
    return true;
  }

  size_t size() const { return parent_.size(); }

 private:
  std::vector<int> parent_;
};

}  // namespace dsg
