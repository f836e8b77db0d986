// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/pending_erasure.h"

#include <algorithm>
#include <tuple>

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

}  // namespace dsg::sqlite
