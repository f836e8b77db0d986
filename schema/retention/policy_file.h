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

/// A run that takes more than half of a map indicates a wrong clock.
inline constexpr double kShareMaxDefault = 0.5;

struct PolicyFile {
  /// How often a server applies the policies.
  TimeNs every_ns = 0;
  /// Each is valid; names are unique.
  std::vector<PrunePolicy> policies;
  /// The largest share of the nodes other than agents, and of the poses, that one run may remove
  /// from a map; above 0, at most 1. Unset: kShareMaxDefault for a schedule, no limit for a single
  /// run.
  std::optional<double> share_max;
};

/// Parses YAML. Errors name `name`. Errors: INVALID_ARGUMENT/FILE_MALFORMED with line and column.
absl::StatusOr<PolicyFile> ParsePolicyFile(std::string_view text, const std::string& name);

/// As ParsePolicyFile. Errors: also NOT_FOUND without the file.
absl::StatusOr<PolicyFile> ReadPolicyFile(const std::string& path);

}  // namespace dsg
