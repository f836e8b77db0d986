// SPDX-License-Identifier: Apache-2.0
// An estimate and the ground truth in, one report out.
// Refuses to fill gaps: what was not built stays empty.
#pragma once

#include "absl/status/status.h"
#include "ingest/evaluation/estimate.h"
#include "ingest/evaluation/report.h"
#include "ingest/evaluation/store_reader.h"
#include "ingest/truth/truth.h"

namespace dsg::evaluation {

struct EvaluateOptions {
  MeshOptions mesh;
  HumanOptions humans;
  ObjectOptions objects;
  RelationScoreOptions relations;
  PlaceOptions places;
  RoomOptions rooms;
  PickOptions picks;
};

Report Evaluate(const Estimate& estimate, const truth::Truth& truth, const EvaluateOptions& options,
                const ProgressFunction& progress);

/// Moves the map by yaw and translation to where the robot's causal path lies best on the true one.
/// Errors: FAILED_PRECONDITION when fewer than three poses fall into the time of the truth.
absl::Status AlignMap(const truth::Truth& truth, Estimate* estimate);

}  // namespace dsg::evaluation
