// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/clique_search.h"

#include <algorithm>

namespace dsg {

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

}  // namespace dsg
