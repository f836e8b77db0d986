// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/writer.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/base/time.h"
#include "schema/codec/payload.h"
#include "schema/store/sqlite/batch_rows.h"
#include "schema/store/sqlite/blob_rows.h"
#include "schema/store/sqlite/erasure.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/page_checksum.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/track_rows.h"
#include "schema/store/tags.h"

namespace dsg::sqlite {
namespace {

// The log is copied back when it has grown to 16 MiB: often enough for short reads, seldom enough
// that commits do not wait for it. In a small map it must not outgrow the map.
constexpr int64_t kLogPagesMax = 4096;
constexpr int64_t kLogPagesMin = 64;
// While forgetting lives on the reserve, its log must not eat it up.
constexpr int kLogPagesOnReserve = 64;

int CheckpointPages(int64_t quota_bytes) {
  if (quota_bytes <= 0) return kLogPagesMax;
  return static_cast<int>(std::clamp(quota_bytes / kPageBytes / 4, kLogPagesMin, kLogPagesMax));
}

const absl::Status& StatusOf(const absl::Status& status) { return status; }
template <typename T>
const absl::Status& StatusOf(const absl::StatusOr<T>& result) {
  return result.status();
}

// What a commit asks of the graph at the head, answered from the writer's own connection.
class DeltaLookup : public CommitSource {
 public:
  /// Both must outlive this.
  DeltaLookup(Database* db, const MapSpec* spec) : db_(*db), spec_(*spec) {}

  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override;
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override;
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override;
  absl::StatusOr<bool> HasAsset(const Sha256& sha256) const override;
  const MapSpec* FindSpec() const override { return &spec_; }
  /// Cost: reads the begins and ends of all segments.
  absl::StatusOr<std::optional<Interval>> FindSpan() const override;

  const MapSpec& spec() const override { return spec_; }
  absl::StatusOr<SessionState> ReadSession(const std::string& session_id) const override;
  absl::StatusOr<std::optional<CommittedDelta>> FindCommitted(const std::string& session_id,
                                                              int64_t sequence) const override;
  absl::StatusOr<std::optional<Node>> ReadNode(NodeId id) const override;
  absl::StatusOr<std::optional<Edge>> ReadEdge(const EdgeKey& key) const override;
  absl::StatusOr<std::vector<Layer>> ReadLayers() const override;

 private:
  absl::StatusOr<std::vector<NodeId>> ReadIds(const char* sql, NodeId id) const;

  Database& db_;
  const MapSpec& spec_;
};

absl::StatusOr<SessionState> DeltaLookup::ReadSession(const std::string& session_id) const {
  return sqlite::ReadSession(db_, session_id);
}

absl::StatusOr<std::optional<CommittedDelta>> DeltaLookup::FindCommitted(
    const std::string& session_id, int64_t sequence) const {
  return sqlite::FindCommitted(db_, session_id, sequence);
}

absl::StatusOr<std::optional<Node>> DeltaLookup::ReadNode(NodeId id) const {
  Query query(db_, "SELECT key, rev_from, layer, payload, checksum FROM node WHERE key = ?1");
  const bool found = query.Bind(KeyOf(id)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<Node>();
  return NodeFromRow(query, db_.map_name());
}

absl::StatusOr<std::optional<Edge>> DeltaLookup::ReadEdge(const EdgeKey& key) const {
  Query query(db_,
              "SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
              " WHERE source = ?1 AND target = ?2"
              " AND relation = (SELECT id FROM relation WHERE name = ?3)");
  const bool found = query.Bind(KeyOf(key.source), KeyOf(key.target), key.relation).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<Edge>();
  return EdgeFromRow(query, key.relation, db_.map_name());
}

absl::StatusOr<std::vector<Layer>> DeltaLookup::ReadLayers() const {
  std::vector<Layer> layers;
  Query query(db_, "SELECT id, name, rank FROM layer");
  while (query.Next()) {
    layers.push_back({static_cast<LayerId>(query.Int(0)), std::string(query.Text(1)),
                      static_cast<int32_t>(query.Int(2))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return layers;
}

// A large delta asks for many nodes, of which only the place counts.
absl::StatusOr<std::optional<GraphLookup::NodeFacts>> DeltaLookup::FindNode(NodeId id) const {
  Query query(db_, "SELECT key, rev_from, layer, payload, checksum FROM node WHERE key = ?1");
  const bool found = query.Bind(KeyOf(id)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<NodeFacts>();
  Node node;
  const NodeRow row{id, query.Int(1), static_cast<LayerId>(query.Int(2)), query.Blob(3)};
  if (query.Int(4) != ChecksumOf(row) || !DecodeNodePlacement(row.payload, &node)) {
    return CorruptRow(db_.map_name(), "node", ToString(id));
  }
  return std::optional<NodeFacts>(
      NodeFacts{static_cast<LayerId>(query.Int(2)), IsAgentKind(node.kind), node.valid,
                node.box_node.isEmpty() ? Box3d() : node.BoxMap(), node.map_T_node.position,
                node.first_observed_ns, node.last_observed_ns});
}

absl::StatusOr<std::optional<Layer>> DeltaLookup::FindLayer(LayerId id) const {
  Query query(db_, "SELECT name, rank FROM layer WHERE id = ?1");
  const bool found = query.Bind(id).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<Layer>();
  return std::optional<Layer>(
      Layer{id, std::string(query.Text(0)), static_cast<int32_t>(query.Int(1))});
}

absl::StatusOr<std::vector<NodeId>> DeltaLookup::ReadIds(const char* sql, NodeId id) const {
  std::vector<NodeId> ids;
  Query query(db_, sql);
  query.Bind(KeyOf(id), relations::kContains);
  while (query.Next()) ids.push_back(IdOf(query.Int(0)));
  DSG_RETURN_IF_ERROR(query.status());
  return ids;
}

absl::StatusOr<std::vector<NodeId>> DeltaLookup::FindParents(NodeId id) const {
  return ReadIds(
      "SELECT source FROM edge WHERE target = ?1 AND relation ="
      " (SELECT id FROM relation WHERE name = ?2)",
      id);
}

absl::StatusOr<std::vector<NodeId>> DeltaLookup::FindChildren(NodeId id) const {
  return ReadIds(
      "SELECT target FROM edge WHERE source = ?1 AND relation ="
      " (SELECT id FROM relation WHERE name = ?2)",
      id);
}

absl::StatusOr<std::optional<TimeNs>> DeltaLookup::FindTrackEnd(NodeId agent) const {
  DSG_ASSIGN_OR_RETURN(const auto mark, FindLastMark(db_, agent));
  if (!mark.has_value() || mark->pose_count == 0) return std::optional<TimeNs>();
  return std::optional<TimeNs>(mark->last_ns);
}

absl::StatusOr<bool> DeltaLookup::HasAsset(const Sha256& sha256) const {
  return sqlite::HasAsset(db_, sha256);
}

absl::StatusOr<std::optional<Interval>> DeltaLookup::FindSpan() const {
  Query query(db_, "SELECT min(t0), max(t1), count(*) FROM trajectory_segment");
  query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (query.Int(2) == 0) return std::optional<Interval>();
  return std::optional<Interval>({query.Int(0), query.Int(1)});
}

// The parts of a commit; see ApplyInOrder.
class CommitParts : public GraphRowsWriter {
 public:
  CommitParts(TrackWriter* tracks, CommitContext* commit)
      : GraphRowsWriter(commit), tracks_(*tracks), commit_(*commit) {}

  absl::Status WriteAssets(const std::vector<Asset>& assets) {
    return sqlite::WriteAssets(assets, &commit_);
  }
  absl::Status EndAgent(NodeId id) {
    DSG_RETURN_IF_ERROR(tracks_.End(id, &commit_));
    DSG_RETURN_IF_ERROR(EndStaysOf(id, &commit_));
    DSG_RETURN_IF_ERROR(EndFactors({id}));
    return EndShapes({id});
  }
  absl::Status Correct(const TrajectoryCorrection& item) { return tracks_.Correct(item, &commit_); }
  absl::Status Append(const TrajectoryAppend& item) { return tracks_.Append(item, &commit_); }
  absl::Status EndFactors(const TrackSpan& span) { return sqlite::EndFactors(span, &commit_); }
  absl::Status WriteFactors(const std::vector<FactorAppend>& factors) {
    return sqlite::WriteFactors(factors, &commit_);
  }
  absl::Status EndShapes(const TrackSpan& span) { return sqlite::EndShapes(span, &commit_); }
  absl::Status WriteShapes(const std::vector<ShapeAppend>& shapes) {
    return sqlite::WriteShapes(shapes, &commit_);
  }
  absl::Status EndStays(const std::vector<StayKey>& keys) {
    return sqlite::EndStays(keys, &commit_);
  }
  absl::Status WriteStays(const std::vector<Stay>& stays) {
    return sqlite::WriteStays(stays, &commit_);
  }
  absl::Status EndMeshBlocks(const std::vector<BlockIndex>& indices) {
    return sqlite::EndMeshBlocks(indices, &commit_);
  }
  absl::Status WriteMeshBlocks(const std::vector<MeshBlock>& blocks) {
    return sqlite::WriteMeshBlocks(blocks, &commit_);
  }

 private:
  TrackWriter& tracks_;
  CommitContext& commit_;
};

}  // namespace

SqliteWriter::SqliteWriter(const std::string& store_folder, const std::string& map,
                           const StoreOptions& options)
    : store_folder_(store_folder),
      map_(map),
      reserve_(MapFolder(store_folder, map), options.reserve_bytes),
      quota_bytes_(options.quota_bytes),
      checkpoint_pages_(CheckpointPages(options.quota_bytes)) {}

absl::StatusOr<std::unique_ptr<SqliteWriter>> SqliteWriter::Open(const std::string& store_folder,
                                                                 const std::string& map,
                                                                 const StoreOptions& options) {
  std::unique_ptr<SqliteWriter> writer(new SqliteWriter(store_folder, map, options));
  // Look before locking, so that asking for a map that is not there leaves nothing behind.
  DSG_RETURN_IF_ERROR(OpenMapFile(store_folder, map, Database::Mode::kRead).status());
  DSG_ASSIGN_OR_RETURN(writer->lock_, WriterLock::Acquire(store_folder, map, options.program));
  DSG_RETURN_IF_ERROR(writer->Reopen());
  writer->reserve_.Make();
  return writer;
}

SqliteWriter::~SqliteWriter() {
  if (db_ != nullptr) db_->Checkpoint(/*truncate=*/true);
}

absl::Status SqliteWriter::Reopen() {
  tracks_.Forget();
  db_.reset();
  DSG_ASSIGN_OR_RETURN(db_, OpenMapFile(store_folder_, map_, Database::Mode::kWrite, &spec_));
  DSG_ASSIGN_OR_RETURN(head_, LoadHead(*db_));
  return absl::OkStatus();
}

absl::StatusOr<SessionState> SqliteWriter::GetSession(const std::string& session_id) {
  if (db_ == nullptr) DSG_RETURN_IF_ERROR(Reopen());
  return ReadSession(*db_, session_id);
}

template <typename Work>
auto SqliteWriter::WithReserve(const Work& work) -> decltype(work()) {
  auto result = work();
  if (ReasonOf(StatusOf(result)) == Reason::kDiskFull && reserve_.Release()) {
    is_on_reserve_ = true;
    // What the log took before is worth more than the pages that it adds to the map.
    if (db_ != nullptr) db_->Checkpoint(/*truncate=*/true);
    result = work();
  }
  reserve_.Make();
  is_on_reserve_ = is_on_reserve_ && !reserve_.IsThere();
  return result;
}

absl::StatusOr<CommitResult> SqliteWriter::Commit(GraphDelta delta) {
  DSG_RETURN_IF_ERROR(CheckForgetting(delta));
  if (!delta.is_forgetting) return CommitOnce(std::move(delta));
  return WithReserve([&] { return CommitOnce(delta); });
}

absl::StatusOr<CommitResult> SqliteWriter::CommitOnce(GraphDelta delta) {
  if (db_ == nullptr) DSG_RETURN_IF_ERROR(Reopen());
  const DeltaIdentity identity = IdentityOfDelta(delta);
  // Also around the checks: each question outside of a transaction would lock the file anew.
  DSG_RETURN_IF_ERROR(db_->Execute("BEGIN IMMEDIATE"));
  CommitContext commit{*db_, spec_, NextRecord(head_, delta, WallClockNs()), identity.checksum};
  const auto replay = PrepareAndApply(identity, &delta, &commit);
  if (!replay.ok() || replay->has_value()) {
    // SQLite may have rolled back already; then this one has nothing to do.
    db_->Execute("ROLLBACK").IgnoreError();
    tracks_.Forget();
    DSG_RETURN_IF_ERROR(replay.status());
    return **replay;
  }
  const absl::Status committed = db_->Execute("COMMIT");
  if (!committed.ok()) return Settle(identity, committed);
  head_ = commit.head;
  const bool is_log_long =
      db_->wal_pages() > (is_on_reserve_ ? kLogPagesOnReserve : checkpoint_pages_);
  if (is_log_long) db_->Checkpoint(/*truncate=*/is_on_reserve_);
  return CommitResult{head_.info.revision, false};
}

absl::StatusOr<std::optional<CommitResult>> SqliteWriter::PrepareAndApply(
    const DeltaIdentity& identity, GraphDelta* delta, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(auto replay, PrepareCommit(DeltaLookup(db_.get(), &spec_), identity,
                                                  head_.info.revision, delta));
  if (replay.has_value()) return replay;
  DSG_ASSIGN_OR_RETURN(const int64_t pages_before, db_->QueryInt("PRAGMA page_count"));
  DSG_RETURN_IF_ERROR(Apply(*delta, commit));
  DSG_RETURN_IF_ERROR(CheckQuota(*delta, pages_before));
  return std::optional<CommitResult>();
}

absl::Status SqliteWriter::CheckQuota(const GraphDelta& delta, int64_t pages_before) {
  if (quota_bytes_ <= 0 || delta.is_forgetting) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const int64_t pages, db_->QueryInt("PRAGMA page_count"));
  // Pages that forgetting left free are used again without growing.
  if (pages <= pages_before || pages * kPageBytes <= quota_bytes_) return absl::OkStatus();
  return MakeError(Reason::kQuotaExceeded,
                   absl::StrCat("map \"", map_, "\" may have ", quota_bytes_,
                                " bytes and the delta would make it ", pages * kPageBytes,
                                "; nothing was written: forget something (`dsg prune`, `dsg "
                                "compact`) or raise the quota"),
                   {{"map", map_}, {"quota_bytes", absl::StrCat(quota_bytes_)}});
}

absl::Status SqliteWriter::Apply(const GraphDelta& delta, CommitContext* commit) {
  CommitParts parts(&tracks_, commit);
  DSG_RETURN_IF_ERROR(ApplyInOrder(delta, &parts));
  DSG_RETURN_IF_ERROR(InsertTouched(commit->db, commit->revision(), &commit->touched));
  Seal(head_.info.digest, &commit->head);
  return InsertRevision(*commit);
}

// A failed COMMIT says nothing about the disk: the row may be there after recovery. Only a fresh
// connection that has read the log again can tell.
absl::StatusOr<CommitResult> SqliteWriter::Settle(const DeltaIdentity& delta,
                                                  const absl::Status& failure) {
  const absl::Status reopened = Reopen();
  if (!reopened.ok()) {
    db_.reset();
    return MakeError(
        Reason::kCommitOutcomeUnknown,
        absl::StrCat("commit of session ", delta.session_id, " sequence ", delta.sequence,
                     " failed (", failure.message(), ") and the map cannot be reopened (",
                     reopened.message(), "); send it again when the disk is back"),
        {{"map", map_}, {"sequence", absl::StrCat(delta.sequence)}});
  }
  DSG_ASSIGN_OR_RETURN(const auto replay, FindReplay(DeltaLookup(db_.get(), &spec_), delta));
  if (replay.has_value()) return CommitResult{replay->revision, false};
  return failure;
}

absl::Status SqliteWriter::CheckRevision(Revision revision) {
  DSG_ASSIGN_OR_RETURN(const Readable readable, LoadReadable(*db_));
  return CheckReadable(map_, revision, head_.info.revision, readable);
}

absl::StatusOr<Tag> SqliteWriter::SetTag(const std::string& name, Revision revision,
                                         const std::string& note) {
  if (db_ == nullptr) DSG_RETURN_IF_ERROR(Reopen());
  const Tag tag{name, revision, WallClockNs(), note};
  DSG_RETURN_IF_ERROR(CheckTag(tag));
  DSG_RETURN_IF_ERROR(CheckRevision(revision));
  if (compaction_.has_value()) compaction_->BeginAgain();
  DSG_RETURN_IF_ERROR(WriteTag(*db_, tag));
  return tag;
}

absl::Status SqliteWriter::RemoveTag(const std::string& name) {
  if (db_ == nullptr) DSG_RETURN_IF_ERROR(Reopen());
  if (compaction_.has_value()) compaction_->BeginAgain();
  return DeleteTag(*db_, name);
}

absl::StatusOr<CompactReport> SqliteWriter::Compact(Revision keep_from, const StopCheck& stop,
                                                    const Progress& progress) {
  return WithReserve([&] { return CompactOnce(keep_from, stop, progress); });
}

absl::StatusOr<CompactReport> SqliteWriter::CompactOnce(Revision keep_from, const StopCheck& stop,
                                                        const Progress& progress) {
  if (db_ == nullptr) DSG_RETURN_IF_ERROR(Reopen());
  DSG_RETURN_IF_ERROR(CheckRevision(keep_from));
  DSG_ASSIGN_OR_RETURN(const Readable readable, LoadReadable(*db_));
  // A tagged revision can be read, but what lies after it may be gone: nothing comes back.
  keep_from = std::max(keep_from, readable.oldest);
  if (!compaction_.has_value() || compaction_->keep_from != keep_from) {
    compaction_ = Compaction{.keep_from = keep_from};
    compaction_->report.bytes_before = BytesOnDisk(store_folder_, map_);
  }
  DSG_RETURN_IF_ERROR(CompactMap(*db_, stop, progress, &*compaction_));
  CompactReport report = compaction_->report;
  compaction_.reset();
  report.bytes_after = BytesOnDisk(store_folder_, map_);
  return report;
}

absl::Status SqliteWriter::NoteErasure(const Erasure& erasure, Revision planned_at) {
  return WithReserve([&] { return NoteErasureOnce(erasure, planned_at); });
}

absl::Status SqliteWriter::NoteErasureOnce(const Erasure& erasure, Revision planned_at) {
  if (db_ == nullptr) DSG_RETURN_IF_ERROR(Reopen());
  DSG_ASSIGN_OR_RETURN(const EraseList list, ListIn(*db_, erasure));
  if (list.size() == 0) return absl::OkStatus();
  return InTransaction(*db_, [&]() -> absl::Status {
    DSG_RETURN_IF_ERROR(db_->Execute("UPDATE map SET is_erasing = 1 WHERE NOT is_erasing"));
    return AddNotedErasure(*db_, planned_at, list);
  });
}

absl::StatusOr<EraseReport> SqliteWriter::Erase(const Erasure& erasure, const StopCheck& stop,
                                                const Progress& progress) {
  return WithReserve([&] { return EraseOnce(erasure, stop, progress); });
}

absl::StatusOr<EraseReport> SqliteWriter::EraseOnce(const Erasure& erasure, const StopCheck& stop,
                                                    const Progress& progress) {
  if (db_ == nullptr) DSG_RETURN_IF_ERROR(Reopen());
  EraseReport report;
  report.bytes_before = BytesOnDisk(store_folder_, map_);
  const absl::Status erased = EraseFromMap(*db_, spec_, erasure, stop, progress, &report);
  // Digests of the past are others now, and tracks that were open may be gone.
  const absl::Status reopened = Reopen();
  if (!reopened.ok()) db_.reset();
  DSG_RETURN_IF_ERROR(erased);
  DSG_RETURN_IF_ERROR(reopened);
  report.bytes_after = BytesOnDisk(store_folder_, map_);
  report.other_files = ListOtherFiles(store_folder_, map_);
  return report;
}

}  // namespace dsg::sqlite
