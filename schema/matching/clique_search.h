// SPDX-License-Identifier: Apache-2.0
// Branch and bound for the largest clique of one small graph.
// Refuses to order or prune the graph first: max_clique.h does.
#pragma once

#include <cstdint>
#include <vector>

#include "schema/matching/bitset_graph.h"

namespace dsg {

/// Counts work down to nothing, so that a search ends at the same place on every machine.
class StepBudget {
 public:
  explicit StepBudget(int64_t step_count_max) : left_(step_count_max), max_(step_count_max) {}
  void Spend(int64_t step_count) { left_ -= step_count; }
  bool IsSpent() const { return left_ < 0; }
  int64_t spent() const { return max_ - left_; }

 private:
  int64_t left_;
  int64_t max_;
};

/// Looks for a clique of more than `size_above` vertices. Vertices coloured first are those of low
/// number, so that the best order is by falling degree.
class CliqueSearch {
 public:
  CliqueSearch(const BitsetGraph& graph, int size_above, StepBudget* budget)
      : graph_(graph), best_size_(size_above), budget_(budget) {}

  /// The largest clique of more than `size_above` vertices, or nothing.
  std::vector<int> Run();

 private:
  // One depth of the search: candidates, and those worth trying with their colours, ascending.
  struct Level {
    std::vector<Word> candidates;
    std::vector<int> vertices;
    std::vector<int> colors;
  };

  void Expand(size_t depth);
  void Color(Level* level, int color_min);
  Level& LevelAt(size_t depth);

  const BitsetGraph& graph_;
  int best_size_;
  StepBudget* budget_;
  std::vector<Level> levels_;
  std::vector<Word> uncolored_;
  std::vector<Word> color_class_;
  std::vector<int> current_;
  std::vector<int> best_;
};

}  // namespace dsg
