// SPDX-License-Identifier: Apache-2.0
// The open maps of a store, by name, the last used ones. A name is checked before anything is made
// of it, so that no request can reach outside the store's folder. The .cc file answers ListMaps,
// GetMapStats, ListRevisions and GetServerInfo.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "query/view/view_cache.h"
#include "schema/store/graph_store.h"

namespace dsg::query {

/// Threads: safe from many threads.
class MapTable {
 public:
  explicit MapTable(std::unique_ptr<GraphStore> store, size_t view_cache_bytes = size_t{512} << 20,
                    size_t open_maps_max = 16)
      : open_maps_max_(open_maps_max), store_(std::move(store)), views_(view_cache_bytes) {}

  GraphStore& store() { return *store_; }
  ViewCache& views() { return views_; }

  /// Opened at the first call and kept until as many others were asked for since as are kept; who
  /// holds it may go on with it.
  /// Errors: MAP_NAME_INVALID; MAP_UNKNOWN; what GraphStore::OpenMap returns.
  absl::StatusOr<std::shared_ptr<MapReader>> Reader(const std::string& name);

  /// Runs `work` with the map's writer, which is opened at the first call and kept, with its lock,
  /// as long as the reader. Calls for one map wait for each other, commits too, so long work is
  /// done in pieces, a call each. `stop` is asked once the wait is over.
  /// Errors: as Reader; WRITER_LOCKED while another process holds the lock; what `work` returns.
  absl::Status WithWriter(const std::string& name, const StopCheck& stop,
                          const std::function<absl::Status(MapWriter&)>& work);

  /// Runs `work`, which takes the map away from its name, when no call of this table writes it and
  /// without its writer, whose lock `work` takes. If the map is gone then, its files are closed.
  /// Errors: MAP_NAME_INVALID; what `stop` and `work` return.
  absl::Status TakeAway(const std::string& name, const StopCheck& stop,
                        const std::function<absl::Status()>& work);

 private:
  struct WriterSlot {
    /// Those that hold or wait for `mutex`. Under slots_mutex_.
    int user_count = 0;
    std::mutex mutex;
    /// Of the file that the writer writes.
    std::shared_ptr<MapReader> reader;
    /// Null until the lock could be taken.
    std::unique_ptr<MapWriter> writer;
  };

  struct OpenMap {
    std::shared_ptr<MapReader> reader;
    /// Of use_count_.
    std::atomic<uint64_t> last_use = 0;
  };

  /// Says that somebody uses a slot, as long as it lives.
  class SlotUse {
   public:
    SlotUse(MapTable* table, WriterSlot* slot) : table_(table), slot_(slot) {}
    SlotUse(SlotUse&& other) noexcept : table_(other.table_), slot_(other.slot_) {
      other.slot_ = nullptr;
    }
    ~SlotUse();
    WriterSlot* operator->() const { return slot_; }
    /// The slot is about to go.
    void Release() { slot_ = nullptr; }

   private:
    MapTable* table_;
    WriterSlot* slot_;
  };
  SlotUse UseSlot(const std::string& name);
  /// The reader of a map that is no longer what its name stands for, to be closed without a lock;
  /// null if there is none.
  std::shared_ptr<MapReader> TakeGone(const std::string& name);
  /// So that names of maps that are gone do not pile up. Not if others wait for the slot.
  void RemoveSlot(const std::string& name, SlotUse slot);
  /// nullopt if it is in use.
  std::optional<SlotUse> UseIdleSlot(const std::string& name);

  struct ClosingMap {
    std::shared_ptr<MapReader> reader;
    SlotUse slot;
  };
  /// Those that nobody has asked for for the longest, but for maps that are being written.
  /// Requires: readers_mutex_ is held. What comes back is to be closed without it.
  std::vector<ClosingMap> TakeTooMany();

  const size_t open_maps_max_;
  // First, so that it is destroyed after the readers and writers that it opened.
  std::unique_ptr<GraphStore> store_;
  ViewCache views_;
  std::atomic<uint64_t> use_count_ = 0;
  std::shared_mutex readers_mutex_;
  std::unordered_map<std::string, OpenMap> readers_;
  std::mutex slots_mutex_;
  std::unordered_map<std::string, std::unique_ptr<WriterSlot>> slots_;
};

}  // namespace dsg::query
