// SPDX-License-Identifier: Apache-2.0
// The verbs about paths and obstacles: path, collide.
#pragma once

#include <string>
#include <vector>

#include "query/cli/arguments.h"
#include "query/cli/lookups.h"

namespace dsg::v1 {
class CheckCollisionResponse;
class CollisionResult;
class PlanPathResponse;
}  // namespace dsg::v1

namespace dsg::cli {

struct PathVerb {
  /// "X,Y,Z", an id or a name, or "nearest CLASS".
  std::string from;
  std::string to;
  /// Metres; 0 = a point.
  double radius_m = 0.0;
  std::vector<std::string> blocked;
  /// A* over all places instead of rooms first.
  bool flat = false;
  std::string at;
  bool check = false;
  PictureOptions picture;
};

struct CollideVerb {
  /// Exactly one of the four is set. Metres.
  double sphere_radius_m = 0.0;
  std::string box;
  std::string capsule;
  std::string mesh_file;
  /// "X,Y,Z" or "X,Y,Z,QX,QY,QZ,QW"; several are a path.
  std::vector<std::string> poses;
  std::string at;
  double margin_m = 0.0;
  /// 0 = the default of the service.
  double clearance_max_m = 0.0;
  /// None set = everything but predicted agents.
  bool objects = false;
  bool structures = false;
  bool mesh_blocks = false;
  bool agents = false;
  bool predicted_agents = false;
  bool ignore_floor = false;
  std::vector<std::string> ignored;
  PictureOptions picture;
};

/// One line per property of the path.
std::string RenderPath(const v1::PlanPathResponse& reply, const NodeNames& names);

/// "hit object cup (O7) at x 1.00 ..." or "free, ...".
std::string CollisionText(const v1::CollisionResult& result, const NodeNames& names);

}  // namespace dsg::cli
