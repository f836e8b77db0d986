// SPDX-License-Identifier: Apache-2.0
// The numbers of the fast mesh of landmarks: which triangles are surfaces, and how long they stay.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"
#include "schema/base/time.h"

namespace dsg::ingest {

struct MesherOptions {
  /// Landmarks that fewer keyframes have seen are corners only while the newest one sees them.
  int sight_count_min = 2;
  /// Distance of corners along the optical axis, metres.
  double farthest_m = 10.0;
  /// Longest edge of a triangle, metres.
  double edge_m_max = 1.0;
  /// Height over the longest edge, a share of it.
  double aspect_min = 0.1;
  /// Depth of the farthest corner in units of that of the nearest one.
  double depth_ratio_max = 1.3;
  /// Cosine of the angle between the normal and the ray to the middle.
  double facing_min = 0.1;
  /// A corner is seen through an older triangle if it lies so many times as far away.
  double through_ratio_min = 1.2;
  /// Not 0: where the newest keyframe has all corners of an older triangle, its own ones count.
  int is_renewed = 1;
  /// A triangle outlives the last keyframe whose window had all its landmarks by so long, ns.
  TimeNs horizon_ns = 0;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
