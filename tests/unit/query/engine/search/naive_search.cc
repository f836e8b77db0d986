// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <set>

#include "query/engine/search/words.h"
#include "tests/unit/query/engine/search/furnished_map.h"

namespace dsg::test {
namespace {

using query::Comparison;
using query::NodePattern;
using query::RelationCondition;

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool Glob(const std::string& pattern, const std::string& text) {
  if (pattern.empty()) return text.empty();
  if (pattern[0] == '*') {
    return Glob(pattern.substr(1), text) || (!text.empty() && Glob(pattern, text.substr(1)));
  }
  return !text.empty() && pattern[0] == text[0] && Glob(pattern.substr(1), text.substr(1));
}

bool HoldsCondition(const Node& node, const query::AttributeCondition& condition) {
  const auto found = node.attributes.find(condition.name);
  if (found == node.attributes.end()) return false;
  if (condition.comparison == Comparison::kExists) return true;
  if (found->second.index() != condition.value.index()) return false;
  switch (condition.comparison) {
    case Comparison::kEqual:
      return found->second == condition.value;
    case Comparison::kNotEqual:
      return found->second != condition.value;
    case Comparison::kLess:
      return found->second < condition.value;
    case Comparison::kLessOrEqual:
      return found->second <= condition.value;
    case Comparison::kGreater:
      return found->second > condition.value;
    default:
      return found->second >= condition.value;
  }
}

class Scanner {
 public:
  Scanner(const Belief& belief, std::optional<TimeNs> at_ns) : belief_(belief), at_ns_(at_ns) {}

  bool Matches(const Node& node, const NodePattern& pattern) const {
    if (!Holds(node.valid)) return false;
    if (!pattern.id.empty() && ToString(node.id) != pattern.id) return false;
    if (!pattern.kind.empty() && node.kind != pattern.kind) return false;
    if (!pattern.layer.empty() && LayerName(node.layer) != pattern.layer) return false;
    if (!pattern.class_name.empty() && Lower(node.class_name) != Lower(pattern.class_name)) {
      return false;
    }
    if (!pattern.name.empty() &&
        (node.name.empty() || !Glob(Lower(pattern.name), Lower(node.name)))) {
      return false;
    }
    if (!pattern.color.empty() && (!node.object.has_value() || !node.object->color.has_value() ||
                                   query::NameOfColor(*node.object->color) != pattern.color)) {
      return false;
    }
    for (const auto& condition : pattern.attributes) {
      if (!HoldsCondition(node, condition)) return false;
    }
    for (const RelationCondition& condition : pattern.relations) {
      if (HasRelated(node, condition) == condition.negated) return false;
    }
    for (const query::Alternatives& alternatives : pattern.alternatives) {
      bool is_any = false;
      for (const NodePattern& one : alternatives.any_of) is_any = is_any || Matches(node, one);
      if (is_any == alternatives.negated) return false;
    }
    return true;
  }

 private:
  bool Holds(const Interval& valid) const { return !at_ns_.has_value() || valid.Contains(*at_ns_); }

  static std::string LayerName(LayerId id) {
    for (const Layer& layer : DefaultLayers()) {
      if (layer.id == id) return layer.name;
    }
    return "";
  }

  const Node& Find(NodeId id) const {
    return *std::find_if(belief_.nodes.begin(), belief_.nodes.end(),
                         [id](const Node& node) { return node.id == id; });
  }

  bool HasRelated(const Node& node, const RelationCondition& condition) const {
    if (condition.relation == "INSIDE") return HasInside(node, condition);
    const bool is_symmetric = condition.relation == "NEAR" || condition.relation == "ADJACENT";
    for (const Edge& edge : belief_.edges) {
      if (edge.relation != condition.relation || !Holds(edge.valid)) continue;
      if ((is_symmetric || !condition.reversed) && edge.source == node.id &&
          Matches(Find(edge.target), condition.other)) {
        return true;
      }
      if ((is_symmetric || condition.reversed) && edge.target == node.id &&
          Matches(Find(edge.source), condition.other)) {
        return true;
      }
    }
    return condition.relation == "IN" && HasInside(node, condition);
  }

  bool HasInside(const Node& node, const RelationCondition& condition) const {
    std::set<NodeId> reached = {node.id};
    for (bool grows = true; grows;) {
      grows = false;
      for (const Edge& edge : belief_.edges) {
        if (edge.relation != "CONTAINS" || !Holds(edge.valid)) continue;
        const NodeId from = condition.reversed ? edge.source : edge.target;
        const NodeId to = condition.reversed ? edge.target : edge.source;
        if (reached.contains(from) && Holds(Find(to).valid)) grows |= reached.insert(to).second;
      }
    }
    reached.erase(node.id);
    return std::any_of(reached.begin(), reached.end(),
                       [&](NodeId id) { return Matches(Find(id), condition.other); });
  }

  const Belief& belief_;
  std::optional<TimeNs> at_ns_;
};

}  // namespace

std::vector<query::HitKey> Scan(const Belief& belief, const ScanQuestion& question) {
  const Scanner scanner(belief, question.at_ns);
  std::vector<query::HitKey> found;
  for (const Node& node : belief.nodes) {
    if (!scanner.Matches(node, question.pattern)) continue;
    query::HitKey key{0.0, node.id};
    // No one of these maps has a track, so that in space and at an instant there are no agents.
    const bool is_somewhere =
        question.near_map.has_value() || question.box_map.has_value() || question.at_ns.has_value();
    if (is_somewhere && IsAgentKind(node.kind)) continue;
    if (question.box_map.has_value() && !question.box_map->intersects(node.BoxMap())) continue;
    if (question.near_map.has_value()) {
      key.distance_m = node.DistanceTo(*question.near_map);
      if (question.distance_m_max > 0.0 && key.distance_m > question.distance_m_max) continue;
    }
    found.push_back(key);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace dsg::test
