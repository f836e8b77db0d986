// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/cli/cli_test_util.h"

#include <sstream>
#include <utility>

namespace dsg::test {

Outcome RunDsg(const Arguments& arguments, const cli::Environment& environment) {
  std::ostringstream out;
  std::ostringstream errors;
  Outcome outcome;
  outcome.code = cli::Run(arguments, environment, out, errors);
  outcome.out = out.str();
  outcome.errors = errors.str();
  return outcome;
}

std::string Refusal(const Arguments& arguments, const cli::Environment& environment) {
  const auto command = cli::ParseArguments(arguments, environment);
  EXPECT_FALSE(command.ok());
  EXPECT_TRUE(absl::IsInvalidArgument(command.status())) << command.status();
  return std::string(command.status().message());
}

cli::TimeText Monotonic() { return cli::TimeText(MapSpec()); }

std::string ListText(std::vector<cli::ListColumn> columns, const cli::TimeText& times,
                     const std::function<absl::Status(cli::ListWriter*)>& add,
                     const std::string& footer, cli::ListFormat format) {
  std::ostringstream out;
  cli::ListWriter list({.format = format}, times, "entries", std::move(columns), &out);
  const absl::Status added = add(&list);
  EXPECT_TRUE(added.ok()) << added;
  const absl::Status ended = list.End(footer);
  EXPECT_TRUE(ended.ok()) << ended;
  return out.str();
}

Node MakeNode(NodeId id, const std::string& kind, const std::string& name,
              const Eigen::Vector3d& position_map) {
  Node node;
  node.id = id;
  node.kind = kind;
  node.layer = *LayerOfKind(kind);
  node.name = name;
  node.map_T_node.position = position_map;
  return node;
}

Node MakeNode(NodeId id, const std::string& kind, const std::string& name, double x_m) {
  return MakeNode(id, kind, name, Eigen::Vector3d(x_m, 0.0, 0.0));
}

Edge MakeEdge(NodeId source, const std::string& relation, NodeId target) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  return edge;
}

}  // namespace dsg::test
