// SPDX-License-Identifier: Apache-2.0
// What a merge has done, as text for people. Only turns replies into words.
#pragma once

#include <string>

namespace dsg::v1 {
class MergeMapsResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// What was asked of a merge, as far as the words depend on it.
struct MergeAsked {
  std::string map;
  std::string other;
  /// Not estimated.
  bool has_transform = false;
  bool is_dry_run = false;
};

/// What makes the transform doubtful, and what to do about it, in one line without an end; empty if
/// nothing does. `plan` is the last message of a dry run.
std::string DoubtsOf(const v1::MergeMapsResponse& plan, const MergeAsked& asked);

/// The last message of a stream, ids of all messages in it. A dry run's has the doubts.
std::string RenderMerge(const v1::MergeMapsResponse& reply, const MergeAsked& asked);

}  // namespace dsg::cli
