// SPDX-License-Identifier: Apache-2.0
// What command lines about nodes and edges say: ls, edges, show, near, find, around, subgraph.
// Refuses to know what the words mean: times and names stay text until the map is open.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "query/cli/picture_options.h"

namespace dsg::cli {

/// The parts of a node filter; empty = any.
struct FilterOptions {
  std::string layer;
  std::string kind;
  std::string class_name;
  std::string at;
};

struct ListVerb {
  FilterOptions filter;
  std::string parent;
  std::string name;
  std::string box;
};

struct EdgesVerb {
  std::string source;
  std::string relation;
  std::string target;
  std::string at;
};

struct ShowVerb {
  std::string id;
};

struct NearVerb {
  std::string position;
  int32_t k = 5;
  FilterOptions filter;
  /// Metres; 0 = no limit.
  double max_distance_m = 0.0;
};

struct FindVerb {
  /// The query, as the shell split it.
  std::vector<std::string> words;
  std::string near;
  /// With `near` only. Metres; 0 = no limit.
  double max_distance_m = 0.0;
  std::string box;
  std::string at;
  bool explain = false;
  PictureOptions picture;
};

struct AroundVerb {
  std::string id;
  /// Empty = all.
  std::vector<std::string> relations;
  /// Neither = both.
  bool outgoing = false;
  bool incoming = false;
  std::string at;
};

struct SubgraphVerb {
  std::string id;
  /// Empty = CONTAINS.
  std::vector<std::string> relations;
  bool both_directions = false;
  /// Edges from the root; 0 = no limit.
  int32_t depth = 0;
  bool tree_only = false;
  FilterOptions filter;
};

}  // namespace dsg::cli
