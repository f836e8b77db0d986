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

/// A positive number and one of ms, s, m, h, d.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID, also beyond 100 years.
absl::StatusOr<TimeNs> ParseAge(std::string_view text);

/// As ParseAge reads it back, in the largest unit that is exact.
std::string FormatAge(TimeNs age_ns);

enum class PruneStrength {
  /// New revisions are without it; older ones still know.
  kRetire,
  /// No revision knows, and neither file nor log holds the bytes.
  kErase
};

/// One rule of forgetting. Instants are of world time; ages count back from the newest observation
/// of the map that another one supports (WorldClock).
struct PrunePolicy {
  /// A node by id or name, and all that only it contains.
  struct Branch {
    std::string id_or_name;
  };
  /// Nodes with their position inside, poses and mesh inside.
  struct Region {
    Box3d box_map;
  };
  /// Poses, shapes, factors and stays that end before, nodes whose validity ended before, agents
  /// that were last seen before.
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
  /// Nodes last observed before, with what they contain that was never looked for itself. A node
  /// without such a time has that of what it contains, if all of it has one.
  struct UnseenSince {
    TimeNs at_ns = 0;
  };
  /// UnseenSince, by age.
  struct UnseenFor {
    TimeNs age_ns = 0;
  };
  /// Revisions committed longer ago than this, by the wall clock where it can be believed
  /// (past.h), that have no tag.
  struct HistoryOlderThan {
    TimeNs age_ns = 0;
  };
  /// Revisions before this one that have no tag.
  struct HistoryBefore {
    Revision revision = 0;
  };
  /// Nothing: all tracks, with `simplify_m`.
  using What = std::variant<std::monostate, Branch, Region, Before, OlderThan, WholeLayer,
                            UnseenSince, UnseenFor, HistoryOlderThan, HistoryBefore>;

  /// For reports, and for the messages of the revisions.
  std::string name;
  What what;
  /// Only these layers ("mesh" too). Empty = all that the policy can speak of.
  std::vector<std::string> layers;
  /// Above 0: does not forget tracks but thins them (simplify.h).
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
