// SPDX-License-Identifier: Apache-2.0
// The verb merge: another map of the same place, merged into this one.
#pragma once

#include <string>

namespace dsg::v1 {
class MergeMapsResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// The parts of the question that the text depends on.
struct MergeAsked {
  std::string map;
  std::string other;
  /// Given, not estimated.
  bool has_transform = false;
  bool is_dry_run = false;
};

/// Why the transform is doubtful, and what to do, in one line; empty without doubts. `plan` is the
/// last message of a dry run.
std::string DoubtsOf(const v1::MergeMapsResponse& plan, const MergeAsked& asked);

/// The last message of a merge, with the ids of all messages. A dry run also has the doubts.
std::string RenderMerge(const v1::MergeMapsResponse& reply, const MergeAsked& asked);

}  // namespace dsg::cli
