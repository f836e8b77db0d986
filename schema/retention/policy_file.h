// SPDX-License-Identifier: Apache-2.0
// Reads a file of policies: what to forget, and how often (docs/forgetting.md). Unknown keys are
// errors; a file applies as a whole or not at all.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/policy.h"

namespace dsg {

/// More than half of a map at once is rather a wrong clock than a policy.
inline constexpr double kShareMaxDefault = 0.5;

struct PolicyFile {
  /// How often a server applies the policies.
  TimeNs every_ns = 0;
  /// Valid each, with names that differ.
  std::vector<PrunePolicy> policies;
  /// The largest share of the nodes that are no agents, and of the poses, that a run may take from
  /// a map; above 0, at most 1. An everyday run takes what has come of age since the run before.
  /// Unset: kShareMaxDefault for a schedule, and no limit for a person who runs the file once.
  std::optional<double> share_max;
};

/// Reads YAML. `name` stands in errors.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED with line and column.
absl::StatusOr<PolicyFile> ParsePolicyFile(std::string_view text, const std::string& name);

/// As ParsePolicyFile. Errors: also NOT_FOUND without the file.
absl::StatusOr<PolicyFile> ReadPolicyFile(const std::string& path);

}  // namespace dsg
