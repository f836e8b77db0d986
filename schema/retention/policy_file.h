// SPDX-License-Identifier: Apache-2.0
// Reads a file of policies: what to forget, and how often to look (docs/forgetting.md).
// Refuses unknown keys and anything half understood: a file is taken whole or not at all.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/policy.h"

namespace dsg {

struct PolicyFile {
  /// How often a server applies the policies.
  TimeNs every_ns = 0;
  /// Valid each, with names that differ.
  std::vector<PrunePolicy> policies;
};

/// Reads YAML. `name` stands in errors.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED with line and column.
absl::StatusOr<PolicyFile> ParsePolicyFile(std::string_view text, const std::string& name);

/// As ParsePolicyFile. Errors: also NOT_FOUND without the file.
absl::StatusOr<PolicyFile> ReadPolicyFile(const std::string& path);

}  // namespace dsg
