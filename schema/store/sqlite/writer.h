// SPDX-License-Identifier: Apache-2.0
// The one writer of a map: checks a delta, applies it in one transaction, syncs, acknowledges.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "schema/store/commit_protocol.h"
#include "schema/store/graph_store.h"
#include "schema/store/revision_record.h"
#include "schema/store/sqlite/compaction.h"
#include "schema/store/sqlite/map_file.h"
#include "schema/store/sqlite/space.h"
#include "schema/store/sqlite/track_writer.h"

namespace dsg::sqlite {

class SqliteWriter : public MapWriter {
 public:
  static absl::StatusOr<std::unique_ptr<SqliteWriter>> Open(const std::string& store_folder,
                                                            const std::string& map,
                                                            const StoreOptions& options);
  ~SqliteWriter() override;

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
  SqliteWriter(const std::string& store_folder, const std::string& map,
               const StoreOptions& options);

  absl::Status Reopen();
  /// Unless the revision can be read.
  absl::Status CheckRevision(Revision revision);
  absl::StatusOr<CommitResult> CommitOnce(GraphDelta delta);
  /// Within a transaction, which is to be rolled back after an error, and after a replay, which is
  /// returned.
  absl::StatusOr<std::optional<CommitResult>> PrepareAndApply(const DeltaIdentity& identity,
                                                              GraphDelta* delta,
                                                              CommitContext* commit);
  absl::Status Apply(const GraphDelta& delta, CommitContext* commit);
  /// Of a commit that has been applied and began with so many pages.
  absl::Status CheckQuota(const GraphDelta& delta, int64_t pages_before);
  absl::StatusOr<CompactReport> CompactOnce(Revision keep_from, const StopCheck& stop,
                                            const Progress& progress);
  absl::Status NoteErasureOnce(const Erasure& erasure, Revision planned_at);
  absl::StatusOr<EraseReport> EraseOnce(const Erasure& erasure, const StopCheck& stop,
                                        const Progress& progress);
  /// Runs `work`, and when the disk is full once again without the reserve.
  template <typename Work>
  auto WithReserve(const Work& work) -> decltype(work());
  absl::StatusOr<CommitResult> Settle(const DeltaIdentity& delta, const absl::Status& failure);

  std::string store_folder_;
  std::string map_;
  Reserve reserve_;
  /// The disk was full, and the reserve is given up for now.
  bool is_on_reserve_ = false;
  int64_t quota_bytes_;
  int checkpoint_pages_;
  std::unique_ptr<WriterLock> lock_;
  /// Null after a COMMIT whose outcome is unknown, until reopened.
  std::unique_ptr<Database> db_;
  MapSpec spec_;
  RevisionRecord head_;
  TrackWriter tracks_;
  /// One that was stopped.
  std::optional<Compaction> compaction_;
};

}  // namespace dsg::sqlite
