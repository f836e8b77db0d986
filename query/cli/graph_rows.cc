// SPDX-License-Identifier: Apache-2.0
#include "query/cli/graph_rows.h"

#include "dsg/v1/graph.pb.h"

namespace dsg::cli {

std::vector<ListColumn> NodeColumns() {
  // An agent that is not observed at the instant has no pose.
  const auto coordinate = [](const char* heading) {
    return ListColumn{.heading = heading, .type = CellType::kReal, .unknown = "unknown"};
  };
  return {{"id"},    {"kind"},          {"layer"},         {"name"},
          {"class"}, coordinate("x m"), coordinate("y m"), coordinate("z m")};
}

Row NodeRow(const v1::Node& node) {
  Row row{node.id(), node.kind(), node.layer(), node.name(), node.semantic_class().name()};
  if (!node.has_map_t_node()) {
    row.resize(row.size() + 3);
    return row;
  }
  const v1::Vector3& p = node.map_t_node().position();
  row.insert(row.end(), {p.x(), p.y(), p.z()});
  return row;
}

std::vector<ListColumn> EdgeColumns() {
  return {{"source"},
          {"relation"},
          {"target"},
          {.heading = "weight", .type = CellType::kReal, .decimals = 3},
          {.heading = "held", .type = CellType::kSpan}};
}

Row EdgeRow(const v1::Edge& edge) {
  return {edge.source(), edge.relation(), edge.target(), edge.weight(), HeldOf(edge)};
}

Interval HeldOf(const v1::Edge& edge) {
  Interval held;
  if (edge.has_valid_from_ns()) held.from_ns = edge.valid_from_ns();
  if (edge.has_valid_to_ns()) held.to_ns = edge.valid_to_ns();
  return held;
}

}  // namespace dsg::cli
