// SPDX-License-Identifier: Apache-2.0
// Retention policies: what to forget of a map that is kept for years, and how thoroughly. Also ages
// as text: "90s", "15m", "24h", "30d". selection.h tells what a policy matches in a map.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/ids.h"

namespace dsg {

inline constexpr TimeNs kNsPerDay = 24 * 3600 * kNsPerSecond;

/// Reads a positive number and a unit: ms, s, m, h or d. A unit is required, because a day that is
/// taken for a second would empty a map.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID, also above 100 years.
absl::StatusOr<TimeNs> ParseAge(std::string_view text);

/// Text that ParseAge reads back, in the largest exact unit.
std::string FormatAge(TimeNs age_ns);

enum class PruneStrength {
  /// New revisions lack it; older revisions keep it.
  kRetire,
  /// No revision has it, and neither the file nor the log holds its bytes.
  kErase
};

/// One retention rule. Instants are world time; ages count back from the newest observation that
/// another one supports (WorldClock).
struct PrunePolicy {
  /// A node by id or name, and all that only it contains.
  struct Branch {
    std::string id_or_name;
  };
  /// Nodes, poses and mesh in a box, nodes by their position.
  struct Region {
    Box3d box_map;
  };
  /// Poses, shapes, factors and stays that end before an instant, nodes whose validity ended before
  /// it, agents that were last seen before it.
  struct Before {
    TimeNs at_ns = 0;
  };
  /// Before, by age.
  struct OlderThan {
    TimeNs age_ns = 0;
  };
  /// All of a layer: "mesh", or a layer's name.
  struct WholeLayer {
    std::string name;
  };
  /// Nodes last observed before an instant, with those of their descendants that have no
  /// observation time. A node without such a time takes that of its descendants, if all of them
  /// have one.
  struct UnseenSince {
    TimeNs at_ns = 0;
  };
  /// UnseenSince, by age.
  struct UnseenFor {
    TimeNs age_ns = 0;
  };
  /// Untagged revisions older than this by the wall clock, as far as that is trusted (past.h).
  struct HistoryOlderThan {
    TimeNs age_ns = 0;
  };
  /// Untagged revisions before this one.
  struct HistoryBefore {
    Revision revision = 0;
  };
  /// std::monostate: all tracks, with `simplify_m`.
  using What = std::variant<std::monostate, Branch, Region, Before, OlderThan, WholeLayer,
                            UnseenSince, UnseenFor, HistoryOlderThan, HistoryBefore>;

  /// For reports, and for the messages of the revisions.
  std::string name;
  What what;
  /// Only these layers ("mesh" included). Empty = all layers.
  std::vector<std::string> layers;
  /// Above 0: thins tracks instead of forgetting them (simplify.h).
  double simplify_m = 0.0;
  /// With simplify_m.
  double simplify_rad = 0.1;
  PruneStrength strength = PruneStrength::kRetire;

  bool IsHistory() const;
  bool IsThinning() const { return simplify_m > 0.0; }

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID, BOX_INVERTED or NUMBER_NOT_FINITE naming policy, field
  /// and value.
  absl::Status Validate() const;
};

}  // namespace dsg
