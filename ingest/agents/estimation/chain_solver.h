// SPDX-License-Identifier: Apache-2.0
// The whole of a chain of states, solved by Ceres.
// Refuses parts of chains: solving them has to be faster than setting up a problem.
#pragma once

#include "ingest/agents/estimation/state_chain.h"

namespace dsg::ingest {

/// Moves every state to the least cost near by; covariances are left as they were. False when Ceres
/// gives up, and then nothing has moved. Instantiated for 1, 3 and 7.
///
/// Cost: some tens of milliseconds for 500 states at N = 7.
template <int N>
bool SolveWithCeres(StateChain<N>* chain);

extern template bool SolveWithCeres<1>(StateChain<1>* chain);
extern template bool SolveWithCeres<3>(StateChain<3>* chain);
extern template bool SolveWithCeres<7>(StateChain<7>* chain);

}  // namespace dsg::ingest
