// SPDX-License-Identifier: Apache-2.0
// Memory for the messages of calls. Blocks are reused by the next calls while they are still in the
// processor's caches; at most 64 unused blocks are kept.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace dsg::server {

/// Lends the first block of each call's arena. Most messages need no further block.
///
/// Threads: safe from any thread.
class ArenaBlocks {
 public:
  using Block = std::unique_ptr<char[]>;
  static constexpr size_t kBlockBytes = size_t{32} << 10;

  /// Holds a block of kBlockBytes until destroyed. Must outlive the arena on it.
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
