// SPDX-License-Identifier: Apache-2.0
// The verb predict: where an agent will be.
#pragma once

#include <cstdint>
#include <string>

#include "query/cli/arguments.h"
#include "query/cli/lookups.h"

namespace dsg::v1 {
class PredictAgentResponse;
}  // namespace dsg::v1

namespace dsg::cli {

struct PredictVerb {
  std::string agent;
  /// Empty = from the end of the track.
  std::string at;
  /// Durations; empty = the default of the service.
  std::string horizon;
  std::string every;
  /// "goals", "cv", "weighted"; empty = goals.
  std::string model;
  /// 0 = the default of the service.
  int32_t path_count = 0;
  bool stop_at_walls = false;
  PictureOptions picture;
};

/// One line per predicted path, then the steps of the most probable one.
std::string RenderPrediction(const v1::PredictAgentResponse& reply, const TimeText& times,
                             const NodeNames& names);

/// Of a predicted path, in whole per cent: "89 %", "<1 %".
std::string ChanceText(double probability);

}  // namespace dsg::cli
