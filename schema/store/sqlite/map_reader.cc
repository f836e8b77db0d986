// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/map_reader.h"

#include <algorithm>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/copy.h"
#include "schema/store/sqlite/erasure.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/stream_out.h"
#include "schema/store/sqlite/verify.h"

namespace dsg::sqlite {
namespace {

// Idle connections kept open; a burst above opens more and closes them after.
constexpr size_t kPoolMax = 16;

// Of compacted revisions the next one that is kept has the list.
absl::Status ReadTouchedLists(Database& db, Revision after, Revision until, const StopCheck& stop,
                              TouchedKeys* keys) {
  Query query(db,
              "SELECT revision.revision, payload, checksum FROM revision LEFT JOIN touched"
              " USING (revision) WHERE revision.revision > ?1 AND revision.revision <= ?2");
  query.Bind(after, until);
  while (query.Next()) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_RETURN_IF_ERROR(TouchedFromRow(query, db.map_name(), keys));
  }
  return query.status();
}

// Tracks of which a segment that the reader at `after` could see has ended.
absl::StatusOr<std::vector<NodeId>> ReadCorrected(Database& db, Revision after, Revision until) {
  Query query(db,
              "SELECT DISTINCT agent FROM trajectory_history JOIN track ON slot = id >> 42"
              " WHERE rev_to > ?1 AND rev_to <= ?2 AND +rev_from <= ?1");
  query.Bind(after, until);
  std::vector<NodeId> agents;
  while (query.Next()) agents.push_back(IdOf(query.Int(0)));
  DSG_RETURN_IF_ERROR(query.status());
  std::sort(agents.begin(), agents.end());
  return agents;
}

// Edges go by the names of their relations, in whose order the answer stands.
absl::StatusOr<std::vector<EdgeKey>> NameEdges(Database& db, std::vector<EdgeRowKey> edges) {
  std::vector<std::string> names;
  std::unordered_map<int64_t, int64_t> rank_of;
  Query query(db, "SELECT id, name FROM relation ORDER BY name");
  while (query.Next()) {
    rank_of[query.Int(0)] = std::ssize(names);
    names.emplace_back(query.Text(1));
  }
  DSG_RETURN_IF_ERROR(query.status());
  for (EdgeRowKey& edge : edges) {
    const auto rank = rank_of.find(edge.relation);
    if (rank == rank_of.end()) {
      return CorruptRow(db.map_name(), "relation", absl::StrCat(edge.relation));
    }
    edge.relation = rank->second;
  }
  std::sort(edges.begin(), edges.end());
  std::vector<EdgeKey> named;
  named.reserve(edges.size());
  for (const EdgeRowKey& edge : edges) {
    named.push_back({edge.source, names[static_cast<size_t>(edge.relation)], edge.target});
  }
  return named;
}

}  // namespace

absl::StatusOr<std::shared_ptr<SqliteMapReader>> SqliteMapReader::Open(
    const std::string& store_folder, const std::string& map, size_t cache_bytes) {
  std::shared_ptr<SqliteMapReader> reader(new SqliteMapReader(store_folder, cache_bytes));
  // Before opening: if the file is replaced in between, the reader takes itself for stale.
  reader->identity_ = IdentityOf(store_folder, map);
  DSG_ASSIGN_OR_RETURN(reader->watcher_,
                       OpenMapFile(store_folder, map, Database::Mode::kRead, &reader->spec_));
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
  return ReadRevisions(*lease, before > 0 ? before : kRevisionMax, limit);
}

absl::StatusOr<std::vector<NodeVersion>> SqliteMapReader::NodeVersions(NodeId id, Revision before,
                                                                       int limit) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  Query query(*lease,
              "SELECT key, rev_from, layer, payload, checksum, NULL FROM node"
              " WHERE key = ?1 AND rev_from < ?2"
              " UNION ALL SELECT key, rev_from, layer, payload, checksum, rev_to FROM node_history"
              " WHERE key = ?1 AND rev_from < ?2 ORDER BY rev_from DESC LIMIT ?3");
  query.Bind(KeyOf(id), before > 0 ? before : kRevisionMax, limit);
  std::vector<NodeVersion> versions;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(Node node, NodeFromRow(query, spec_.name));
    const Revision to = query.IsNull(5) ? kRevisionMax : query.Int(5);
    versions.push_back({query.Int(1), to, std::move(node)});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return versions;
}

absl::StatusOr<Touched> SqliteMapReader::TouchedBetween(Revision after, Revision until,
                                                        const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(At(after).status());
  DSG_RETURN_IF_ERROR(At(until).status());
  Touched touched;
  if (after >= until) return touched;
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseAt(until));
  DSG_RETURN_IF_ERROR(CheckStillReadable(*lease, after, generation_));
  TouchedKeys keys;
  DSG_RETURN_IF_ERROR(ReadTouchedLists(*lease, after, until, stop, &keys));
  keys.Normalize();
  touched.nodes = std::move(keys.nodes);
  DSG_ASSIGN_OR_RETURN(touched.edges, NameEdges(*lease, std::move(keys.edges)));
  touched.tracks = std::move(keys.tracks);
  if (!touched.tracks.empty()) {
    DSG_ASSIGN_OR_RETURN(touched.corrected_tracks, ReadCorrected(*lease, after, until));
  }
  touched.mesh_blocks = std::move(keys.mesh_blocks);
  touched.layers_or_labels = keys.layers_or_labels;
  return touched;
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

absl::Status SqliteMapReader::ReadRows(const RowSink& sink, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  return StreamRows(*lease, spec_, sink, stop);
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
