// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/pending_erasure.h"

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/codec/bit_stream.h"
#include "schema/store/sqlite/commit.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

struct Encoded {
  std::string keys;
  std::string spans;
  bool operator==(const Encoded&) const = default;
};

int64_t ChecksumOf(int64_t assets, std::string_view keys, std::string_view spans) {
  std::string both(keys);
  both += spans;
  return RowChecksum({assets, static_cast<int64_t>(keys.size())}, both);
}

Encoded Encode(const EraseList& list) {
  Encoded encoded{EncodeTouched(list.keys), {}};
  for (const TrackSpan& span : list.spans) {
    AppendFixed(span.agent.value, &encoded.spans);
    AppendFixed(span.from_ns, &encoded.spans);
    AppendFixed(span.to_ns, &encoded.spans);
  }
  return encoded;
}

bool Decode(std::string_view keys, std::string_view spans, EraseList* list) {
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

int64_t NotedChecksum(Revision planned_at, int64_t assets, const Encoded& encoded) {
  return RowChecksum({planned_at, ChecksumOf(assets, encoded.keys, encoded.spans)}, {});
}

absl::StatusOr<std::vector<NotedErasure>> ReadNotedErasures(Database& db) {
  std::vector<NotedErasure> all;
  Query query(db, "SELECT id, revision, assets, checksum, keys, spans FROM noted_erasure");
  while (query.Next()) {
    NotedErasure noted{query.Int(0), query.Int(1), {}};
    noted.list.assets = query.Int(2) != 0;
    const Encoded encoded{std::string(query.Blob(4)), std::string(query.Blob(5))};
    if (query.Int(3) != NotedChecksum(noted.planned_at, query.Int(2), encoded) ||
        !Decode(encoded.keys, encoded.spans, &noted.list)) {
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
  const bool is_sound = query.Int(1) == ChecksumOf(query.Int(0), query.Blob(2), query.Blob(3)) &&
                        Decode(query.Blob(2), query.Blob(3), &list);
  if (!is_sound) return CorruptRow(db.map_name(), "pending_erasure", "1");
  list.assets = query.Int(0) != 0;
  return list;
}

absl::Status WritePendingErasure(Database& db, const EraseList& list) {
  DSG_ASSIGN_OR_RETURN(const EraseList stored, ReadPendingErasure(db));
  const Encoded encoded = Encode(list);
  if (stored.size() > 0 && stored.assets == list.assets && Encode(stored) == encoded) {
    return absl::OkStatus();
  }
  const int64_t assets = list.assets ? 1 : 0;
  return Query(db,
               "INSERT OR REPLACE INTO pending_erasure (one, assets, keys, spans, checksum)"
               " VALUES (1, ?1, ?2, ?3, ?4)")
      .Bind(assets, Query::BlobView{encoded.keys}, Query::BlobView{encoded.spans},
            ChecksumOf(assets, encoded.keys, encoded.spans))
      .Run();
}

absl::Status DropPendingErasure(Database& db) {
  return Query(db, "DELETE FROM pending_erasure").Run();
}

absl::Status AddNotedErasure(Database& db, Revision planned_at, const EraseList& list) {
  const Encoded encoded = Encode(list);
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

}  // namespace dsg::sqlite
