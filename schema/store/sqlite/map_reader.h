// SPDX-License-Identifier: Apache-2.0
// One map open for reading: a pool of read-only connections, and caches shared by all snapshots.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "schema/store/graph_store.h"
#include "schema/store/readable.h"
#include "schema/store/revision_record.h"
#include "schema/store/sqlite/batch_rows.h"
#include "schema/store/sqlite/map_file.h"
#include "schema/store/sqlite/track_cache.h"

namespace dsg::sqlite {

class SqliteMapReader : public MapReader, public std::enable_shared_from_this<SqliteMapReader> {
 public:
  static absl::StatusOr<std::shared_ptr<SqliteMapReader>> Open(const std::string& store_folder,
                                                               const std::string& map,
                                                               size_t cache_bytes);

  const MapSpec& spec() const override { return spec_; }
  const std::string& incarnation() const override { return incarnation_; }
  bool IsCurrent() const override;
  absl::StatusOr<RevisionInfo> Head() override;
  absl::StatusOr<std::shared_ptr<const Snapshot>> Latest() override;
  absl::StatusOr<std::shared_ptr<const Snapshot>> At(Revision revision) override;
  absl::StatusOr<Revision> OldestRevision() override;
  absl::StatusOr<std::optional<PendingErasure>> GetPendingErasure() override;
  absl::StatusOr<std::vector<Tag>> Tags() override;
  absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before, int limit) override;
  absl::StatusOr<std::vector<NodeVersion>> NodeVersions(NodeId id, Revision before,
                                                        int limit) override;
  absl::StatusOr<Touched> TouchedBetween(Revision after, Revision until,
                                         const StopCheck& stop) override;
  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override;
  absl::StatusOr<VerifyReport> Verify(const StopCheck& stop,
                                      const std::function<void(double)>& progress) override;
  absl::Status CopyTo(const std::string& path, const StopCheck& stop,
                      const Progress& progress) override;
  absl::Status ReadRows(const RowSink& sink, const StopCheck& stop) override;

  /// A connection for the length of one call; goes back to the pool when dropped.
  class Lease {
   public:
    Lease(SqliteMapReader* reader, std::unique_ptr<Database> db)
        : reader_(reader), db_(std::move(db)) {}
    ~Lease();
    Lease(Lease&&) = default;
    /// Until it is dropped.
    absl::Status BeginTransaction();
    Database& operator*() { return *db_; }
    Database* operator->() { return db_.get(); }

   private:
    SqliteMapReader* reader_;
    std::unique_ptr<Database> db_;
    bool is_in_transaction_ = false;
  };
  absl::StatusOr<Lease> LeaseConnection();
  /// One that sees one state, in which the revision can be read.
  /// Errors: OUT_OF_RANGE/REVISION_COMPACTED; ABORTED/MAP_REPLACED.
  absl::StatusOr<Lease> LeaseAt(Revision revision);

  absl::StatusOr<TrackPtr> GetTrack(NodeId agent, Revision revision);
  absl::StatusOr<SegmentPtr> GetSegment(const SegmentRef& segment, Revision revision);
  AncestorCache& ancestors() { return ancestors_; }
  ShapeCache& shapes() { return shapes_; }
  /// Ids of humans and robots, by revision.
  AgentCache& agents() { return agents_; }
  int64_t bytes_on_disk() const { return BytesOnDisk(store_folder_, spec_.name); }

 private:
  /// The newest revision and which others can be read, as of one instant.
  struct State {
    std::shared_ptr<const RevisionRecord> head;
    std::shared_ptr<const Readable> readable;
  };
  absl::StatusOr<State> Refresh() const;

  SqliteMapReader(std::string store_folder, size_t cache_bytes)
      : store_folder_(std::move(store_folder)),
        tracks_(cache_bytes / 4),
        segments_(cache_bytes / 2),
        ancestors_(cache_bytes / 8),
        shapes_(cache_bytes / 8) {}

  std::string store_folder_;
  MapSpec spec_;
  std::string incarnation_;
  std::optional<FileIdentity> identity_;

  mutable std::mutex head_mutex_;
  /// Watches for commits of other connections: SQLite counts them for us (data_version).
  std::unique_ptr<Database> watcher_;
  mutable int64_t data_version_ = -1;
  mutable State state_;
  /// Of the map when it was opened.
  int64_t generation_ = 0;
  mutable std::atomic<bool> is_rewritten_ = false;

  std::mutex pool_mutex_;
  std::vector<std::unique_ptr<Database>> pool_;

  TrackCache tracks_;
  SegmentCache segments_;
  AncestorCache ancestors_;
  ShapeCache shapes_;
  AgentCache agents_{size_t{1} << 20};
};

/// Makes the snapshot of a revision that exists.
std::shared_ptr<const Snapshot> MakeSnapshot(std::shared_ptr<SqliteMapReader> reader,
                                             std::shared_ptr<const RevisionRecord> head);

}  // namespace dsg::sqlite
