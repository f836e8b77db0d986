// SPDX-License-Identifier: Apache-2.0
// Moving bodies for tests of the shape codec: a real mesh where the data is there, and numbers
// without any order. Refuses to be anatomy.
#pragma once

#include <vector>

#include "schema/model/trajectory.h"

namespace dsg::test {

/// x, y, z of 6890 of the vertices of the MakeHuman base body, in the file's order, metres, z up,
/// feet at -0.9 m; empty when the data is not there (DSG_DATA).
std::vector<float> RealBody();

/// A cylinder of the size of a body with as many vertices, ring by ring.
std::vector<float> MadeBody(size_t vertex_count);

/// The points of `numbers` in another order.
std::vector<float> Shuffled(const std::vector<float>& numbers, uint64_t seed);

/// The body `step` fifths of a second into a walk: arms and legs swing, the trunk turns.
std::vector<float> Walking(const std::vector<float>& rest, int step);

/// A body of 72 pose and 10 shape coefficients and 24 joints, every number drawn from the widest
/// range that a body has; no two resemble each other.
BodyShape AnyCoefficients(TimeNs time_ns, uint64_t seed);

}  // namespace dsg::test
