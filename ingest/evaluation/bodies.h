// SPDX-License-Identifier: Apache-2.0
// How far the joints and vertices of stored bodies are from those that people had.
// Refuses to match bodies by shape: a body is compared with the person whose detection made it.
#pragma once

#include "absl/status/status.h"
#include "ingest/evaluation/estimate.h"
#include "ingest/evaluation/humans.h"
#include "ingest/truth/body_file.h"
#include "ingest/truth/truth.h"

namespace dsg::evaluation {

/// Fills in the errors of joints and vertices of `result`, which EvaluateHumans has made of the
/// same estimate. Of joints all 24 count, the pelvis too. `bodies`: the truth's, null without
/// any; bodies of another count of vertices are left out.
/// Errors: of BodyFile::Read.
absl::Status ScoreBodies(const Estimate& estimate, const truth::Truth& truth,
                         truth::BodyFile* bodies, HumanResult* result);

}  // namespace dsg::evaluation
