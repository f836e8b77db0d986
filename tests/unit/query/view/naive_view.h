// SPDX-License-Identifier: Apache-2.0
// The questions of a GraphView answered by looking at everything that a snapshot shows.
#pragma once

#include <string>
#include <vector>

#include "query/view/graph_view.h"
#include "tests/support/random_world.h"

namespace dsg::test {

/// Expects that a view gives the answers that a scan of the snapshot gives: of all nodes and all
/// edges, and of `question_count` random questions of each kind.
void ExpectAnswersAsScan(const query::GraphView& view, const Snapshot& snapshot,
                         RandomWorld* random, int question_count);

}  // namespace dsg::test
