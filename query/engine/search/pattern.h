// SPDX-License-Identifier: Apache-2.0
// What a node that is looked for is like: as programs and the query language say it (NodePattern),
// and as one revision understands it (Pattern). Refuses to guess what an unknown word means.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
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

/// Longer queries, deeper nesting and more conditions in all are refused.
inline constexpr size_t kQueryBytesMax = 4096;
inline constexpr int kPatternDepthMax = 8;
inline constexpr int kPatternConditionsMax = 64;

/// The relation that no edge has: below the other in the hierarchy, however many layers down.
inline constexpr char kInsideRelation[] = "INSIDE";

/// Reads the query language of docs/search.md.
/// Errors: QUERY_MALFORMED with `position` (bytes) and `expected`; the message shows the line.
absl::StatusOr<NodePattern> ParseQuery(std::string_view text);

/// The one way to write a pattern; parses back to the same.
std::string FormatQuery(const NodePattern& pattern);

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
/// Errors: CLASS_UNKNOWN, RELATION_UNKNOWN or LAYER_UNKNOWN with those that are near in spelling;
/// NODE_ID_INVALID; NODE_UNKNOWN; FIELD_INVALID; what `stop` returned.
absl::StatusOr<Pattern> ResolvePattern(const NodePattern& pattern, const GraphView& view,
                                       const Snapshot* snapshot, const StopCheck& stop);

/// Both steps at once.
absl::StatusOr<Pattern> PatternFromProto(const v1::NodePattern& in, const GraphView& view,
                                         const Snapshot* snapshot, const StopCheck& stop);

/// True if the node is what the pattern says at an instant; nullopt: at any time, each condition
/// for itself. For the present give kTimeMax - 1. For many nodes, a Matcher remembers more.
bool Matches(const GraphView& view, const Pattern& pattern, const ViewNode& node,
             std::optional<TimeNs> at_ns);

/// All nodes that match, agents included. Ascending id.
/// Errors: what `stop` returned.
absl::StatusOr<std::vector<NodeId>> FindMatches(const GraphView& view, const Pattern& pattern,
                                                std::optional<TimeNs> at_ns, const StopCheck& stop);

}  // namespace dsg::query
