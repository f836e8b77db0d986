// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/bitset_graph.h"

#include <algorithm>
#include <utility>

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

}  // namespace dsg
