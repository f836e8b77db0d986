// SPDX-License-Identifier: Apache-2.0
// The one writer of a map in memory. A commit is proven whole before a row changes, so it cannot
// fail half-way; compaction and erasure are one step each.
#pragma once

#include <memory>
#include <string>

#include "schema/store/graph_store.h"
#include "schema/store/memory/map_rows.h"

namespace dsg::memory {

class MemoryWriter : public MapWriter {
 public:
  /// Errors: UNAVAILABLE/WRITER_LOCKED naming who writes the map.
  static absl::StatusOr<std::unique_ptr<MemoryWriter>> Open(std::shared_ptr<MapRows> rows,
                                                            const std::string& program);
  ~MemoryWriter() override;
  MemoryWriter(const MemoryWriter&) = delete;
  MemoryWriter& operator=(const MemoryWriter&) = delete;

  absl::StatusOr<CommitResult> Commit(GraphDelta delta) override;
  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override;
  absl::StatusOr<Tag> SetTag(const std::string& name, Revision revision,
                             const std::string& note) override;
  absl::Status RemoveTag(const std::string& name) override;
  absl::StatusOr<CompactReport> Compact(Revision keep_from, const StopCheck& stop,
                                        const Progress& progress) override;
  absl::Status NoteErasure(const Erasure& erasure, Revision planned_at) override;
  absl::StatusOr<EraseReport> Erase(const Erasure& erasure, const StopCheck& stop,
                                    const Progress& progress) override;

 private:
  explicit MemoryWriter(std::shared_ptr<MapRows> rows) : rows_(std::move(rows)) {}

  const std::shared_ptr<MapRows> rows_;
};

/// Drops what no readable revision shows. Requires: `keep_from` can be read; the rows are locked.
CompactReport CompactRows(Revision keep_from, MapRows* rows);

/// The work of MapWriter::Erase. Requires: the rows are locked.
absl::StatusOr<EraseReport> EraseRows(const Erasure& erasure, const StopCheck& stop, MapRows* rows);

/// Assets that nodes and shapes refer to, current and past ones.
std::set<Sha256> ReferredAssets(const MapRows& rows);

}  // namespace dsg::memory
