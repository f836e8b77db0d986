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

/// The last message of a stream, ids of all messages in it.
std::string RenderMerge(const v1::MergeMapsResponse& reply, const MergeAsked& asked);

}  // namespace dsg::cli
