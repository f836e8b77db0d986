// SPDX-License-Identifier: Apache-2.0
// What maintenance has done, as text for people. Only turns replies into words.
#pragma once

#include <string>

namespace dsg::v1 {
class Amount;
class CompactResponse;
class ListTagsResponse;
class RevertResponse;
class Tag;
}  // namespace dsg::v1

namespace dsg::cli {

std::string RenderTags(const v1::ListTagsResponse& reply);
std::string RenderTag(const v1::Tag& tag);

/// "3 nodes, 12 poses"; "nothing" if all are zero.
std::string AmountText(const v1::Amount& amount);

/// The last message of a stream.
std::string RenderCompact(const v1::CompactResponse& reply);
std::string RenderRevert(const v1::RevertResponse& reply, const std::string& to, bool is_dry_run);

}  // namespace dsg::cli
