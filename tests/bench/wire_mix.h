// SPDX-License-Identifier: Apache-2.0
// Many clients at once, who ask all questions mixed. Refuses to hide a client that met an error.
#pragma once

#include <string>

#include "tests/bench/report.h"
#include "tests/bench/wire_questions.h"

namespace dsg::bench {

struct MixOptions {
  int client_count = 32;
  double seconds = 5.0;
};

/// Each client has a connection and a thread of its own, and draws from the wanted questions.
absl::Status MeasureMix(const QuestionFilter& filter, const MixOptions& options,
                        const std::string& address, Report* report);

}  // namespace dsg::bench
