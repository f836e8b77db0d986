// SPDX-License-Identifier: Apache-2.0
// The simplest tracker there is, to compare with: each detection to the nearest last position.
// Refuses to predict, to smooth and to doubt.
#pragma once

#include "ingest/evaluation/humans.h"
#include "tests/unit/ingest/agents/tracking/people_util.h"

namespace dsg::ingest {

struct NearestOptions {
  double reach_m = 1.0;
  TimeNs close_ns = 5'000'000'000;
};

/// Pairs of least distance first; the rest opens tracks.
evaluation::HumanResult ScoreNearestNeighbour(const PeopleLog& log, const NearestOptions& options);

}  // namespace dsg::ingest
