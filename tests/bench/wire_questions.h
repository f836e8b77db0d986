// SPDX-License-Identifier: Apache-2.0
// Every unary question, drawn at random over the world of wire_world.h, to be asked of an engine in
// this process or of a server. Refuses to let an empty answer pass where there must be one.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "query/api/api.h"
#include "schema/base/random.h"
#include "tests/bench/wire_client.h"

namespace dsg::bench {

/// Threads: one at a time.
class Question {
 public:
  explicit Question(std::string name) : name_(std::move(name)) {}
  virtual ~Question() = default;
  const std::string& name() const { return name_; }

  /// Makes the request that both Ask methods then use.
  virtual void Draw(Random* random) = 0;
  virtual absl::Status AskEngine(query::Api* engine) = 0;
  virtual absl::Status AskServer(const WireClient& client) = 0;
  /// Bytes of the last answer of each.
  virtual size_t engine_bytes() const = 0;
  virtual size_t server_bytes() const = 0;

 private:
  std::string name_;
};

/// By parts of their names; an empty part is no condition.
struct QuestionFilter {
  std::string only;
  std::string except;
};

/// One of each that passes.
std::vector<std::unique_ptr<Question>> QuestionsWanted(const QuestionFilter& filter);

}  // namespace dsg::bench
