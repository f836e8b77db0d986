// SPDX-License-Identifier: Apache-2.0
// A PlanPath request in the words of planning: ends looked up, limits checked.
// Refuses to look for a path.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/api/call_context.h"
#include "query/engine/planning/attach.h"
#include "query/engine/planning/limits.h"
#include "query/engine/read_view.h"
#include "query/view/place_graph.h"

namespace dsg::v1 {
class PlanPathRequest;
}  // namespace dsg::v1

namespace dsg::query {

/// One revision, as a call sees it. All outlive the question.
struct PathContext {
  const ReadView& read;
  const GraphView& view;
  const PlaceGraph& places;
  const CallContext& call;
};

struct PathEndpoint {
  std::vector<PathTarget> targets;
  /// As errors name it.
  std::string text;
};

struct PathQuestion {
  Limits limits;
  PathEndpoint from;
  PathEndpoint to;
  bool flat = false;
};

/// Errors: FIELD_INVALID, NUMBER_NOT_FINITE, NODE_UNKNOWN naming the field; those of patterns;
/// TIME_OUTSIDE_TRACK for agents; NO_PATH when an end is nowhere at that time; the call's end.
absl::StatusOr<PathQuestion> ReadPathQuestion(const PathContext& context,
                                              const v1::PlanPathRequest& request);

}  // namespace dsg::query
