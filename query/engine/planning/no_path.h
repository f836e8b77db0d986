// SPDX-License-Identifier: Apache-2.0
// Why there is no path, in a form that says what to change. Runs after planning has found none.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/planning/ends.h"
#include "query/view/place_graph.h"
#include "schema/base/status.h"

namespace dsg::query {

enum class NoPathCause {
  /// No place near the start or the end, whatever the limits.
  kNoPlaceAtStart,
  kNoPlaceAtEnd,
  /// A way exists for robots up to radius_m_max.
  kTooNarrow,
  /// A way exists without the blocked places.
  kBlocked,
  /// A way exists for a smaller robot and without the blocked places.
  kTooNarrowAndBlocked,
  /// A way exists at other times.
  kNotAtThatTime,
  /// The places of both ends have never been linked.
  kApart,
};

struct NoPath {
  NoPathCause cause = NoPathCause::kApart;
  /// With kTooNarrow and kTooNarrowAndBlocked.
  double radius_m_max = 0.0;
  /// Of the places at both ends, where there are any; empty for none.
  NodeId from_room;
  NodeId to_room;
};

/// Errors: what `stop` returned.
absl::StatusOr<NoPath> ExplainNoPath(const PlaceGraph& graph, const Limits& limits,
                                     const std::vector<PathTarget>& from,
                                     const std::vector<PathTarget>& to, const LineCheck& is_free,
                                     const StopCheck& stop);

/// The same in words. Adds from_room, to_room and radius_m_max to the metadata, as far as they are
/// known. `from` and `to` name the ends, `radius_m` is that of the question.
std::string Explain(const NoPath& reason, double radius_m, const std::string& from,
                    const std::string& to, ErrorMetadata* metadata);

/// The largest radius of a robot that gets from one of the places to one of the others, by the
/// widest way; nullopt if there is no way even for a point. The limits' radius is not looked at.
/// Errors: what `stop` returned.
absl::StatusOr<std::optional<double>> WidestRadius(const PlaceGraph& graph, const Limits& limits,
                                                   const std::vector<Anchor>& from,
                                                   const std::vector<Anchor>& to,
                                                   const StopCheck& stop);

}  // namespace dsg::query
