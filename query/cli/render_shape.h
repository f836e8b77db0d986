// SPDX-License-Identifier: Apache-2.0
// Bodies as text for people. Only turns replies into words: asks nothing.
#pragma once

#include <string>

#include "query/cli/time_text.h"

namespace dsg::v1 {
class GetAgentShapeResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// A line a body: what is stored of it, and where its hands are in the map. Hands are shown of
/// skeletons of 24 joints in the order of SMPL.
std::string RenderShapes(const v1::GetAgentShapeResponse& reply, const TimeText& times);

}  // namespace dsg::cli
