// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/max_clique.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "schema/matching/clique_search.h"

namespace dsg {
namespace {

constexpr int kGreedyStartCount = 50;
// Counting the neighbours of a vertex takes as long as colouring several.
constexpr int kDegreeStepCount = 4;

// Members of `row` that are in `set` too, as numbers within the set.
class Ranks {
 public:
  Ranks(const Word* set, int word_count) : set_(set), word_count_(word_count), before_(word_count) {
    for (int w = 0, count = 0; w < word_count; ++w) {
      before_[w] = count;
      count += __builtin_popcountll(set[w]);
    }
  }
  int Of(int member) const {
    const int w = member / kWordBits;
    const Word below = (Word{1} << (member % kWordBits)) - 1;
    return before_[w] + __builtin_popcountll(set_[w] & below);
  }
  int word_count() const { return word_count_; }

 private:
  const Word* set_;
  int word_count_;
  std::vector<int> before_;
};

class MaxCliqueFinder {
 public:
  MaxCliqueFinder(const BitsetGraph& graph, const CliqueOptions& options)
      : graph_(graph),
        budget_(options.step_count_max),
        degeneracy_(FindDegeneracy(graph)),
        best_size_(options.size_above) {}

  Clique Run() {
    FindGreedily();
    SearchExactly();
    Clique clique;
    clique.vertices = best_;
    std::sort(clique.vertices.begin(), clique.vertices.end());
    clique.is_maximal = !budget_.IsSpent();
    clique.step_count = budget_.spent();
    return clique;
  }

 private:
  void Keep(std::vector<int> vertices) {
    if (static_cast<int>(vertices.size()) <= best_size_) return;
    best_size_ = static_cast<int>(vertices.size());
    best_ = std::move(vertices);
  }

  void FindGreedily() {
    const std::vector<int>& order = degeneracy_.order;
    const int start_count = std::min(kGreedyStartCount, graph_.vertex_count());
    for (int i = 0; i < start_count; ++i) {
      const int start = order[order.size() - 1 - static_cast<size_t>(i)];
      if (degeneracy_.core[start] < best_size_ || budget_.IsSpent()) return;
      Keep(GrowFrom(start));
    }
  }

  // Adds the candidate with the most neighbours among the candidates, over and over.
  std::vector<int> GrowFrom(int start) {
    const int word_count = graph_.word_count();
    std::vector<int> clique = {start};
    std::vector<Word> candidates(graph_.Row(start), graph_.Row(start) + word_count);
    while (true) {
      const int best = BestCandidate(candidates);
      if (best < 0) return clique;
      clique.push_back(best);
      const Word* row = graph_.Row(best);
      for (int w = 0; w < word_count; ++w) candidates[w] &= row[w];
    }
  }

  int BestCandidate(const std::vector<Word>& candidates) {
    const int word_count = graph_.word_count();
    const int candidate_count = BitCount(candidates.data(), word_count);
    int best = -1;
    int best_degree = -1;
    ForEachBit(candidates.data(), word_count, [&](int vertex) {
      // Nobody has more neighbours than all the others.
      if (best_degree == candidate_count - 1) return;
      const Word* row = graph_.Row(vertex);
      int degree = 0;
      for (int w = 0; w < word_count; ++w) degree += __builtin_popcountll(candidates[w] & row[w]);
      budget_.Spend(kDegreeStepCount);
      if (degree <= best_degree) return;
      best = vertex;
      best_degree = degree;
    });
    return best;
  }

  // Every clique has a first vertex in degeneracy order, and the others among its later neighbours.
  // Late vertices come first: their few candidates are the densest part of the graph.
  void SearchExactly() {
    const std::vector<int>& order = degeneracy_.order;
    std::vector<Word> later(graph_.word_count(), 0);
    std::vector<Word> candidates(graph_.word_count());
    for (size_t i = order.size(); i-- > 0;) {
      const int vertex = order[i];
      // Cores only fall from here on.
      if (degeneracy_.core[vertex] < best_size_ || budget_.IsSpent()) return;
      const Word* row = graph_.Row(vertex);
      for (int w = 0; w < graph_.word_count(); ++w) candidates[w] = row[w] & later[w];
      SearchAmong(vertex, &candidates);
      SetBit(later.data(), vertex);
    }
  }

  void SearchAmong(int first, std::vector<Word>* candidates) {
    // A better clique would need as many colours as it has members. Most vertices end here, before
    // anything is copied.
    if (HasColoring(*candidates, best_size_ - 1)) return;
    std::vector<int> members = PruneByDegree(candidates);
    if (static_cast<int>(members.size()) < best_size_) return;
    const BitsetGraph part = Part(*candidates, members);
    CliqueSearch search(part, best_size_ - 1, &budget_);
    std::vector<int> found = search.Run();
    if (found.empty()) return;
    for (int& vertex : found) vertex = members[vertex];
    found.push_back(first);
    Keep(std::move(found));
  }

  // Whether a greedy colouring takes no more than so many colours.
  bool HasColoring(const std::vector<Word>& candidates, int color_count) {
    const int word_count = graph_.word_count();
    std::vector<Word> uncolored = candidates;
    std::vector<Word> color_class;
    for (int color = 0; color < color_count; ++color) {
      color_class = uncolored;
      for (int w = 0; w < word_count; ++w) {
        while (color_class[w] != 0) {
          const int vertex = w * kWordBits + LowestBit(color_class[w]);
          const Word* row = graph_.Row(vertex);
          ClearBit(uncolored.data(), vertex);
          ClearBit(color_class.data(), vertex);
          for (int i = w; i < word_count; ++i) color_class[i] &= ~row[i];
          budget_.Spend(1);
        }
      }
      if (std::all_of(uncolored.begin(), uncolored.end(), [](Word word) { return word == 0; })) {
        return true;
      }
    }
    return false;
  }

  // Takes away candidates with too few neighbours among the candidates, once through; returns the
  // others by falling degree.
  std::vector<int> PruneByDegree(std::vector<Word>* candidates) {
    const int word_count = graph_.word_count();
    std::vector<std::pair<int, int>> by_degree;
    if (BitCount(candidates->data(), word_count) < best_size_) return {};
    ForEachBit(candidates->data(), word_count, [&](int vertex) {
      const Word* row = graph_.Row(vertex);
      int degree = 0;
      for (int w = 0; w < word_count; ++w) {
        degree += __builtin_popcountll((*candidates)[w] & row[w]);
      }
      budget_.Spend(kDegreeStepCount);
      if (degree + 1 < best_size_) {
        ClearBit(candidates->data(), vertex);
      } else {
        by_degree.emplace_back(-degree, vertex);
      }
    });
    std::sort(by_degree.begin(), by_degree.end());
    std::vector<int> members;
    members.reserve(by_degree.size());
    for (const auto& [degree, vertex] : by_degree) members.push_back(vertex);
    return members;
  }

  // The graph among the candidates, numbered as in `members`.
  BitsetGraph Part(const std::vector<Word>& candidates, const std::vector<int>& members) {
    const Ranks ranks(candidates.data(), graph_.word_count());
    std::vector<int> number_of_rank(members.size());
    for (size_t i = 0; i < members.size(); ++i) {
      number_of_rank[ranks.Of(members[i])] = static_cast<int>(i);
    }
    BitsetGraph part(static_cast<int>(members.size()));
    for (size_t i = 0; i < members.size(); ++i) {
      const Word* row = graph_.Row(members[i]);
      budget_.Spend(1);
      for (int w = 0; w < graph_.word_count(); ++w) {
        for (Word word = row[w] & candidates[w]; word != 0; word &= word - 1) {
          const int other = number_of_rank[ranks.Of(w * kWordBits + LowestBit(word))];
          if (other > static_cast<int>(i)) part.AddEdge(static_cast<int>(i), other);
        }
      }
    }
    return part;
  }

  const BitsetGraph& graph_;
  StepBudget budget_;
  Degeneracy degeneracy_;
  int best_size_;
  std::vector<int> best_;
};

}  // namespace

Clique FindMaxClique(const BitsetGraph& graph, const CliqueOptions& options) {
  if (graph.vertex_count() == 0) return {};
  return MaxCliqueFinder(graph, options).Run();
}

}  // namespace dsg
