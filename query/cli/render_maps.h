// SPDX-License-Identifier: Apache-2.0
// Maps, their sizes and their revisions as text for people. Only turns replies into words.
#pragma once

#include <cstdint>
#include <string>

#include "query/cli/time_text.h"

namespace dsg::v1 {
class GetMapStatsResponse;
class ListMapsResponse;
class ListRevisionsResponse;
class ListTagsResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// "60.5 MB (60512345 bytes)"; bytes alone below 1 kB.
std::string BytesText(int64_t byte_count);

std::string RenderMaps(const v1::ListMapsResponse& reply);
std::string RenderStats(const v1::GetMapStatsResponse& reply, const TimeText& times);
/// With a column of tags if there are any.
std::string RenderRevisions(const v1::ListRevisionsResponse& reply,
                            const v1::ListTagsResponse& tags);

}  // namespace dsg::cli
