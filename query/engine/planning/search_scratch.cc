// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/search_scratch.h"

#include <algorithm>
#include <mutex>

namespace dsg::query {
namespace {

constexpr size_t kKeptCountMax = 8;
constexpr size_t kKeptBytesMax = size_t{32} << 20;

struct Pool {
  std::mutex mutex;
  std::vector<std::unique_ptr<SearchScratch>> free;
};

Pool& ThePool() {
  // Never destroyed: a thread may still give back its scratch while the program ends.
  static Pool* const pool = new Pool;
  return *pool;
}

bool Later(const SearchScratch::Entry& a, const SearchScratch::Entry& b) {
  return a.total_m != b.total_m ? a.total_m > b.total_m : a.key > b.key;
}

}  // namespace

void SearchScratch::Begin(int32_t place_count) {
  heap_.clear();
  const size_t count = static_cast<size_t>(place_count);
  if (cells_.size() < count) cells_.resize(count);
  if (++generation_ != 0) return;
  // After four thousand million questions an old mark could look like a new one.
  std::fill(cells_.begin(), cells_.end(), Cell());
  generation_ = 1;
}

void SearchScratch::Push(double total_m, PlaceIndex place, bool is_goal) {
  heap_.push_back({total_m, static_cast<uint32_t>(place) + (is_goal ? 0 : kPlaceKey)});
  std::push_heap(heap_.begin(), heap_.end(), Later);
}

SearchScratch::Entry SearchScratch::Pop() {
  std::pop_heap(heap_.begin(), heap_.end(), Later);
  const Entry entry = heap_.back();
  heap_.pop_back();
  return entry;
}

size_t SearchScratch::memory_bytes() const {
  return cells_.capacity() * sizeof(Cell) + heap_.capacity() * sizeof(Entry);
}

BorrowedScratch::BorrowedScratch() {
  Pool& pool = ThePool();
  {
    const std::lock_guard lock(pool.mutex);
    if (!pool.free.empty()) {
      scratch_ = std::move(pool.free.back());
      pool.free.pop_back();
    }
  }
  if (scratch_ == nullptr) scratch_ = std::make_unique<SearchScratch>();
}

BorrowedScratch::~BorrowedScratch() {
  if (scratch_->memory_bytes() > kKeptBytesMax) return;
  Pool& pool = ThePool();
  const std::lock_guard lock(pool.mutex);
  if (pool.free.size() < kKeptCountMax) pool.free.push_back(std::move(scratch_));
}

}  // namespace dsg::query
