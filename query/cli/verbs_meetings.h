// SPDX-License-Identifier: Apache-2.0
// The verbs about meetings and interactions: met, picked.
#pragma once

#include <string>
#include <vector>

#include "query/cli/arguments.h"
#include "query/cli/list_writer.h"
#include "query/cli/lookups.h"

namespace dsg::v1 {
class InteractionCandidate;
class ListEncountersResponse;
class ListInteractionsResponse;
}  // namespace dsg::v1

namespace dsg::cli {

struct MetVerb {
  /// Empty = all agents.
  std::string agent;
  std::string other_agent;
  std::string from;
  std::string to;
  /// Metres; 0 = the default of the service.
  double within_m = 0.0;
  /// A duration; empty = any.
  std::string for_at_least;
  bool line_of_sight = false;
  /// A duration; empty = the default of the service.
  std::string sight_gap;
  PictureOptions picture;
};

struct PickedVerb {
  /// Empty = any.
  std::string agent;
  std::string object;
  std::string class_name;
  std::string room;
  std::string from;
  std::string to;
  /// Objects that were put down, instead of those that were picked up.
  bool placed = false;
  /// Also objects for which the evidence names nobody.
  bool all = false;
  /// Show the evidence.
  bool why = false;
  PictureOptions picture;
};

/// A row per meeting; `list` has MeetingColumns.
std::vector<ListColumn> MeetingColumns();
absl::Status AddMeetings(const v1::ListEncountersResponse& reply, const NodeNames& names,
                         ListWriter* list);

/// One line per candidate, grouped by object. `with_evidence`: each followed by its evidence.
std::string RenderInteractions(const v1::ListInteractionsResponse& reply, const TimeText& times,
                               const NodeNames& names, bool with_evidence);

}  // namespace dsg::cli
