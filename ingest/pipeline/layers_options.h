// SPDX-License-Identifier: Apache-2.0
// How often layers are found anew, and what joins their stages: all numbers of StaticLayers.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Storeys, and what is in them.
struct StoreyOptions {
  double floor_m2_min = 2.0;
  double floor_apart_m = 2.0;
  double robot_above_m = 2.5;
  double ceiling_m_min = 1.8;
  double ceiling_m_max = 6.0;
  double ceiling_guess_m = 2.5;
  double standing_m = 0.3;
  double in_view_m = 0.5;
};

struct LayersOptions {
  StoreyOptions storeys;

  TimeNs mesh_wait_min_ns = 2 * kNsPerSecond;
  double cells_per_second = 2.0e6;
  double vertices_per_second = 1.0e5;
  double path_step_m = 0.1;
  int fit_count = 4;
  TimeNs together_period_ns = kNsPerSecond;
  int together_picture_count_min = 3;
  int together_partner_count_max = 5;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
