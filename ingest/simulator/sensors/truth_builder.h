// SPDX-License-Identifier: Apache-2.0
// Puts together what really was: the truth folder beside a log.
// Refuses to write it; ingest/truth does.
#pragma once

#include <vector>

#include "ingest/simulator/body/detector.h"
#include "ingest/simulator/sensors/observation.h"
#include "ingest/simulator/sensors/session.h"
#include "ingest/truth/truth.h"

namespace dsg::simulator {

/// `grid` with what was observed of it.
truth::Truth BuildTruth(const SensorSession& session, const Observation& observation,
                        const std::vector<DetectionOutput>& detections, truth::FreeGrid grid);

/// The model of a detected body.
const BodyModel& ModelOf(const SensorSession& session, const DetectedBody& body);

/// The true body behind each detection, as `folder`/bodies.bin, if the log has bodies.
/// Errors: of OutputFile.
absl::Status WriteTrueBodies(const SensorSession& session,
                             const std::vector<DetectionOutput>& detections,
                             const std::string& folder);

/// The CAD models that the truth's objects name, as PLY files under `folder`/cad.
/// Errors: of OutputFile.
absl::Status WriteCadModels(const SensorSession& session, const std::string& folder);

}  // namespace dsg::simulator
