// SPDX-License-Identifier: Apache-2.0
// The open maps of a store, by name. A name is checked before anything is made of it, so that no
// request can reach outside the store's folder.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <unordered_map>

#include "absl/status/statusor.h"
#include "query/engine/archive_copies.h"
#include "query/view/view_cache.h"
#include "schema/store/graph_store.h"

namespace dsg::query {

/// Threads: safe from many threads.
class MapTable {
 public:
  explicit MapTable(std::unique_ptr<GraphStore> store, size_t view_cache_bytes = size_t{1} << 30,
                    const ArchiveLimits& archive_limits = {})
      : store_(std::move(store)),
        views_(view_cache_bytes),
        archives_(store_->folder(), archive_limits) {}

  GraphStore& store() { return *store_; }
  ViewCache& views() { return views_; }
  ArchiveCopies& archives() { return archives_; }

  /// Opened at the first call and kept.
  /// Errors: MAP_NAME_INVALID; MAP_UNKNOWN; what GraphStore::OpenMap returns.
  absl::StatusOr<std::shared_ptr<MapReader>> Reader(const std::string& name);

  /// Commits with the map's writer, which is opened at the first commit and kept with its lock.
  /// Commits to one map wait for each other. `stop` is asked once the wait is over.
  /// Errors: as Reader; WRITER_LOCKED while another process holds the lock.
  absl::StatusOr<CommitResult> Commit(GraphDelta delta, const StopCheck& stop);

  /// The same for other work of the map's writer. Commits wait meanwhile, so long work is to be
  /// done in pieces, a call each.
  /// Errors: as Commit; what `work` returns.
  absl::Status WithWriter(const std::string& name, const StopCheck& stop,
                          const std::function<absl::Status(MapWriter&)>& work);

 private:
  struct WriterSlot {
    std::mutex mutex;
    /// Of the file that the writer writes.
    std::shared_ptr<MapReader> reader;
    /// Null until the lock could be taken.
    std::unique_ptr<MapWriter> writer;
  };

  WriterSlot* FindSlot(const std::string& name);

  // First, so that it is destroyed after the readers and writers that it opened.
  std::unique_ptr<GraphStore> store_;
  ViewCache views_;
  ArchiveCopies archives_;
  std::shared_mutex readers_mutex_;
  std::unordered_map<std::string, std::shared_ptr<MapReader>> readers_;
  std::mutex slots_mutex_;
  std::unordered_map<std::string, std::unique_ptr<WriterSlot>> slots_;
};

}  // namespace dsg::query
