// SPDX-License-Identifier: Apache-2.0
// A pattern with the symbols of a view in place of names. For the search library only.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "query/engine/search/pattern.h"
#include "query/engine/search/text_match.h"

namespace dsg::query {

/// Nodes of one class in one layer.
struct ClassRange {
  LayerId layer = 0;
  Symbol class_name = 0;
  int64_t node_count = 0;
};

struct CompiledRelation {
  enum class How { kEdge, kInside, kEdgeOrInside };
  How how = How::kEdge;
  /// nullopt: the map has no such edge.
  std::optional<Symbol> symbol;
  /// Either end of the edge will do.
  bool symmetric = false;
  bool reversed = false;
  bool negated = false;
  std::shared_ptr<const CompiledPattern> other;
};

struct CompiledPattern {
  NodePattern source;
  /// Counts the patterns inside a pattern, from 0, for whoever keeps something of each.
  int index = 0;
  /// The map has no node that could match.
  bool is_never = false;
  std::optional<NodeId> id;
  std::optional<Symbol> kind;
  /// Asked for, or the one that the kind lives in.
  std::optional<LayerId> layer;
  /// Meaningful if source.class_name is set.
  std::vector<ClassRange> classes;
  NameMatcher name;
  /// Only nodes that have a track, or only in their layer.
  bool asks_for_agents = false;
  std::vector<CompiledRelation> relations;
  /// CONTAINS; nullopt if the map has no such edge.
  std::optional<Symbol> contains;

  bool has_class() const { return !source.class_name.empty(); }
  bool has_name() const { return !source.name.empty(); }
};

}  // namespace dsg::query
