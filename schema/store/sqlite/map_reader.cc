// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/map_reader.h"

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/copy.h"
#include "schema/store/sqlite/pending_erasure.h"
#include "schema/store/sqlite/sessions.h"
#include "schema/store/sqlite/tag_rows.h"

namespace dsg::sqlite {
namespace {

// Idle connections kept open; a burst above opens more and closes them after.
constexpr size_t kPoolMax = 16;

absl::StatusOr<RevisionRecord> LoadRevision(Database& db, Revision revision) {
  Query query(db, "SELECT " DSG_REVISION_COLUMNS " FROM revision WHERE revision = ?1");
  const bool found = query.Bind(revision).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return CorruptRow(db.map_name(), "revision", absl::StrCat(revision));
  return HeadFromRow(query, db.map_name());
}

}  // namespace

absl::StatusOr<std::shared_ptr<SqliteMapReader>> SqliteMapReader::Open(
    const std::string& store_folder, const std::string& map, size_t cache_bytes) {
  std::shared_ptr<SqliteMapReader> reader(new SqliteMapReader(store_folder, cache_bytes));
  // Before opening: if the file is replaced in between, the reader takes itself for stale.
  reader->identity_ = IdentityOf(store_folder, map);
  DSG_ASSIGN_OR_RETURN(reader->watcher_, OpenMapFile(store_folder, map, Database::Mode::kRead));
  DSG_ASSIGN_OR_RETURN(reader->spec_, ReadMapSpec(*reader->watcher_));
  DSG_ASSIGN_OR_RETURN(const std::string stored, ReadIncarnation(*reader->watcher_));
  // A file that was put there by hand bears the text of the one that it was copied from.
  const uint64_t inode = reader->identity_.has_value() ? reader->identity_->inode : 0;
  reader->incarnation_ = absl::StrCat(stored, "-", absl::Hex(inode));
  DSG_ASSIGN_OR_RETURN(const Readable readable, LoadReadable(*reader->watcher_));
  reader->generation_ = readable.generation;
  return reader;
}

SqliteMapReader::Lease::~Lease() {
  if (db_ == nullptr) return;
  // Nothing was written; after a bad page SQLite has ended the transaction itself.
  if (is_in_transaction_) Query(*db_, "ROLLBACK").Run().IgnoreError();
  const std::lock_guard lock(reader_->pool_mutex_);
  if (reader_->pool_.size() < kPoolMax) reader_->pool_.push_back(std::move(db_));
}

absl::Status SqliteMapReader::Lease::BeginTransaction() {
  DSG_RETURN_IF_ERROR(Query(*db_, "BEGIN").Run());
  is_in_transaction_ = true;
  return absl::OkStatus();
}

absl::StatusOr<SqliteMapReader::Lease> SqliteMapReader::LeaseAt(Revision revision) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  DSG_RETURN_IF_ERROR(lease.BeginTransaction());
  DSG_RETURN_IF_ERROR(CheckStillReadable(*lease, revision, generation_));
  return lease;
}

absl::StatusOr<SqliteMapReader::Lease> SqliteMapReader::LeaseConnection() {
  {
    const std::lock_guard lock(pool_mutex_);
    if (!pool_.empty()) {
      Lease lease(this, std::move(pool_.back()));
      pool_.pop_back();
      return lease;
    }
  }
  DSG_ASSIGN_OR_RETURN(auto db, OpenMapFile(store_folder_, spec_.name, Database::Mode::kRead));
  // Connections to the old file and to the new would answer one question from two maps.
  if (IdentityOf(store_folder_, spec_.name) == identity_) return Lease(this, std::move(db));
  return MakeError(Reason::kMapReplaced,
                   absl::StrCat("the file of map \"", spec_.name,
                                "\" was replaced while it was read; ask again"),
                   {{"map", spec_.name}});
}

bool SqliteMapReader::IsCurrent() const {
  if (is_rewritten_.load() || IdentityOf(store_folder_, spec_.name) != identity_) return false;
  // If that fails, so will the question that comes next, and say why.
  Refresh().IgnoreError();
  return !is_rewritten_.load();
}

absl::StatusOr<SqliteMapReader::State> SqliteMapReader::Refresh() const {
  const std::lock_guard lock(head_mutex_);
  DSG_ASSIGN_OR_RETURN(const int64_t version, watcher_->QueryInt("PRAGMA data_version"));
  if (state_.head == nullptr || version != data_version_) {
    const ReadTransaction transaction(watcher_.get());
    DSG_RETURN_IF_ERROR(transaction.status());
    DSG_ASSIGN_OR_RETURN(RevisionRecord head, LoadHead(*watcher_));
    DSG_ASSIGN_OR_RETURN(Readable readable, LoadReadable(*watcher_));
    if (readable.generation != generation_) is_rewritten_ = true;
    state_ = {std::make_shared<const RevisionRecord>(std::move(head)),
              std::make_shared<const Readable>(std::move(readable))};
    data_version_ = version;
  }
  return state_;
}

absl::StatusOr<RevisionInfo> SqliteMapReader::Head() {
  DSG_ASSIGN_OR_RETURN(const State state, Refresh());
  return state.head->info;
}

absl::StatusOr<std::shared_ptr<const Snapshot>> SqliteMapReader::Latest() {
  DSG_ASSIGN_OR_RETURN(State state, Refresh());
  return MakeSnapshot(shared_from_this(), std::move(state.head));
}

absl::StatusOr<std::shared_ptr<const Snapshot>> SqliteMapReader::At(Revision revision) {
  DSG_ASSIGN_OR_RETURN(State state, Refresh());
  const Revision newest = state.head->info.revision;
  if (revision == newest) return MakeSnapshot(shared_from_this(), std::move(state.head));
  DSG_RETURN_IF_ERROR(CheckReadable(spec_.name, revision, newest, *state.readable));
  RevisionRecord at;
  if (revision > 0) {
    DSG_ASSIGN_OR_RETURN(Lease lease, LeaseAt(revision));
    DSG_ASSIGN_OR_RETURN(at, LoadRevision(*lease, revision));
  }
  return MakeSnapshot(shared_from_this(), std::make_shared<const RevisionRecord>(std::move(at)));
}

absl::StatusOr<Revision> SqliteMapReader::OldestRevision() {
  DSG_ASSIGN_OR_RETURN(const State state, Refresh());
  return state.readable->oldest;
}

absl::StatusOr<std::optional<PendingErasure>> SqliteMapReader::GetPendingErasure() {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  DSG_RETURN_IF_ERROR(lease.BeginTransaction());
  return sqlite::GetPendingErasure(*lease);
}

absl::StatusOr<std::vector<Tag>> SqliteMapReader::Tags() {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  return ReadTags(*lease);
}

absl::StatusOr<std::vector<RevisionInfo>> SqliteMapReader::ListRevisions(Revision before,
                                                                         int limit) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  Query query(*lease, "SELECT " DSG_REVISION_COLUMNS
                      " FROM revision WHERE revision < ?1 ORDER BY revision DESC LIMIT ?2");
  query.Bind(before > 0 ? before : kRevisionMax, limit);
  std::vector<RevisionInfo> revisions;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(RevisionRecord head, HeadFromRow(query, spec_.name));
    revisions.push_back(std::move(head.info));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return revisions;
}

absl::StatusOr<SessionState> SqliteMapReader::GetSession(const std::string& session_id) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  return ReadSession(*lease, session_id);
}

absl::StatusOr<VerifyReport> SqliteMapReader::Verify(const StopCheck& stop,
                                                     const std::function<void(double)>& progress) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  return VerifyMap(*lease, spec_, stop, progress);
}

absl::Status SqliteMapReader::CopyTo(const std::string& path, const StopCheck& stop,
                                     const Progress& progress) {
  // Not one of the pool: what it is set to for copying stays with it.
  DSG_ASSIGN_OR_RETURN(const auto db,
                       OpenMapFile(store_folder_, spec_.name, Database::Mode::kRead));
  return CopyMap(*db, path, stop, progress);
}

absl::StatusOr<TrackPtr> SqliteMapReader::GetTrack(NodeId agent, Revision revision) {
  return tracks_.Get({agent, revision}, {}, [&]() -> absl::StatusOr<Costed<TrackPtr>> {
    DSG_ASSIGN_OR_RETURN(Lease lease, LeaseAt(revision));
    // What is cached for the revision before is still true if the agent has not changed since.
    if (const auto before = tracks_.Find({agent, revision - 1})) {
      DSG_ASSIGN_OR_RETURN(const Revision changed, LastChangeOfTrack(*lease, agent));
      if (changed < revision) return Costed<TrackPtr>{*before, 64};
    }
    DSG_ASSIGN_OR_RETURN(TrackPtr track, LoadTrack(*lease, spec_, agent, revision));
    const size_t bytes = track->memory_bytes();
    return Costed<TrackPtr>{std::move(track), bytes};
  });
}

absl::StatusOr<SegmentPtr> SqliteMapReader::GetSegment(const SegmentRef& segment,
                                                       Revision revision) {
  const SegmentKey key{segment.id, segment.rev_from, segment.pose_count};
  return segments_.Get(key, {}, [&]() -> absl::StatusOr<Costed<SegmentPtr>> {
    DSG_ASSIGN_OR_RETURN(Lease lease, LeaseAt(revision));
    DSG_ASSIGN_OR_RETURN(SegmentPtr reader, LoadSegment(*lease, segment));
    const size_t bytes = reader->memory_bytes();
    return Costed<SegmentPtr>{std::move(reader), bytes};
  });
}

}  // namespace dsg::sqlite
