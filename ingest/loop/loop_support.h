// SPDX-License-Identifier: Apache-2.0
// Loops that other loops bear out, before anything is optimised.
// Refuses loops that stand alone: those are judged by the poses later.
#pragma once

#include <vector>

#include "ingest/loop/pose_graph.h"
#include "ingest/loop/robust_options.h"

namespace dsg::ingest {

/// True for odometry and for loops that are mostly right, whatever the information matrices are
/// worth: enough to learn the noise from. `gate` as PairwiseOptions::gate; `on_work` may be empty.
std::vector<bool> LikelyEdges(const PoseGraph& graph, double gate, const EvidenceOptions& evidence,
                              const TellWork& on_work = {});

/// True for odometry and for loops that agree with others so precisely that no more than
/// `wrong_count_max` wrong ones are to be expected among them, if wrong loops are random.
/// `noise_scale`: as PairwiseOptions::noise_scale.
std::vector<bool> SupportedEdges(const PoseGraph& graph, double gate, double noise_scale,
                                 double wrong_count_max, const EvidenceOptions& evidence,
                                 const TellWork& on_work = {});

/// True for odometry and the largest set of loops that agree in pairs and with odometry.
std::vector<bool> ConsistentEdges(const PoseGraph& graph, double gate);

}  // namespace dsg::ingest
