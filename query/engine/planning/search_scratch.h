// SPDX-License-Identifier: Apache-2.0
// The working memory of a search over places, kept between questions: a question touches the
// entries it visits, and never has to clear the rest.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "query/view/place_graph.h"

namespace dsg::query {

/// Threads: one search at a time.
class SearchScratch {
 public:
  struct Cell {
    double way_m = 0.0;
    double ahead_m = 0.0;
    PlaceIndex from = -1;
    /// Index of the goal's anchor, -1 if the place is none.
    int32_t goal = -1;
    uint32_t generation = 0;
    bool reached = false;
    bool settled = false;
  };

  /// Forgets everything, at no cost.
  void Begin(int32_t place_count);
  Cell& at(PlaceIndex place) {
    Cell& cell = cells_[static_cast<size_t>(place)];
    if (cell.generation != generation_) {
      cell = Cell();
      cell.generation = generation_;
    }
    return cell;
  }

  /// The queue: smallest total first; of equal ones goals before places, then the lowest place.
  void Push(double total_m, PlaceIndex place, bool is_goal);
  bool empty() const { return heap_.empty(); }
  struct Entry {
    double total_m = 0.0;
    uint32_t key = 0;

    bool is_goal() const { return key < kPlaceKey; }
    PlaceIndex place() const { return static_cast<PlaceIndex>(is_goal() ? key : key - kPlaceKey); }
  };
  Entry Pop();

  size_t memory_bytes() const;

 private:
  static constexpr uint32_t kPlaceKey = uint32_t{1} << 31;

  std::vector<Cell> cells_;
  std::vector<Entry> heap_;
  uint32_t generation_ = 0;
};

/// A scratch that goes back to the others when its user is done. As many are kept as processors
/// could use at once, none of them large.
///
/// Threads: safe from many threads.
class BorrowedScratch {
 public:
  BorrowedScratch();
  ~BorrowedScratch();
  BorrowedScratch(const BorrowedScratch&) = delete;
  BorrowedScratch& operator=(const BorrowedScratch&) = delete;

  SearchScratch& operator*() const { return *scratch_; }
  SearchScratch* operator->() const { return scratch_.get(); }

 private:
  std::unique_ptr<SearchScratch> scratch_;
};

}  // namespace dsg::query
