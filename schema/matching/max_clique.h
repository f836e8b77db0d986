// SPDX-License-Identifier: Apache-2.0
// Undirected graphs as bit rows of neighbours, and their largest clique: the largest set of
// vertices that are pairwise adjacent. Memory is quadratic in the vertices. The search is bounded
// in steps and says when it was cut off.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace dsg {

/// Sets of small integers as rows of 64-bit words.
using Word = uint64_t;
inline constexpr int kWordBits = 64;

inline int WordCount(int bit_count) { return (bit_count + kWordBits - 1) / kWordBits; }
inline bool HasBit(const Word* row, int bit) {
  return ((row[bit / kWordBits] >> (bit % kWordBits)) & 1U) != 0;
}
inline void SetBit(Word* row, int bit) { row[bit / kWordBits] |= Word{1} << (bit % kWordBits); }
inline void ClearBit(Word* row, int bit) {
  row[bit / kWordBits] &= ~(Word{1} << (bit % kWordBits));
}
/// Requires: word is not zero.
inline int LowestBit(Word word) { return __builtin_ctzll(word); }
inline int BitCount(const Word* row, int word_count) {
  int count = 0;
  for (int i = 0; i < word_count; ++i) count += __builtin_popcountll(row[i]);
  return count;
}

class BitsetGraph {
 public:
  explicit BitsetGraph(int vertex_count)
      : vertex_count_(vertex_count),
        word_count_(WordCount(vertex_count)),
        words_(static_cast<size_t>(vertex_count) * static_cast<size_t>(word_count_), 0) {}

  int vertex_count() const { return vertex_count_; }
  int word_count() const { return word_count_; }
  const Word* Row(int vertex) const { return words_.data() + Offset(vertex); }
  bool HasEdge(int a, int b) const { return HasBit(Row(a), b); }
  int Degree(int vertex) const { return BitCount(Row(vertex), word_count_); }
  int64_t EdgeCount() const;

  /// Requires: a and b differ.
  void AddEdge(int a, int b);
  /// Removes all edges of the vertex.
  void Isolate(int vertex);

 private:
  size_t Offset(int vertex) const {
    return static_cast<size_t>(vertex) * static_cast<size_t>(word_count_);
  }

  int vertex_count_;
  int word_count_;
  std::vector<Word> words_;
};

/// Calls `visit` with each member of a set, ascending.
template <typename Visit>
void ForEachBit(const Word* row, int word_count, Visit visit) {
  for (int i = 0; i < word_count; ++i) {
    for (Word word = row[i]; word != 0; word &= word - 1) visit(i * kWordBits + LowestBit(word));
  }
}

/// The degeneracy order: repeatedly removes the vertex with the fewest remaining neighbours.
struct Degeneracy {
  std::vector<int> order;
  /// By vertex: the largest k such that the vertex is in a subgraph of degrees >= k. A clique that
  /// contains the vertex has at most core + 1 members.
  std::vector<int> core;
};

/// Cost: linear in vertices and edges.
/// Source: Batagelj and Zaversnik, 2003.
Degeneracy FindDegeneracy(const BitsetGraph& graph);

struct CliqueOptions {
  /// A step is one vertex coloured or one row of neighbours copied.
  int64_t step_count_max = 20'000'000;
  /// Only cliques larger than this count.
  int size_above = 0;
};

struct Clique {
  /// Ascending; empty when the graph has no clique of more than `size_above`.
  std::vector<int> vertices;
  /// False when the search was cut off; a larger clique may exist.
  bool is_maximal = true;
  int64_t step_count = 0;
};

/// Greedy cliques from the vertices of highest core, then branch and bound in degeneracy order,
/// bounded by greedy colourings.
///
/// Cost: exponential at worst, bounded by `step_count_max`.
/// Source: Rossi et al., 2015 (core order); San Segundo et al., 2011 (bitset colouring).
Clique FindMaxClique(const BitsetGraph& graph, const CliqueOptions& options);

}  // namespace dsg
