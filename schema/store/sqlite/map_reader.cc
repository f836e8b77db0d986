// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/map_reader.h"

#include "absl/strings/str_cat.h"

namespace dsg::sqlite {
namespace {

// Idle connections kept open; a burst above opens more and closes them after.
constexpr size_t kPoolMax = 16;

absl::StatusOr<sqlite::Head> LoadRevision(Database& db, Revision revision) {
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
  DSG_ASSIGN_OR_RETURN(reader->keeps_touched_, KeepsTouched(*reader->watcher_));
  return reader;
}

SqliteMapReader::Lease::~Lease() {
  if (db_ == nullptr) return;
  const std::lock_guard lock(reader_->pool_mutex_);
  if (reader_->pool_.size() < kPoolMax) reader_->pool_.push_back(std::move(db_));
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
  return Lease(this, std::move(db));
}

absl::StatusOr<std::shared_ptr<const sqlite::Head>> SqliteMapReader::RefreshHead() {
  const std::lock_guard lock(head_mutex_);
  DSG_ASSIGN_OR_RETURN(const int64_t version, watcher_->QueryInt("PRAGMA data_version"));
  if (head_ == nullptr || version != data_version_) {
    DSG_ASSIGN_OR_RETURN(sqlite::Head head, LoadHead(*watcher_));
    head_ = std::make_shared<const sqlite::Head>(std::move(head));
    data_version_ = version;
  }
  return head_;
}

absl::StatusOr<RevisionInfo> SqliteMapReader::Head() {
  DSG_ASSIGN_OR_RETURN(const auto head, RefreshHead());
  return head->info;
}

absl::StatusOr<std::shared_ptr<const Snapshot>> SqliteMapReader::Latest() {
  DSG_ASSIGN_OR_RETURN(auto head, RefreshHead());
  return MakeSnapshot(shared_from_this(), std::move(head));
}

absl::StatusOr<std::shared_ptr<const Snapshot>> SqliteMapReader::At(Revision revision) {
  DSG_ASSIGN_OR_RETURN(auto head, RefreshHead());
  const Revision newest = head->info.revision;
  if (revision == newest) return MakeSnapshot(shared_from_this(), std::move(head));
  if (revision < 0 || revision > newest) {
    return MakeError(Reason::kRevisionInFuture,
                     absl::StrCat("revision ", revision, " of map \"", spec_.name,
                                  "\" does not exist; readable are 0 to ", newest),
                     {{"map", spec_.name}, {"oldest", "0"}, {"newest", absl::StrCat(newest)}});
  }
  sqlite::Head at;
  if (revision > 0) {
    DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
    DSG_ASSIGN_OR_RETURN(at, LoadRevision(*lease, revision));
  }
  return MakeSnapshot(shared_from_this(), std::make_shared<const sqlite::Head>(std::move(at)));
}

absl::StatusOr<Revision> SqliteMapReader::OldestRevision() { return Revision{0}; }

absl::StatusOr<std::vector<RevisionInfo>> SqliteMapReader::ListRevisions(Revision before,
                                                                         int limit) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  Query query(*lease, "SELECT " DSG_REVISION_COLUMNS
                      " FROM revision WHERE revision < ?1 ORDER BY revision DESC LIMIT ?2");
  query.Bind(before > 0 ? before : kRevisionMax, limit);
  std::vector<RevisionInfo> revisions;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(sqlite::Head head, HeadFromRow(query, spec_.name));
    revisions.push_back(std::move(head.info));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return revisions;
}

absl::StatusOr<SessionState> SqliteMapReader::GetSession(const std::string& session_id) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  return ReadSession(*lease, session_id);
}

absl::StatusOr<VerifyReport> SqliteMapReader::Verify(const std::function<void(double)>& progress) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  return VerifyMap(*lease, spec_, progress);
}

absl::StatusOr<std::shared_ptr<const Track>> SqliteMapReader::GetTrack(NodeId agent,
                                                                       Revision revision) {
  const TrackKey key{agent, revision};
  if (auto cached = tracks_.Find(key)) return cached;
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  // What is cached for the revision before is still true if the agent has not changed since.
  if (auto before = tracks_.Find({agent, revision - 1})) {
    DSG_ASSIGN_OR_RETURN(const Revision changed, LastChangeOfTrack(*lease, agent));
    if (changed < revision) {
      tracks_.Insert(key, before, 64);
      return before;
    }
  }
  DSG_ASSIGN_OR_RETURN(auto track, LoadTrack(*lease, spec_, agent, revision));
  tracks_.Insert(key, track, track->memory_bytes());
  return track;
}

absl::StatusOr<std::shared_ptr<const SegmentReader>> SqliteMapReader::GetSegment(
    const SegmentRef& segment) {
  const SegmentKey key{segment.id, segment.rev_from, segment.pose_count};
  if (auto cached = segments_.Find(key)) return cached;
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  DSG_ASSIGN_OR_RETURN(auto reader, LoadSegment(*lease, segment));
  segments_.Insert(key, reader, reader->memory_bytes());
  return reader;
}

}  // namespace dsg::sqlite
