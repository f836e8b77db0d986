// SPDX-License-Identifier: Apache-2.0
// What command lines about ways and obstacles say: path, collide.
// Refuses to know what the words mean: times and names stay text until the map is open.
#pragma once

#include <string>
#include <vector>

#include "query/cli/picture_options.h"

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
  /// "X,Y,Z" or "X,Y,Z,QX,QY,QZ,QW"; several are a way.
  std::vector<std::string> poses;
  std::string at;
  double margin_m = 0.0;
  /// 0 = as the service has it.
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

}  // namespace dsg::cli
