// SPDX-License-Identifier: Apache-2.0
#include "query/cli/node_cells.h"

#include "absl/strings/str_cat.h"
#include "dsg/v1/graph.pb.h"

namespace dsg::cli {

std::vector<Column> NodeColumns() {
  return {{"id"},
          {"kind"},
          {"layer"},
          {"name"},
          {"class"},
          {"x m", Align::kRight},
          {"y m", Align::kRight},
          {"z m", Align::kRight}};
}

std::vector<std::string> NodeCells(const v1::Node& node) {
  std::vector<std::string> cells = {node.id(), node.kind(), node.layer(), node.name(),
                                    node.semantic_class().name()};
  // An agent that nobody saw at the instant has none.
  if (!node.has_map_t_node()) {
    cells.insert(cells.end(), 3, "unknown");
    return cells;
  }
  const v1::Vector3& p = node.map_t_node().position();
  for (const double coordinate : {p.x(), p.y(), p.z()}) cells.push_back(Fixed(coordinate, 2));
  return cells;
}

std::string Footer(int64_t count, const std::string& noun, int64_t revision, bool is_cut) {
  return absl::StrCat(Counted(count, noun), " (revision ", revision, ")",
                      is_cut ? "; there are more, see --limit" : "", "\n");
}

std::string PositionText(const v1::Vector3& position) {
  return absl::StrCat("x ", Fixed(position.x(), 2), " y ", Fixed(position.y(), 2), " z ",
                      Fixed(position.z(), 2), " m");
}

}  // namespace dsg::cli
