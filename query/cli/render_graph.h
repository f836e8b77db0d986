// SPDX-License-Identifier: Apache-2.0
// Nodes and edges as text for people. Only turns replies into words: asks nothing.
#pragma once

#include <string>

#include "query/cli/time_text.h"

namespace dsg::v1 {
class GetNodeResponse;
class ListEdgesResponse;
class ListNearestNodesResponse;
class ListNodesResponse;
}  // namespace dsg::v1

namespace dsg::cli {

std::string RenderNodes(const v1::ListNodesResponse& reply);
std::string RenderEdges(const v1::ListEdgesResponse& reply, const TimeText& times);
std::string RenderNearest(const v1::ListNearestNodesResponse& reply);
/// One line a field; fields that the node does not have are left out.
std::string RenderNode(const v1::GetNodeResponse& reply, const TimeText& times);

}  // namespace dsg::cli
