// SPDX-License-Identifier: Apache-2.0
// What command lines that forget say.
// Refuses to know what times and boxes mean: they stay text until the map is open.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dsg::cli {

struct PruneVerb {
  /// At most one of these is set; none only with `simplify_m`.
  std::string branch;
  std::string region;
  std::string before;
  std::string older_than;
  std::string layer;
  std::string unseen_since;
  std::string unseen_for;
  std::string history_older_than;
  std::optional<int64_t> history_before;
  std::string policy_file;
  /// Empty = all layers.
  std::vector<std::string> only;
  /// 0 = forget.
  double simplify_m = 0.0;
  bool erase = false;
  bool dry_run = false;
  /// Of the map; unset = that of the policy file, or no limit.
  std::optional<double> share_max;
  /// Everything may go.
  bool yes = false;
};

}  // namespace dsg::cli
