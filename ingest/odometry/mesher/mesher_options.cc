// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/mesher/mesher_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<MesherOptions> kMesherFields[] = {
    {"odometry-mesh-sights", &MesherOptions::sight_count_min, 1, 100,
     "Landmarks that fewer keyframes have seen are corners only while the newest one sees them: of "
     "those that nobody confirms many were on people"},
    {"odometry-mesh-far", &MesherOptions::farthest_m, 0.1, 10'000.0,
     "Largest distance of a corner along the optical axis, metres: beyond it a decimetre between "
     "the cameras tells depth to metres"},
    {"odometry-mesh-edge", &MesherOptions::edge_m_max, 0.01, 1000.0,
     "Longest edge of a triangle, metres: wider gaps may be doors"},
    {"odometry-mesh-aspect", &MesherOptions::aspect_min, 0.0, 0.8,
     "Least height of a triangle over its longest edge, a share of that: thinner ones, and angles "
     "beyond 157 degrees, are noise"},
    {"odometry-mesh-jump", &MesherOptions::depth_ratio_max, 1.0, 1000.0,
     "Depth of a triangle's farthest corner in units of that of the nearest one, at most: more is "
     "the edge of a thing and what is behind it"},
    {"odometry-mesh-facing", &MesherOptions::facing_min, 0.0, 1.0,
     "Least cosine of the angle between a triangle's normal and the ray to it: what is seen more "
     "edge-on than 84 degrees bridges depths"},
    {"odometry-mesh-through", &MesherOptions::through_ratio_min, 1.0, 1000.0,
     "A landmark that is seen within an older triangle, so many times as far away, ends it: depths "
     "err by a tenth"},
    {"odometry-mesh-renew", &MesherOptions::is_renewed, 0, 1,
     "1: older triangles of which the newest keyframe sees all corners give way to its own; 0: "
     "both stay, as in Kimera, and overlap"},
    {"odometry-mesh-horizon", &MesherOptions::horizon_ns, 0.0, 3600.0,
     "A triangle stays so long after its landmarks have left the window, seconds: they are old, or "
     "the window has found them wrong"},
};

}  // namespace

std::vector<BoundOption> MesherOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<MesherOptions>(kMesherFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
