// SPDX-License-Identifier: Apache-2.0
// The verbs about revisions: log, diff, watch.
#pragma once

#include <cstdint>
#include <string>

#include "query/cli/answer_text.h"
#include "query/cli/arguments.h"

namespace dsg::v1 {
class DiffRevisionsResponse;
class Node;
}  // namespace dsg::v1

namespace dsg::cli {

struct LogVerb {};

struct DiffVerb {
  RevisionOption from;
  /// Unset = the newest.
  RevisionOption to;
  std::string layer;
};

struct WatchVerb {
  /// Unset = from the newest.
  RevisionOption after;
  /// Also print what changed.
  bool changes = false;
  /// End after this many revisions; 0 = never.
  int64_t count = 0;
};

/// "moved 0.42 m, name, ended at +12s": what differs between two states of a node.
std::string DifferenceText(const v1::Node& before, const v1::Node& after, const TimeText& times);

/// One line per change, then the revisions that were compared.
std::string RenderDiff(const v1::DiffRevisionsResponse& reply, const TimeText& times);

}  // namespace dsg::cli
