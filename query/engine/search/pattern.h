// SPDX-License-Identifier: Apache-2.0
// What a node that is looked for is like: as programs and the query language say it (NodePattern),
// and as one revision understands it (Pattern). A word that the map does not know is an error.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/search/words.h"
#include "query/view/graph_view.h"
#include "schema/model/node.h"

namespace dsg::v1 {
class NodePattern;
}  // namespace dsg::v1

namespace dsg::query {

/// Same numbers as v1.Comparison.
enum class Comparison {
  kEqual = 1,
  kNotEqual = 2,
  kLess = 3,
  kLessOrEqual = 4,
  kGreater = 5,
  kGreaterOrEqual = 6,
  kExists = 7,
};

struct AttributeCondition {
  std::string name;
  Comparison comparison = Comparison::kEqual;
  /// Number 0 with kExists, which does not look at it.
  AttributeValue value;
  bool operator==(const AttributeCondition&) const = default;
};

struct RelationCondition;
struct Alternatives;

/// Everything that is set must hold; an empty pattern means any node.
struct NodePattern {
  std::string kind;
  std::string layer;
  std::string class_name;
  std::string name;
  std::string color;
  std::string id;
  std::vector<AttributeCondition> attributes;
  std::vector<RelationCondition> relations;
  std::vector<Alternatives> alternatives;
  /// A noun of the query language that only a map can explain: kind, layer, class, id or name.
  std::string word;
  /// A quoted word is a class or a name, nothing else.
  bool word_is_quoted = false;
  /// Where the word stood in the query, bytes; equality ignores it.
  size_t word_position = 0;

  bool operator==(const NodePattern& other) const;
};

struct RelationCondition {
  /// A relation of the map, INSIDE, or IN (an edge IN, or INSIDE).
  std::string relation;
  NodePattern other;
  /// The edge points from the other node to this one.
  bool reversed = false;
  /// No such node.
  bool negated = false;

  bool operator==(const RelationCondition& other) const = default;
};

/// The node matches at least one of some patterns.
struct Alternatives {
  /// Not empty.
  std::vector<NodePattern> any_of;
  /// It matches none of them.
  bool negated = false;

  bool operator==(const Alternatives& other) const = default;
};

/// Adds the condition that a node matches `operand` (negated: does not). What is nothing but an
/// "or" becomes the alternatives of the condition.
void AddAlternatives(NodePattern operand, bool negated, NodePattern* pattern);

/// True if the pattern says nothing but "this or that".
bool IsOnlyAlternatives(const NodePattern& pattern);

/// Longer queries, deeper nesting and more conditions in all are refused.
inline constexpr size_t kQueryBytesMax = 4096;
inline constexpr int kPatternDepthMax = 8;
inline constexpr int kPatternConditionsMax = 64;

/// The relation that no edge has: below the other in the hierarchy, however many layers down.
inline constexpr char kInsideRelation[] = "INSIDE";

/// Errors: FIELD_INVALID for a comparison, a value or a colour that there is not, and for patterns
/// that are too deep or too long.
absl::StatusOr<NodePattern> NodePatternFromProto(const v1::NodePattern& in);

struct CompiledPattern;

/// A pattern in the words of one view: names have become symbols. Only for that view.
///
/// Threads: immutable.
class Pattern {
 public:
  Pattern() = default;
  explicit Pattern(std::shared_ptr<const CompiledPattern> compiled)
      : compiled_(std::move(compiled)) {}

  const CompiledPattern& compiled() const { return *compiled_; }
  /// Without words: each has become what it means in this map.
  const NodePattern& source() const;

 private:
  std::shared_ptr<const CompiledPattern> compiled_;
};

/// Explains a pattern by a map. `snapshot`, of the view's revision, may be null: then a class that
/// has a label but no node counts as unknown.
/// Errors: CLASS_UNKNOWN, also for a kind, RELATION_UNKNOWN, LAYER_UNKNOWN, and NODE_UNKNOWN for a
/// name, with those that are near in spelling; NODE_ID_INVALID; NODE_UNKNOWN for an id;
/// FIELD_INVALID for an attribute that no node has; what `stop` returned.
absl::StatusOr<Pattern> ResolvePattern(const NodePattern& pattern, const GraphView& view,
                                       const Snapshot* snapshot, const StopCheck& stop);

/// Both steps at once.
absl::StatusOr<Pattern> PatternFromProto(const v1::NodePattern& in, const GraphView& view,
                                         const Snapshot* snapshot, const StopCheck& stop);

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

struct CompiledAlternatives {
  std::vector<std::shared_ptr<const CompiledPattern>> any_of;
  bool negated = false;
};

/// A pattern with the symbols of a view in place of names. For this folder only.
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
  /// Of source.attributes.
  std::vector<Symbol> attribute_names;
  /// It, or one of its alternatives, wants only nodes that have a track, or only their layer.
  bool asks_for_agents = false;
  /// False if no node that has a track can match.
  bool may_be_agent = true;
  std::vector<CompiledRelation> relations;
  std::vector<CompiledAlternatives> alternatives;
  /// CONTAINS; nullopt if the map has no such edge.
  std::optional<Symbol> contains;

  bool has_class() const { return !source.class_name.empty(); }
  bool has_name() const { return !source.name.empty(); }
};

}  // namespace dsg::query
