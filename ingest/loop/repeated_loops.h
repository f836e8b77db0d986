// SPDX-License-Identifier: Apache-2.0
// Loop closures that say again what another one said: a recogniser that tells the same pair of
// pictures fifty times has one piece of evidence, not fifty.
#pragma once

#include <vector>

#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

/// For each loop, in whatever direction it leads: whether one before it joins the same two poses,
/// and their measurements differ by no more than their noise allows (`gate`: largest squared
/// deviation, of six degrees of freedom). Loops of the same poses that contradict each other are
/// not repeated: one of them may be right.
///
/// Deterministic. Cost: at most 16 comparisons a loop.
std::vector<bool> FindRepeated(const std::vector<RelativePose>& loops, double gate);

}  // namespace dsg::ingest
