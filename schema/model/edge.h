// SPDX-License-Identifier: Apache-2.0
// A directed, typed relation between two nodes.
#pragma once

#include <compare>
#include <string>

#include "schema/base/time.h"
#include "schema/model/ids.h"
#include "schema/model/known_names.h"
#include "schema/model/node.h"

namespace dsg {

struct EdgeKey {
  NodeId source;
  std::string relation;
  NodeId target;
  auto operator<=>(const EdgeKey&) const = default;
};

struct Edge {
  NodeId source;
  std::string relation;
  NodeId target;
  double weight = 1.0;
  Interval valid;
  Attributes attributes;
  /// The revision that wrote this version; 0 in a delta.
  Revision revision = 0;

  EdgeKey key() const { return {source, relation, target}; }
};

}  // namespace dsg
