// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/matcher.h"

#include <algorithm>
#include <unordered_set>
#include <utility>

#include "query/engine/search/words.h"

namespace dsg::query {
namespace {

// About 50 bytes each. Beyond it all is forgotten, and found again where it is needed.
constexpr size_t kKnownMax = size_t{1} << 20;
constexpr uint64_t kStopEvery = 256;

template <typename T>
bool Compares(const T& left, Comparison comparison, const T& right) {
  switch (comparison) {
    case Comparison::kEqual:
      return left == right;
    case Comparison::kNotEqual:
      return left != right;
    case Comparison::kLess:
      return left < right;
    case Comparison::kLessOrEqual:
      return left <= right;
    case Comparison::kGreater:
      return left > right;
    case Comparison::kGreaterOrEqual:
      return left >= right;
    case Comparison::kExists:
      return true;
  }
  return false;
}

bool HasAttribute(const ViewNode& node, Symbol name, const AttributeCondition& condition) {
  const auto attributes = node.attributes();
  const auto found = std::ranges::find(attributes, name, &ViewAttribute::name);
  if (found == attributes.end()) return false;
  if (condition.comparison == Comparison::kExists) return true;
  if (found->value.index() != condition.value.index()) return false;
  return std::visit(
      [&](const auto& value) {
        using Value = std::decay_t<decltype(value)>;
        return Compares(value, condition.comparison, std::get<Value>(condition.value));
      },
      found->value);
}

}  // namespace

bool Matcher::Tick() {
  if (!status_.ok()) return false;
  if (++work_count_ % kStopEvery == 0 && stop_) status_ = stop_();
  return status_.ok();
}

bool Matcher::MatchesAlone(const CompiledPattern& pattern, const ViewNode& node) const {
  if (pattern.is_never || !HoldsNow(node.valid)) return false;
  if (pattern.id.has_value() && node.id != *pattern.id) return false;
  if (pattern.layer.has_value() && node.layer != *pattern.layer) return false;
  if (pattern.kind.has_value() && node.kind != *pattern.kind) return false;
  if (pattern.has_class() &&
      std::none_of(pattern.classes.begin(), pattern.classes.end(),
                   [&](const ClassRange& range) { return range.class_name == node.class_name; })) {
    return false;
  }
  if (pattern.has_name() &&
      (node.name == 0 || !pattern.name.Matches(view_.symbols().Text(node.name)))) {
    return false;
  }
  if (!pattern.source.color.empty() &&
      (!node.color.has_value() || NameOfColor(*node.color) != pattern.source.color)) {
    return false;
  }
  for (size_t i = 0; i < pattern.attribute_names.size(); ++i) {
    if (!HasAttribute(node, pattern.attribute_names[i], pattern.source.attributes[i])) return false;
  }
  return true;
}

bool Matcher::Matches(const CompiledPattern& pattern, const ViewNode& node) {
  if (!Tick() || !MatchesAlone(pattern, node)) return false;
  if (pattern.relations.empty() && pattern.alternatives.empty()) return true;
  const auto index = static_cast<size_t>(pattern.index);
  if (index >= known_.size()) known_.resize(index + 1);
  if (const auto known = known_[index].find(node.id); known != known_[index].end()) {
    return known->second;
  }
  const bool matches = MatchesAlternatives(pattern, node) && MatchesRelations(pattern, node);
  if (!status_.ok()) return false;
  if (known_count_ == kKnownMax) {
    for (auto& of_pattern : known_) of_pattern.clear();
    known_count_ = 0;
  }
  known_[index].emplace(node.id, matches);
  ++known_count_;
  return matches;
}

bool Matcher::MatchesAlternatives(const CompiledPattern& pattern, const ViewNode& node) {
  return std::ranges::all_of(pattern.alternatives, [&](const CompiledAlternatives& alternatives) {
    const bool is_any = std::ranges::any_of(alternatives.any_of,
                                            [&](const auto& one) { return Matches(*one, node); });
    return status_.ok() && is_any != alternatives.negated;
  });
}

bool Matcher::MatchesRelations(const CompiledPattern& pattern, const ViewNode& node) {
  return std::all_of(pattern.relations.begin(), pattern.relations.end(),
                     [&](const CompiledRelation& relation) {
                       const bool is_found = !FindRelated(relation, pattern, node).empty();
                       return status_.ok() && is_found != relation.negated;
                     });
}

std::vector<NodeId> Matcher::Related(const CompiledPattern& pattern, const ViewNode& node) {
  std::vector<NodeId> related;
  for (const CompiledRelation& relation : pattern.relations) {
    related.push_back(relation.negated ? NodeId() : FindRelated(relation, pattern, node));
  }
  return related;
}

void Matcher::ForEachAcross(Symbol symbol, bool outgoing, NodeId node, const Visit& visit) {
  const auto take = [&](const ViewEdge& edge) {
    if (!Tick()) return false;
    if (!HoldsNow(edge.valid)) return true;
    const ViewNode* other = view_.FindNode(outgoing ? edge.target : edge.source);
    return other == nullptr || visit(*other);
  };
  if (outgoing) {
    view_.ForEachEdgeFrom(node, symbol, take);
  } else {
    view_.ForEachEdgeTo(node, symbol, take);
  }
}

std::vector<NodeId> Matcher::Then(absl::StatusOr<const std::vector<NodeId>*> ids) {
  if (!ids.ok()) status_ = ids.status();
  if (!status_.ok()) return {};
  std::vector<NodeId> then;
  for (const NodeId id : **ids) {
    const ViewNode* node = view_.FindNode(id);
    if (Tick() && node != nullptr && HoldsNow(node->valid)) then.push_back(id);
  }
  return then;
}

std::vector<NodeId> Matcher::StayedIn(const ViewNode& agent) {
  const bool is_agent =
      agent.layer == layers::kAgents && IsAgentKind(view_.symbols().Text(agent.kind));
  return is_agent ? Then(stays_.NodesOf(agent.id)) : std::vector<NodeId>();
}

std::vector<NodeId> Matcher::AgentsIn(NodeId node) { return Then(stays_.AgentsIn(node)); }

void Matcher::ForEachInHierarchy(std::optional<Symbol> contains, bool up, bool with_agents,
                                 const ViewNode& node, const Visit& visit) {
  std::vector<NodeId> level = {node.id};
  std::unordered_set<NodeId> seen = {node.id};
  std::unordered_set<NodeId> guests_seen;
  std::vector<NodeId> stayed_in = up ? StayedIn(node) : std::vector<NodeId>();
  while (!level.empty() && status_.ok()) {
    std::vector<NodeId> next;
    std::vector<NodeId> shown;
    for (const NodeId id : std::exchange(stayed_in, {})) {
      if (seen.insert(id).second) next.push_back(id);
    }
    for (const NodeId from : level) {
      if (contains.has_value()) {
        ForEachAcross(*contains, !up, from, [&](const ViewNode& other) {
          if (HoldsNow(other.valid) && seen.insert(other.id).second) next.push_back(other.id);
          return true;
        });
      }
      if (up || !with_agents) continue;
      for (const NodeId guest : AgentsIn(from)) {
        if (guests_seen.insert(guest).second) shown.push_back(guest);
      }
    }
    shown.insert(shown.end(), next.begin(), next.end());
    // The nearest first, and of those the lowest id, however edges were stored.
    std::sort(shown.begin(), shown.end());
    for (const NodeId id : shown) {
      if (!Tick() || !visit(*view_.FindNode(id))) return;
    }
    level = std::move(next);
  }
}

NodeId Matcher::FindRelated(const CompiledRelation& relation, const CompiledPattern& pattern,
                            const ViewNode& node) {
  NodeId found;
  const auto take = [&](const ViewNode& other) {
    if (!found.empty() && found < other.id) return false;
    if (!Matches(*relation.other, other)) return true;
    found = other.id;
    return false;
  };
  if (relation.how != CompiledRelation::How::kInside && relation.symbol.has_value()) {
    if (relation.symmetric || !relation.reversed) {
      ForEachAcross(*relation.symbol, true, node.id, take);
    }
    if (relation.symmetric || relation.reversed) {
      ForEachAcross(*relation.symbol, false, node.id, take);
    }
  }
  if (!found.empty() || relation.how == CompiledRelation::How::kEdge) return found;
  ForEachInHierarchy(pattern.contains, !relation.reversed, relation.other->may_be_agent, node,
                     take);
  return found;
}

void Matcher::ForEachThatMayRelateTo(const CompiledRelation& relation,
                                     const CompiledPattern& pattern, const ViewNode& node,
                                     const Visit& visit) {
  if (relation.how != CompiledRelation::How::kInside && relation.symbol.has_value()) {
    if (relation.symmetric || !relation.reversed) {
      ForEachAcross(*relation.symbol, false, node.id, visit);
    }
    if (relation.symmetric || relation.reversed) {
      ForEachAcross(*relation.symbol, true, node.id, visit);
    }
  }
  if (relation.how == CompiledRelation::How::kEdge) return;
  ForEachInHierarchy(pattern.contains, relation.reversed, pattern.may_be_agent, node, visit);
}

}  // namespace dsg::query
