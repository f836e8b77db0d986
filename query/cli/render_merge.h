// SPDX-License-Identifier: Apache-2.0
// What a merge has done, as text for people. Only turns replies into words.
#pragma once

#include <string>

namespace dsg::v1 {
class MergeMapsResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// The last message of a stream, ids of all messages in it.
std::string RenderMerge(const v1::MergeMapsResponse& reply, const std::string& other,
                        const std::string& map, bool is_dry_run);

}  // namespace dsg::cli
