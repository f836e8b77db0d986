// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/body.h"

namespace dsg::query {

Body SweptSphere(double radius_m, const std::vector<Eigen::Vector3d>& points_map) {
  Body body;
  body.kind = Body::Kind::kSphere;
  body.radius_m = radius_m;
  body.poses.reserve(points_map.size());
  for (const Eigen::Vector3d& point : points_map) {
    body.poses.push_back({point, Eigen::Quaterniond::Identity()});
  }
  return body;
}

}  // namespace dsg::query
