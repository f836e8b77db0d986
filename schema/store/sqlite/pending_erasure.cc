// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/pending_erasure.h"

#include <algorithm>
#include <tuple>

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

bool Covers(const std::vector<TrackSpan>& spans, const TrackSpan& span) {
  return std::any_of(spans.begin(), spans.end(), [&](const TrackSpan& other) {
    return other.agent == span.agent && other.from_ns <= span.from_ns && other.to_ns >= span.to_ns;
  });
}

// Sorts what is noted into what is ripe and what its commits have yet to retire.
class Ripener {
 public:
  Ripener(Database* db, const EraseList& named, const NotedErasure& noted)
      : db_(*db), named_(named), noted_(noted) {}

  absl::Status Run() {
    ripe.assets = rest.assets = noted_.list.assets;
    for (const NodeId id : noted_.list.keys.nodes) {
      Query row(db_, "SELECT 1 FROM node WHERE key = ?1 AND rev_from <= ?2");
      row.Bind(KeyOf(id), noted_.planned_at);
      DSG_RETURN_IF_ERROR(Sort(id, &TouchedKeys::nodes, &row));
    }
    for (const EdgeRowKey& edge : noted_.list.keys.edges) {
      Query row(db_,
                "SELECT 1 FROM edge WHERE source = ?1 AND relation = ?2 AND target = ?3"
                " AND rev_from <= ?4");
      row.Bind(KeyOf(edge.source), edge.relation, KeyOf(edge.target), noted_.planned_at);
      DSG_RETURN_IF_ERROR(Sort(edge, &TouchedKeys::edges, &row));
    }
    for (const BlockIndex& index : noted_.list.keys.mesh_blocks) {
      Query row(db_,
                "SELECT 1 FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3 AND rev_from <= ?4");
      row.Bind(index.x, index.y, index.z, noted_.planned_at);
      DSG_RETURN_IF_ERROR(Sort(index, &TouchedKeys::mesh_blocks, &row));
    }
    for (const TrackSpan& span : noted_.list.spans) {
      Query row(db_,
                "SELECT 1 FROM track JOIN trajectory_segment"
                " ON id BETWEEN slot << ?5 AND (slot + 1 << ?5) - 1"
                " WHERE agent = ?1 AND t1 >= ?2 AND t0 < ?3 AND rev_from <= ?4");
      const bool is_believed =
          row.Bind(KeyOf(span.agent), span.from_ns, span.to_ns, noted_.planned_at, kSegmentTimeBits)
              .Next();
      DSG_RETURN_IF_ERROR(row.status());
      (is_believed && !Covers(named_.spans, span) ? rest : ripe).spans.push_back(span);
    }
    return absl::OkStatus();
  }

  EraseList ripe;
  EraseList rest;

 private:
  template <typename Key>
  absl::Status Sort(const Key& key, std::vector<Key> TouchedKeys::*part, Query* row) {
    const bool is_believed = row->Next();
    DSG_RETURN_IF_ERROR(row->status());
    const std::vector<Key>& named = named_.keys.*part;
    const bool is_named = std::binary_search(named.begin(), named.end(), key);
    ((is_believed && !is_named ? rest : ripe).keys.*part).push_back(key);
    return absl::OkStatus();
  }

  Database& db_;
  const EraseList& named_;
  const NotedErasure& noted_;
};

void JoinSpans(std::vector<TrackSpan>* spans) {
  std::sort(spans->begin(), spans->end(), [](const TrackSpan& a, const TrackSpan& b) {
    return std::tie(a.agent, a.from_ns, a.to_ns) < std::tie(b.agent, b.from_ns, b.to_ns);
  });
  std::vector<TrackSpan> joined;
  for (const TrackSpan& span : *spans) {
    const bool touches =
        !joined.empty() && joined.back().agent == span.agent && span.from_ns <= joined.back().to_ns;
    if (touches) {
      joined.back().to_ns = std::max(joined.back().to_ns, span.to_ns);
    } else {
      joined.push_back(span);
    }
  }
  *spans = std::move(joined);
}

}  // namespace

size_t EraseList::size() const {
  return keys.nodes.size() + keys.edges.size() + keys.mesh_blocks.size() + spans.size();
}

void EraseList::Add(const EraseList& other) {
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  append(other.keys.nodes, &keys.nodes);
  append(other.keys.edges, &keys.edges);
  append(other.keys.mesh_blocks, &keys.mesh_blocks);
  append(other.spans, &spans);
  assets = assets || other.assets;
  keys.Normalize();
  JoinSpans(&spans);
}

absl::StatusOr<EraseList> ListOf(Database& db, const Erasure& erasure) {
  EraseList named;
  named.keys.nodes = erasure.nodes;
  named.keys.mesh_blocks = erasure.mesh_blocks;
  named.spans = erasure.tracks;
  named.assets = erasure.assets;
  for (const EdgeKey& edge : erasure.edges) {
    DSG_ASSIGN_OR_RETURN(const int64_t relation, FindRelation(db, edge.relation));
    if (relation != 0) named.keys.edges.push_back({edge.source, relation, edge.target});
  }
  EraseList list;
  list.Add(named);
  return list;
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
    Ripener ripener(&db, named, noted);
    DSG_RETURN_IF_ERROR(ripener.Run());
    if (ripener.ripe.size() == 0) {
      *is_rest = true;
      continue;
    }
    ripe.Add(ripener.ripe);
    DSG_RETURN_IF_ERROR(DropNotedErasure(db, noted.id));
    if (ripener.rest.size() == 0) continue;
    *is_rest = true;
    DSG_RETURN_IF_ERROR(AddNotedErasure(db, noted.planned_at, ripener.rest));
  }
  return ripe;
}

absl::StatusOr<std::optional<PendingErasure>> GetPendingErasure(Database& db) {
  DSG_ASSIGN_OR_RETURN(const int64_t is_erasing, db.QueryInt("SELECT is_erasing FROM map"));
  if (is_erasing == 0) return std::optional<PendingErasure>();
  DSG_ASSIGN_OR_RETURN(EraseList list, ReadPendingErasure(db));
  DSG_ASSIGN_OR_RETURN(const std::vector<NotedErasure> all, ReadNotedErasures(db));
  for (const NotedErasure& noted : all) list.Add(noted.list);
  const auto count = [](const auto& items) { return static_cast<int64_t>(items.size()); };
  return std::optional<PendingErasure>({count(list.keys.nodes), count(list.keys.edges),
                                        count(list.keys.mesh_blocks), count(list.spans)});
}

}  // namespace dsg::sqlite
