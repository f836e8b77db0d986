// SPDX-License-Identifier: Apache-2.0
// What command lines about agents say: where, track, shape, who, met, picked, predict.
// Refuses to know what the words mean: times and names stay text until the map is open.
#pragma once

#include <cstdint>
#include <string>

#include "query/cli/picture_options.h"

namespace dsg::cli {

struct WhereVerb {
  std::string agent;
  std::string at;
};

struct TrackVerb {
  std::string agent;
  std::string from;
  std::string to;
  /// A duration; empty = the stored poses.
  std::string every;
  PictureOptions picture;
};

struct ShapeVerb {
  std::string agent;
  std::string from;
  std::string to;
  /// At most one of both is set: a file for the first body, a folder for one file a body.
  std::string ply;
  std::string obj_folder;
  bool force = false;
};

struct WhoVerb {
  /// Exactly one of both is set. A room, place or region by id or name.
  std::string room;
  std::string box;
  std::string from;
  std::string to;
};

struct MetVerb {
  /// Empty = everybody.
  std::string agent;
  std::string other_agent;
  std::string from;
  std::string to;
  /// Metres; 0 = as the service has it.
  double within_m = 0.0;
  /// A duration; empty = however short.
  std::string for_at_least;
  bool line_of_sight = false;
  /// A duration; empty = as the service has it.
  std::string sight_gap;
  PictureOptions picture;
};

struct PickedVerb {
  /// Empty = anybody, anything, anywhere.
  std::string agent;
  std::string object;
  std::string class_name;
  std::string room;
  std::string from;
  std::string to;
  /// Objects that were put down, instead of those that were picked up.
  bool placed = false;
  /// Also those for which the evidence names nobody.
  bool all = false;
  /// Also the evidence.
  bool why = false;
  PictureOptions picture;
};

struct PredictVerb {
  std::string agent;
  /// Empty = from the end of the track.
  std::string at;
  /// Durations; empty = as the service has it.
  std::string horizon;
  std::string every;
  /// "goals", "cv", "weighted"; empty = goals.
  std::string model;
  /// 0 = as the service has it.
  int32_t path_count = 0;
  bool stop_at_walls = false;
  PictureOptions picture;
};

}  // namespace dsg::cli
