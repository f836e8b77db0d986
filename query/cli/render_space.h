// SPDX-License-Identifier: Apache-2.0
// Ways, obstacles and predictions as text for people. Only turns replies into words.
#pragma once

#include <string>

#include "query/cli/node_names.h"
#include "query/cli/time_text.h"

namespace dsg::v1 {
class CheckCollisionResponse;
class CollisionResult;
class PlanPathResponse;
class PredictAgentResponse;
class PredictedPose;
}  // namespace dsg::v1

namespace dsg::cli {

/// A line a property of the way.
std::string RenderPath(const v1::PlanPathResponse& reply, const NodeNames& names);

/// "hit object cup (O7) at x 1.00 ..." or "free, ...".
std::string CollisionText(const v1::CollisionResult& result, const NodeNames& names);

/// A line a body.
std::string RenderCollisions(const v1::CheckCollisionResponse& reply, const NodeNames& names);

/// Standard deviation of a predicted position on the floor, metres; 0 without a covariance.
double FloorSigmaM(const v1::PredictedPose& pose);

/// A line a way, then the steps of the most probable one.
std::string RenderPrediction(const v1::PredictAgentResponse& reply, const TimeText& times,
                             const NodeNames& names);

}  // namespace dsg::cli
