// SPDX-License-Identifier: Apache-2.0
// All nodes and all edges of a snapshot, in the order in which their rows lie.
#include <limits>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/snapshot.h"

namespace dsg::sqlite {
namespace {

// Rows read by one statement: some milliseconds, so that no read transaction pins the log.
constexpr int kBatchRows = 2048;
constexpr int64_t kLowest = std::numeric_limits<int64_t>::min();
constexpr int64_t kHighest = std::numeric_limits<int64_t>::max();

// Runs a statement again and again, each time after the last row of the time before, until it
// gives no full batch. `bind` binds where to go on; `take` takes a row and notes where it was.
template <typename Bind, typename Take>
absl::Status RunInBatches(SqliteMapReader* reader, Revision revision, const char* sql,
                          const StopCheck& stop, const Bind& bind, const Take& take) {
  for (;;) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(auto lease, reader->LeaseAt(revision));
    Query query(*lease, sql);
    bind(&query);
    int row_count = 0;
    for (; query.Next(); ++row_count) DSG_RETURN_IF_ERROR(take(query));
    DSG_RETURN_IF_ERROR(query.status());
    if (row_count < kBatchRows) return absl::OkStatus();
  }
}

absl::StatusOr<std::unordered_map<int64_t, std::string>> ReadRelations(SqliteMapReader* reader,
                                                                       Revision revision) {
  DSG_ASSIGN_OR_RETURN(auto lease, reader->LeaseAt(revision));
  std::unordered_map<int64_t, std::string> names;
  Query query(*lease, "SELECT id, name FROM relation");
  while (query.Next()) names[query.Int(0)] = query.Text(1);
  DSG_RETURN_IF_ERROR(query.status());
  return names;
}

}  // namespace

// The history comes last: a row that a commit ends after it was read here is shown again, but none
// is missed.
absl::Status SqliteSnapshot::ReadAllNodes(const StopCheck& stop,
                                          const std::function<void(const Node&)>& visit) const {
  const auto show = [&](const Query& query) -> absl::Status {
    DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, spec().name));
    visit(node);
    return absl::OkStatus();
  };
  int64_t after_key = kLowest;
  DSG_RETURN_IF_ERROR(RunInBatches(
      reader_.get(), revision(),
      "SELECT key, rev_from, layer, payload, checksum FROM node"
      " WHERE key > ?1 AND rev_from <= ?2 ORDER BY key LIMIT ?3",
      stop, [&](Query* query) { query->Bind(after_key, revision(), kBatchRows); },
      [&](const Query& query) {
        after_key = query.Int(0);
        return show(query);
      }));
  // Few rows end later than a revision near the head.
  Revision after_end = revision();
  int64_t after_row = kHighest;
  return RunInBatches(
      reader_.get(), revision(),
      "SELECT key, rev_from, layer, payload, checksum, rev_to, rowid"
      " FROM node_history INDEXED BY node_history_rev_to"
      " WHERE (rev_to, rowid) > (?1, ?2) AND +rev_from <= ?3 ORDER BY rev_to, rowid LIMIT ?4",
      stop, [&](Query* query) { query->Bind(after_end, after_row, revision(), kBatchRows); },
      [&](const Query& query) {
        after_end = query.Int(5);
        after_row = query.Int(6);
        return show(query);
      });
}

absl::Status SqliteSnapshot::ReadAllEdges(const StopCheck& stop,
                                          const std::function<void(const Edge&)>& visit) const {
  DSG_ASSIGN_OR_RETURN(const auto relations, ReadRelations(reader_.get(), revision()));
  const auto show = [&](const Query& query) -> absl::Status {
    const auto relation = relations.find(query.Int(1));
    if (relation == relations.end()) {
      // Not one that came after the names were read: its edges are of later revisions.
      return CorruptRow(spec().name, "relation", absl::StrCat(query.Int(1)));
    }
    DSG_ASSIGN_OR_RETURN(const Edge edge, EdgeFromRow(query, relation->second, spec().name));
    visit(edge);
    return absl::OkStatus();
  };
  int64_t source = kLowest;
  int64_t relation = kLowest;
  int64_t target = kLowest;
  DSG_RETURN_IF_ERROR(RunInBatches(
      reader_.get(), revision(),
      "SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
      " WHERE (source, relation, target) > (?1, ?2, ?3) AND rev_from <= ?4"
      " ORDER BY source, relation, target LIMIT ?5",
      stop, [&](Query* query) { query->Bind(source, relation, target, revision(), kBatchRows); },
      [&](const Query& query) {
        source = query.Int(0);
        relation = query.Int(1);
        target = query.Int(2);
        return show(query);
      }));
  Revision after_end = revision();
  int64_t after_row = kHighest;
  return RunInBatches(
      reader_.get(), revision(),
      "SELECT source, relation, target, rev_from, weight, payload, checksum, rev_to, rowid"
      " FROM edge_history INDEXED BY edge_history_rev_to"
      " WHERE (rev_to, rowid) > (?1, ?2) AND +rev_from <= ?3 ORDER BY rev_to, rowid LIMIT ?4",
      stop, [&](Query* query) { query->Bind(after_end, after_row, revision(), kBatchRows); },
      [&](const Query& query) {
        after_end = query.Int(7);
        after_row = query.Int(8);
        return show(query);
      });
}

}  // namespace dsg::sqlite
