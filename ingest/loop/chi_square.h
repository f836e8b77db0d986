// SPDX-License-Identifier: Apache-2.0
// How large the squared residual of a right measurement may be.
// Refuses any degrees of freedom but those of planar and spatial poses.
#pragma once

namespace dsg::ingest {

/// The value that a chi-square number of 3 (planar) or 6 degrees of freedom stays below with chance
/// `confidence`, in [0, 1 - 1e-12].
double ChiSquareGate(double confidence, bool is_planar);

}  // namespace dsg::ingest
