// SPDX-License-Identifier: Apache-2.0
// Memory for the messages of calls, handed from one call to the next while it is in the caches.
// Refuses to keep more than a few calls need at a time.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace dsg::server {

/// The first block of each call's arena; most messages need no other.
///
/// Threads: safe from any thread.
class ArenaBlocks {
 public:
  using Block = std::unique_ptr<char[]>;
  static constexpr size_t kBlockBytes = size_t{32} << 10;

  /// A block of kBlockBytes for as long as this lives, which must be longer than the arena.
  class Lent {
   public:
    explicit Lent(ArenaBlocks* blocks) : blocks_(blocks), block_(blocks->Take()) {}
    ~Lent() { blocks_->Give(std::move(block_)); }
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;

    char* bytes() const { return block_.get(); }

   private:
    ArenaBlocks* const blocks_;
    Block block_;
  };

 private:
  Block Take() {
    {
      std::lock_guard lock(mutex_);
      if (!kept_.empty()) {
        Block block = std::move(kept_.back());
        kept_.pop_back();
        return block;
      }
    }
    return std::make_unique_for_overwrite<char[]>(kBlockBytes);
  }

  void Give(Block block) {
    std::lock_guard lock(mutex_);
    if (kept_.size() < kKeptMax) kept_.push_back(std::move(block));
  }

  static constexpr size_t kKeptMax = 64;
  std::mutex mutex_;
  std::vector<Block> kept_;
};

}  // namespace dsg::server
