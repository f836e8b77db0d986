// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/max_clique.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "schema/base/check.h"

namespace dsg {
namespace {

// Vertices sorted by the degree they have left, one bucket per degree, in one array.
class DegreeBuckets {
 public:
  explicit DegreeBuckets(const BitsetGraph& graph)
      : degree_(graph.vertex_count()),
        order_(graph.vertex_count()),
        position_(graph.vertex_count()),
        begin_(graph.vertex_count() + 1, 0) {
    const int count = graph.vertex_count();
    for (int v = 0; v < count; ++v) {
      degree_[v] = graph.Degree(v);
      ++begin_[degree_[v] + 1];
    }
    for (int d = 1; d <= count; ++d) begin_[d] += begin_[d - 1];
    std::vector<int> next(begin_.begin(), begin_.end() - 1);
    for (int v = 0; v < count; ++v) {
      position_[v] = next[degree_[v]]++;
      order_[position_[v]] = v;
    }
  }

  int VertexAt(int position) const { return order_[position]; }
  int DegreeOf(int vertex) const { return degree_[vertex]; }
  std::vector<int> TakeOrder() { return std::move(order_); }

  // Swaps the vertex with the first of its bucket, then lets the bucket begin one later.
  void Decrement(int vertex) {
    const int degree = degree_[vertex];
    const int from = position_[vertex];
    const int to = begin_[degree];
    const int other = order_[to];
    std::swap(order_[from], order_[to]);
    std::swap(position_[vertex], position_[other]);
    ++begin_[degree];
    --degree_[vertex];
  }

 private:
  std::vector<int> degree_;
  std::vector<int> order_;
  std::vector<int> position_;
  std::vector<int> begin_;
};

}  // namespace

int64_t BitsetGraph::EdgeCount() const {
  int64_t twice = 0;
  for (int v = 0; v < vertex_count_; ++v) twice += Degree(v);
  return twice / 2;
}

void BitsetGraph::AddEdge(int a, int b) {
  DSG_CHECK(a != b);
  SetBit(words_.data() + Offset(a), b);
  SetBit(words_.data() + Offset(b), a);
}

void BitsetGraph::Isolate(int vertex) {
  Word* row = words_.data() + Offset(vertex);
  ForEachBit(row, word_count_, [&](int other) { ClearBit(words_.data() + Offset(other), vertex); });
  std::fill(row, row + word_count_, 0);
}

Degeneracy FindDegeneracy(const BitsetGraph& graph) {
  DegreeBuckets buckets(graph);
  Degeneracy result;
  result.core.resize(graph.vertex_count());
  for (int i = 0; i < graph.vertex_count(); ++i) {
    const int vertex = buckets.VertexAt(i);
    const int degree = buckets.DegreeOf(vertex);
    result.core[vertex] = degree;
    ForEachBit(graph.Row(vertex), graph.word_count(), [&](int other) {
      if (buckets.DegreeOf(other) > degree) buckets.Decrement(other);
    });
  }
  result.order = buckets.TakeOrder();
  return result;
}

namespace {

constexpr int kGreedyStartCount = 50;
// Counting the neighbours of a vertex takes as long as colouring several.
constexpr int kDegreeStepCount = 4;

/// A budget in steps, so that a search ends at the same place on every machine.
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

std::vector<int> CliqueSearch::Run() {
  const int count = graph_.vertex_count();
  // A clique has at most as many members as there are vertices, and a level is one member.
  levels_.resize(static_cast<size_t>(count) + 1);
  uncolored_.resize(graph_.word_count());
  color_class_.resize(graph_.word_count());
  Level& root = LevelAt(0);
  for (int v = 0; v < count; ++v) SetBit(root.candidates.data(), v);
  Expand(0);
  return best_;
}

CliqueSearch::Level& CliqueSearch::LevelAt(size_t depth) {
  Level& level = levels_[depth];
  level.candidates.assign(graph_.word_count(), 0);
  return level;
}

// Greedy colouring. A set that takes k colours holds no clique of more than k, so vertices of
// colours below `color_min` cannot lead to a better clique and are left out.
void CliqueSearch::Color(Level* level, int color_min) {
  const int word_count = graph_.word_count();
  level->vertices.clear();
  level->colors.clear();
  uncolored_ = level->candidates;
  int first_word = 0;
  for (int color = 1;; ++color) {
    while (first_word < word_count && uncolored_[first_word] == 0) ++first_word;
    if (first_word == word_count) return;
    std::copy(uncolored_.begin() + first_word, uncolored_.end(), color_class_.begin() + first_word);
    for (int w = first_word; w < word_count; ++w) {
      while (color_class_[w] != 0) {
        const int vertex = w * kWordBits + LowestBit(color_class_[w]);
        ClearBit(uncolored_.data(), vertex);
        ClearBit(color_class_.data(), vertex);
        const Word* row = graph_.Row(vertex);
        for (int i = w; i < word_count; ++i) color_class_[i] &= ~row[i];
        budget_->Spend(1);
        if (color < color_min) continue;
        level->vertices.push_back(vertex);
        level->colors.push_back(color);
      }
    }
  }
}

void CliqueSearch::Expand(size_t depth) {
  Level& level = levels_[depth];
  Color(&level, best_size_ - static_cast<int>(current_.size()) + 1);
  for (size_t i = level.vertices.size(); i-- > 0;) {
    if (budget_->IsSpent()) return;
    if (static_cast<int>(current_.size()) + level.colors[i] <= best_size_) return;
    const int vertex = level.vertices[i];
    current_.push_back(vertex);
    Level& next = LevelAt(depth + 1);
    const Word* row = graph_.Row(vertex);
    Word any = 0;
    for (int w = 0; w < graph_.word_count(); ++w) {
      next.candidates[w] = level.candidates[w] & row[w];
      any |= next.candidates[w];
    }
    if (any != 0) {
      Expand(depth + 1);
    } else if (static_cast<int>(current_.size()) > best_size_) {
      best_ = current_;
      best_size_ = static_cast<int>(best_.size());
    }
    current_.pop_back();
    ClearBit(level.candidates.data(), vertex);
  }
}

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
      // No vertex has more neighbours than that.
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

  // Removes candidates with too few neighbours among the candidates, in one pass. Returns the
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
