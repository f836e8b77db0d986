// SPDX-License-Identifier: Apache-2.0
// Rows of layers, labels, relations, nodes and edges: the one place that knows their columns.
// Payloads are views of the statement's row, which the next step ends.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"
#include "schema/store/content_rows.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

/// Columns: key, rev_from, layer, payload, checksum. `map` is for messages.
/// Errors of all: DATA_LOSS/STORE_CORRUPT for a row that is not what was written.
absl::StatusOr<Node> NodeFromRow(const Query& query, const std::string& map);

/// Columns: source, relation, target, rev_from, weight, payload, checksum.
absl::StatusOr<EdgeRow> EdgeRowOf(const Query& query, const std::string& map);
/// The same columns, of an edge of that relation.
absl::StatusOr<Edge> EdgeFromRow(const Query& query, std::string_view relation,
                                 const std::string& map);

/// Id of a relation's name, 0 if the map has never seen it.
absl::StatusOr<int64_t> FindRelation(Database& db, const std::string& name);

/// Writes layers, labels, nodes, edges.
class GraphRowsWriter {
 public:
  explicit GraphRowsWriter(CommitContext* commit) : commit_(*commit) {}
  absl::Status WriteLayers(const std::vector<Layer>& layers);
  absl::Status WriteLabels(const std::vector<SemanticLabel>& labels);
  absl::Status WriteNodes(const std::vector<Node>& nodes);
  absl::Status EndEdges(const std::vector<EdgeKey>& keys);
  absl::Status Retire(const Retirement& item);
  absl::Status WriteEdges(const std::vector<Edge>& edges);

 private:
  absl::Status WriteLayer(const Layer& layer);
  absl::Status WriteLabel(const SemanticLabel& label);
  absl::Status WriteNode(const Node& node);
  absl::Status InsertNode(const Node& node, const std::string& payload);
  /// Moves the current row to the history. Returns false if there is none.
  absl::StatusOr<bool> EndNode(int64_t key);
  absl::Status EndEdgesOf(int64_t key);
  absl::Status WriteEdge(const Edge& edge);
  /// False, and nothing done, if there is such an edge.
  absl::StatusOr<bool> InsertEdge(const Edge& edge, int64_t relation, const std::string& payload);
  absl::StatusOr<bool> EndEdge(int64_t source, int64_t relation, int64_t target);
  absl::StatusOr<int64_t> FindOrAddRelation(const std::string& name);

  CommitContext& commit_;
  /// Ids of the relations that this commit has met.
  std::map<std::string, int64_t> relations_;
};

}  // namespace dsg::sqlite
