// SPDX-License-Identifier: Apache-2.0
// What people and programs ask a map every day, and how long the answers take.
// Refuses to count an answer that failed.
#pragma once

#include <string>

#include "query/service/service_core.h"
#include "schema/base/random.h"
#include "tests/e2e/year/year_world.h"

namespace dsg::test {

/// One day's questions.
struct YearLatency {
  /// Processor time of one round: the sum over the kinds of questions of the median of each, so
  /// that a busy machine does not show.
  double round_us = 0.0;
  /// The kind that costs most, and its median.
  std::string slowest;
  double slowest_us = 0.0;
};

/// Asks each kind of question `repeat_count` times of the day that has just ended. The first of
/// each kind is not counted: it warms what a running server has warm.
/// Errors: of the first question that fails.
absl::StatusOr<YearLatency> AskTheDay(query::ServiceCore* core, const YearWorld& world,
                                      const std::string& map, int day, int repeat_count);

}  // namespace dsg::test
