// SPDX-License-Identifier: Apache-2.0
// What each unary question costs over the wire, beside an empty call plus the same question to an
// engine in this process. Refuses to count a question that failed, or answers that differ.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/bench/report.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_questions.h"
#include "tests/bench/wire_server.h"

namespace dsg::bench {

/// Asks each question `call_count` times, but no longer than about 2 s, of `server`, to which
/// `client` is connected, and of an engine over `store`, which the server serves.
absl::Status MeasureQuestions(const std::vector<std::unique_ptr<Question>>& questions,
                              int call_count, const std::string& store, const WireServer& server,
                              const WireClient& client, Report* report);

}  // namespace dsg::bench
