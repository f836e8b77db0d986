// SPDX-License-Identifier: Apache-2.0
// Rows go in steps of some megabytes, each with the records of all revisions made right; then what
// they left in the file is overwritten and given back.
#include "schema/store/sqlite/erasure.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/codec/bit_stream.h"
#include "schema/store/sqlite/blob_rows.h"
#include "schema/store/sqlite/erased_rows.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/space.h"

namespace dsg::sqlite {
namespace {

struct EncodedList {
  std::string keys;
  std::string spans;
  bool operator==(const EncodedList&) const = default;
};

int64_t ListChecksum(int64_t assets, std::string_view keys, std::string_view spans) {
  std::string both(keys);
  both += spans;
  return RowChecksum({assets, static_cast<int64_t>(keys.size())}, both);
}

EncodedList EncodeList(const EraseList& list) {
  EncodedList encoded{EncodeTouched(list.keys), {}};
  for (const TrackSpan& span : list.spans) {
    AppendFixed(span.agent.value, &encoded.spans);
    AppendFixed(span.from_ns, &encoded.spans);
    AppendFixed(span.to_ns, &encoded.spans);
  }
  return encoded;
}

bool DecodeList(std::string_view keys, std::string_view spans, EraseList* list) {
  constexpr size_t kSpanBytes = 24;
  if (spans.size() % kSpanBytes != 0 || !DecodeTouched(keys, &list->keys)) return false;
  ByteReader reader(spans);
  for (size_t i = 0; i < spans.size() / kSpanBytes; ++i) {
    TrackSpan span;
    span.agent = NodeId(reader.Fixed<uint64_t>());
    span.from_ns = reader.Fixed<TimeNs>();
    span.to_ns = reader.Fixed<TimeNs>();
    list->spans.push_back(span);
  }
  return true;
}

struct NotedErasure {
  int64_t id = 0;
  Revision planned_at = 0;
  EraseList list;
};

int64_t NotedChecksum(Revision planned_at, int64_t assets, const EncodedList& encoded) {
  return RowChecksum({planned_at, ListChecksum(assets, encoded.keys, encoded.spans)}, {});
}

absl::StatusOr<std::vector<NotedErasure>> ReadNotedErasures(Database& db) {
  std::vector<NotedErasure> all;
  Query query(db, "SELECT id, revision, assets, checksum, keys, spans FROM noted_erasure");
  while (query.Next()) {
    NotedErasure noted{query.Int(0), query.Int(1), {}};
    noted.list.assets = query.Int(2) != 0;
    const EncodedList encoded{std::string(query.Blob(4)), std::string(query.Blob(5))};
    if (query.Int(3) != NotedChecksum(noted.planned_at, query.Int(2), encoded) ||
        !DecodeList(encoded.keys, encoded.spans, &noted.list)) {
      return CorruptRow(db.map_name(), "noted_erasure", absl::StrCat(noted.id));
    }
    all.push_back(std::move(noted));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return all;
}

absl::Status DropNotedErasure(Database& db, int64_t id) {
  return Query(db, "DELETE FROM noted_erasure WHERE id = ?1").Bind(id).Run();
}

// Whether a statement finds anything.
absl::StatusOr<bool> Finds(Query* query) {
  const bool found = query->Next();
  DSG_RETURN_IF_ERROR(query->status());
  return found;
}

// Of what was there at `planned_at` and still is.
BelievedSince BelievedIn(Database* database, Revision planned_at) {
  Database& db = *database;
  return {
      [&db, planned_at](NodeId id) {
        Query row(db, "SELECT 1 FROM node WHERE key = ?1 AND rev_from <= ?2");
        return Finds(&row.Bind(KeyOf(id), planned_at));
      },
      [&db, planned_at](const EdgeRowKey& edge) {
        Query row(db,
                  "SELECT 1 FROM edge WHERE source = ?1 AND relation = ?2 AND target = ?3"
                  " AND rev_from <= ?4");
        return Finds(&row.Bind(KeyOf(edge.source), edge.relation, KeyOf(edge.target), planned_at));
      },
      [&db, planned_at](const BlockIndex& index) {
        Query row(db,
                  "SELECT 1 FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3 AND rev_from <= ?4");
        return Finds(&row.Bind(index.x, index.y, index.z, planned_at));
      },
      [&db, planned_at](const TrackSpan& span) {
        Query row(db,
                  "SELECT 1 FROM track JOIN trajectory_segment"
                  " ON id BETWEEN slot << ?5 AND (slot + 1 << ?5) - 1"
                  " WHERE agent = ?1 AND t1 >= ?2 AND t0 < ?3 AND rev_from <= ?4");
        return Finds(
            &row.Bind(KeyOf(span.agent), span.from_ns, span.to_ns, planned_at, kSegmentTimeBits));
      },
  };
}

class Eraser {
 public:
  Eraser(Database* db, const MapSpec& spec, const Erasure& erasure, const StopCheck& stop,
         const Progress& progress, const EraseStep& step, EraseReport* report)
      : db_(*db),
        spec_(spec),
        erasure_(erasure),
        stop_(stop),
        progress_(progress),
        step_(step),
        report_(*report) {}

  absl::Status Run() {
    DSG_RETURN_IF_ERROR(CheckAgents());
    DSG_RETURN_IF_ERROR(Begin());
    DSG_RETURN_IF_ERROR(EraseRows());
    Tell(0.7);
    if (list_.assets) DSG_RETURN_IF_ERROR(EraseAssets());
    DSG_RETURN_IF_ERROR(EndRows());
    DSG_RETURN_IF_ERROR(WipeBoxes(db_, stop_));
    Tell(0.8);
    DSG_RETURN_IF_ERROR(GivePagesBack(db_, stop_));
    Tell(0.95);
    report_.is_clean = db_.Checkpoint(/*truncate=*/true);
    if (report_.is_clean && !report_.is_pending) {
      DSG_RETURN_IF_ERROR(db_.Execute("UPDATE map SET is_erasing = 0 WHERE is_erasing"));
    }
    Tell(1.0);
    return absl::OkStatus();
  }

 private:
  void Tell(double fraction) const {
    if (progress_) progress_(fraction);
  }

  // Once rows are gone nothing else tells what was to go with them, nor that the file still holds
  // their bytes.
  absl::Status Begin() {
    DSG_ASSIGN_OR_RETURN(const int64_t is_erasing, db_.QueryInt("SELECT is_erasing FROM map"));
    report_.was_pending = is_erasing != 0;
    DSG_ASSIGN_OR_RETURN(list_, ListIn(db_, erasure_));
    EraseList earlier;
    const absl::Status noted = InTransaction(db_, [&]() -> absl::Status {
      DSG_ASSIGN_OR_RETURN(earlier, TakeRipeErasures(db_, list_, &report_.is_pending));
      DSG_ASSIGN_OR_RETURN(const EraseList pending, ReadPendingErasure(db_));
      earlier.Add(pending);
      list_.Add(earlier);
      if (list_.size() == 0) return absl::OkStatus();
      DSG_RETURN_IF_ERROR(db_.Execute("UPDATE map SET is_erasing = 1 WHERE NOT is_erasing"));
      DSG_RETURN_IF_ERROR(ForgetDeltaChecksums(db_));
      return WritePendingErasure(db_, list_);
    });
    DSG_RETURN_IF_ERROR(noted);
    return LeaveAgentsThatAreBack(earlier);
  }

  // Since the earlier erasures began.
  absl::Status LeaveAgentsThatAreBack(const EraseList& earlier) {
    for (const NodeId id : earlier.keys.nodes) {
      DSG_ASSIGN_OR_RETURN(const bool is_agent, IsAgentThatIsThere(id));
      if (is_agent) report_.left_agents.push_back(id);
    }
    std::erase_if(list_.keys.nodes, [&](NodeId id) {
      return std::binary_search(report_.left_agents.begin(), report_.left_agents.end(), id);
    });
    return absl::OkStatus();
  }

  // The last of what needs the list. What is left to do is to wipe bytes.
  absl::Status EndRows() {
    if (list_.size() + report_.left_agents.size() == 0) return absl::OkStatus();
    return InTransaction(db_, [&]() -> absl::Status {
      if (!list_.keys.nodes.empty() || !list_.spans.empty()) {
        DSG_RETURN_IF_ERROR(RepairPoseTimes(db_));
      }
      return DropPendingErasure(db_);
    });
  }

  absl::StatusOr<bool> IsAgentThatIsThere(NodeId id) {
    Query query(db_, "SELECT key, rev_from, layer, payload, checksum FROM node WHERE key = ?1");
    const bool is_there = query.Bind(KeyOf(id)).Next();
    DSG_RETURN_IF_ERROR(query.status());
    if (!is_there) return false;
    DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, spec_.name));
    return IsAgentKind(node.kind);
  }

  absl::Status CheckAgents() {
    for (const NodeId id : erasure_.nodes) {
      DSG_ASSIGN_OR_RETURN(const bool is_agent, IsAgentThatIsThere(id));
      if (is_agent) return AgentIsThereError(spec_.name, id);
    }
    return absl::OkStatus();
  }

  absl::Status EraseItem(size_t item, ErasedRows* erased) {
    const TouchedKeys& keys = list_.keys;
    if (item < keys.nodes.size()) return EraseNodeRows(keys.nodes[item], erased);
    item -= keys.nodes.size();
    if (item < keys.edges.size()) return EraseEdgeRows(keys.edges[item], erased);
    item -= keys.edges.size();
    if (item < keys.mesh_blocks.size()) return EraseMeshRows(keys.mesh_blocks[item], erased);
    const TrackSpan& span = list_.spans[item - keys.mesh_blocks.size()];
    // How far stays reached is told by the track.
    DSG_RETURN_IF_ERROR(EraseStayRows(span, erased));
    DSG_RETURN_IF_ERROR(EraseBatchRows(span, erased));
    return ErasePoses(span, erased);
  }

  absl::Status EraseRows() {
    const size_t count = list_.size();
    for (size_t next = 0; next < count;) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      ErasedRows erased{db_, spec_};
      size_t reached = next;
      const absl::Status done = InTransaction(db_, [&]() -> absl::Status {
        while (reached < count && erased.byte_count < step_.bytes &&
               erased.row_count < step_.rows) {
          DSG_RETURN_IF_ERROR(EraseItem(reached++, &erased));
        }
        if (list_.assets) DSG_RETURN_IF_ERROR(AddDoubtfulAssets(db_, erased.assets));
        return erased.past.Apply(db_);
      });
      DSG_RETURN_IF_ERROR(done);
      next = reached;
      report_.row_count += erased.row_count;
      report_.pose_count += erased.pose_count;
      CopyLogBack(db_);
      Tell(0.7 * static_cast<double>(next) / static_cast<double>(count));
    }
    return absl::OkStatus();
  }

  // Those that rows referred to which are gone now, and none that is left; and old ones to which
  // nothing refers. A new one may be about to be referred to.
  absl::Status EraseAssets() {
    DSG_ASSIGN_OR_RETURN(const std::vector<StoredAsset> stored, ListAssets(db_));
    DSG_ASSIGN_OR_RETURN(const std::set<Sha256> doubtful, ReadDoubtfulAssets(db_));
    if (stored.empty() && doubtful.empty()) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const Readable readable, LoadReadable(db_));
    DSG_ASSIGN_OR_RETURN(const std::set<Sha256> used, ReadReferences(db_, stored));
    for (const StoredAsset& asset : stored) {
      const bool is_old = asset.rev_from < readable.oldest || doubtful.contains(asset.sha256);
      if (!is_old || used.contains(asset.sha256)) continue;
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      DSG_RETURN_IF_ERROR(InTransaction(db_, [&] { return EraseAsset(asset); }));
      ++report_.asset_count;
      CopyLogBack(db_);
    }
    return Query(db_, "DELETE FROM doubtful_asset").Run();
  }

  absl::Status EraseAsset(const StoredAsset& asset) {
    ErasedRows erased{db_, spec_};
    RowSums sums;
    sums.Add(AssetRow{asset.rev_from, BytesOf(asset.sha256)});
    erased.past.Take(sums, asset.rev_from, kRevisionMax);
    DSG_RETURN_IF_ERROR(DeleteAsset(db_, asset.sha256));
    return erased.past.Apply(db_);
  }

  Database& db_;
  const MapSpec& spec_;
  const Erasure& erasure_;
  /// What is named, and what an earlier erasure left.
  EraseList list_;
  const StopCheck& stop_;
  const Progress& progress_;
  const EraseStep step_;
  EraseReport& report_;
};

}  // namespace

absl::StatusOr<EraseList> ListIn(Database& db, const Erasure& erasure) {
  return ListOf(erasure, [&db](const std::string& name) { return FindRelation(db, name); });
}

absl::StatusOr<EraseList> ReadPendingErasure(Database& db) {
  EraseList list;
  Query query(db, "SELECT assets, checksum, keys, spans FROM pending_erasure");
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return list;
  const bool is_sound = query.Int(1) == ListChecksum(query.Int(0), query.Blob(2), query.Blob(3)) &&
                        DecodeList(query.Blob(2), query.Blob(3), &list);
  if (!is_sound) return CorruptRow(db.map_name(), "pending_erasure", "1");
  list.assets = query.Int(0) != 0;
  return list;
}

absl::Status WritePendingErasure(Database& db, const EraseList& list) {
  DSG_ASSIGN_OR_RETURN(const EraseList stored, ReadPendingErasure(db));
  const EncodedList encoded = EncodeList(list);
  if (stored.size() > 0 && stored.assets == list.assets && EncodeList(stored) == encoded) {
    return absl::OkStatus();
  }
  const int64_t assets = list.assets ? 1 : 0;
  return Query(db,
               "INSERT OR REPLACE INTO pending_erasure (one, assets, keys, spans, checksum)"
               " VALUES (1, ?1, ?2, ?3, ?4)")
      .Bind(assets, Query::BlobView{encoded.keys}, Query::BlobView{encoded.spans},
            ListChecksum(assets, encoded.keys, encoded.spans))
      .Run();
}

absl::Status DropPendingErasure(Database& db) {
  return Query(db, "DELETE FROM pending_erasure").Run();
}

absl::Status AddNotedErasure(Database& db, Revision planned_at, const EraseList& list) {
  const EncodedList encoded = EncodeList(list);
  const int64_t assets = list.assets ? 1 : 0;
  return Query(db,
               "INSERT INTO noted_erasure (revision, assets, checksum, keys, spans)"
               " VALUES (?1, ?2, ?3, ?4, ?5)")
      .Bind(planned_at, assets, NotedChecksum(planned_at, assets, encoded),
            Query::BlobView{encoded.keys}, Query::BlobView{encoded.spans})
      .Run();
}

absl::StatusOr<EraseList> TakeRipeErasures(Database& db, const EraseList& named, bool* is_rest) {
  EraseList ripe;
  *is_rest = false;
  DSG_ASSIGN_OR_RETURN(const std::vector<NotedErasure> all, ReadNotedErasures(db));
  for (const NotedErasure& noted : all) {
    DSG_ASSIGN_OR_RETURN(const RipeAndRest sorted,
                         SortByRipeness(noted.list, named, BelievedIn(&db, noted.planned_at)));
    if (sorted.ripe.size() == 0) {
      *is_rest = true;
      continue;
    }
    ripe.Add(sorted.ripe);
    DSG_RETURN_IF_ERROR(DropNotedErasure(db, noted.id));
    if (sorted.rest.size() == 0) continue;
    *is_rest = true;
    DSG_RETURN_IF_ERROR(AddNotedErasure(db, noted.planned_at, sorted.rest));
  }
  return ripe;
}

absl::StatusOr<std::optional<PendingErasure>> GetPendingErasure(Database& db) {
  DSG_ASSIGN_OR_RETURN(const int64_t is_erasing, db.QueryInt("SELECT is_erasing FROM map"));
  if (is_erasing == 0) return std::optional<PendingErasure>();
  DSG_ASSIGN_OR_RETURN(EraseList list, ReadPendingErasure(db));
  DSG_ASSIGN_OR_RETURN(const std::vector<NotedErasure> all, ReadNotedErasures(db));
  for (const NotedErasure& noted : all) list.Add(noted.list);
  return std::optional<PendingErasure>(CountsOf(list));
}

absl::Status EraseFromMap(Database& db, const MapSpec& spec, const Erasure& erasure,
                          const StopCheck& stop, const Progress& progress, EraseReport* report,
                          const EraseStep& step) {
  return Eraser(&db, spec, erasure, stop, progress, step, report).Run();
}

}  // namespace dsg::sqlite
