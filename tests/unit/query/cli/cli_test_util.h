// SPDX-License-Identifier: Apache-2.0
// What the tests of this folder share: runs of the program in this process, and parts of small
// maps.
#pragma once

#include <gtest/gtest.h>

#include <any>
#include <functional>
#include <string>
#include <vector>

#include "query/cli/answer_text.h"
#include "query/cli/list_writer.h"
#include "query/cli/run.h"
#include "schema/model/graph_delta.h"

namespace dsg::test {

using Arguments = std::vector<std::string>;

/// A run of the program: its exit code and what it printed.
struct Outcome {
  int code = -1;
  std::string out;
  std::string errors;
};
Outcome RunDsg(const Arguments& arguments,
               const cli::Environment& environment = {.version = "0.1.0"});

/// The verb of a command line; fails the test when it is refused or another verb's.
template <class V>
V ParseAs(const Arguments& arguments, const cli::Environment& environment = {.store = "s"}) {
  const auto command = cli::ParseArguments(arguments, environment);
  EXPECT_TRUE(command.ok()) << command.status();
  const V* verb = command.ok() ? std::any_cast<V>(&command->verb) : nullptr;
  if (verb != nullptr) return *verb;
  ADD_FAILURE() << "another verb than asked for";
  return V();
}
/// What is said of a command line that is refused; fails the test when it is not.
std::string Refusal(const Arguments& arguments,
                    const cli::Environment& environment = {.store = "s"});

/// The times of a map with a monotonic clock.
cli::TimeText Monotonic();

/// A list of one reply as it is written: `add(list)` adds the reply, `footer` ends a table.
std::string ListText(std::vector<cli::ListColumn> columns, const cli::TimeText& times,
                     const std::function<absl::Status(cli::ListWriter*)>& add,
                     const std::string& footer = "",
                     cli::ListFormat format = cli::ListFormat::kTable);

Node MakeNode(NodeId id, const std::string& kind, const std::string& name,
              const Eigen::Vector3d& position_map);
/// At y = z = 0.
Node MakeNode(NodeId id, const std::string& kind, const std::string& name, double x_m);
Edge MakeEdge(NodeId source, const std::string& relation, NodeId target);

}  // namespace dsg::test
