// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/view/naive_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace dsg::test {
namespace {

using query::GraphView;
using query::SpaceFilter;
using query::Symbol;
using query::ViewAttribute;
using query::ViewEdge;
using query::ViewNode;

class Comparison {
 public:
  Comparison(const GraphView& view, const Snapshot& snapshot, RandomWorld* random)
      : view_(view), snapshot_(snapshot), random_(random) {
    EXPECT_TRUE(snapshot
                    .ScanNodes({}, NodeId(), {},
                               [&](const Node& node) {
                                 nodes_.push_back(node);
                                 return true;
                               })
                    .ok());
    EXPECT_TRUE(snapshot
                    .ScanEdges({}, {}, {},
                               [&](const Edge& edge) {
                                 edges_.push_back(edge);
                                 return true;
                               })
                    .ok());
  }

  void CompareWhole() {
    EXPECT_EQ(view_.revision(), snapshot_.revision());
    EXPECT_EQ(view_.node_count(), std::ssize(nodes_));
    EXPECT_EQ(view_.edge_count(), std::ssize(edges_));
    EXPECT_EQ(view_.layers(), *snapshot_.Layers());
    size_t seen = 0;
    view_.ForEachNode(NodeId(), [&](const ViewNode& node) {
      const bool is_next = seen < nodes_.size() && node.id == nodes_[seen].id;
      EXPECT_TRUE(is_next) << ToString(node.id) << " out of turn";
      if (is_next) ExpectSame(node, nodes_[seen]);
      ++seen;
      return is_next;
    });
    EXPECT_EQ(seen, nodes_.size());
    EXPECT_EQ(view_.FindNode(NodeId('z', 77)), nullptr);
    CompareClasses();
    CompareNames();
  }

  void CompareNode() {
    if (nodes_.empty()) return;
    const NodeId id = nodes_[Index(nodes_.size())].id;
    ASSERT_NE(view_.FindNode(id), nullptr) << ToString(id);
    EXPECT_EQ(view_.FindNode(id)->id, id);
    CompareEdges(id);
    EXPECT_EQ(view_.Ancestors(id), *snapshot_.Ancestors(id));
    const auto ancestors = *snapshot_.Ancestors(id);
    EXPECT_EQ(view_.Parent(id), ancestors.empty() ? NodeId() : ancestors.front());
    CompareDescendants(id);
    std::vector<NodeId> after;
    std::vector<NodeId> expected;
    view_.ForEachNode(id, [&](const ViewNode& node) {
      after.push_back(node.id);
      return after.size() < 3;
    });
    for (const Node& node : nodes_) {
      if (node.id > id && expected.size() < 3) expected.push_back(node.id);
    }
    EXPECT_EQ(after, expected);
  }

  void CompareNearest() {
    const Eigen::Vector3d point = RandomPoint();
    const SpaceFilter filter = RandomFilter();
    const double distance_m_max =
        random_->Int(0, 1) == 0 ? 1e9 : static_cast<double>(random_->Int(0, 8));
    std::vector<std::pair<double, NodeId>> expected;
    for (const Node& node : nodes_) {
      const double distance_m = node.DistanceTo(point);
      if (Matches(filter, node) && distance_m <= distance_m_max) {
        expected.emplace_back(distance_m, node.id);
      }
    }
    std::sort(expected.begin(), expected.end());
    const size_t wanted = Index(expected.size() + 2);
    std::vector<std::pair<double, NodeId>> found;
    view_.ForEachNearest(point, filter, distance_m_max,
                         [&](const ViewNode& node, double distance_m) {
                           found.emplace_back(distance_m, node.id);
                           return found.size() < wanted;
                         });
    expected.resize(std::min(expected.size(), std::max<size_t>(wanted, 1)));
    EXPECT_EQ(found, expected);
  }

  void CompareTouching() {
    const Eigen::Vector3d corner = RandomPoint();
    const Eigen::Vector3d size(static_cast<double>(random_->Int(0, 6)), random_->Real(0, 20),
                               random_->Real(0, 20));
    const Box3d box(corner, corner + size);
    const SpaceFilter filter = RandomFilter();
    std::set<NodeId> expected;
    for (const Node& node : nodes_) {
      if (Matches(filter, node) && node.BoxMap().intersects(box)) expected.insert(node.id);
    }
    std::multiset<NodeId> found;
    view_.ForEachTouching(box, filter, [&](const ViewNode& node) {
      found.insert(node.id);
      return true;
    });
    EXPECT_EQ(std::vector<NodeId>(found.begin(), found.end()),
              std::vector<NodeId>(expected.begin(), expected.end()));
    if (found.empty()) return;
    int visits = 0;
    view_.ForEachTouching(box, filter, [&](const ViewNode&) {
      ++visits;
      return false;
    });
    EXPECT_EQ(visits, 1);
  }

 private:
  size_t Index(size_t count) {
    return static_cast<size_t>(random_->Int(0, static_cast<int64_t>(count) - 1));
  }

  Eigen::Vector3d RandomPoint() {
    // Half of them on the lattice of the objects, where ties are.
    if (random_->Int(0, 1) == 0) {
      return {static_cast<double>(random_->Int(-5, 5)), static_cast<double>(random_->Int(-5, 5)),
              static_cast<double>(random_->Int(0, 2))};
    }
    return {random_->Real(-60, 60), random_->Real(-60, 60), random_->Real(-1, 4)};
  }

  SpaceFilter RandomFilter() {
    SpaceFilter filter;
    if (random_->Int(0, 1) == 0) {
      filter.layer = static_cast<LayerId>(random_->Int(layers::kObjects, layers::kAgents));
    }
    if (random_->Int(0, 2) == 0 && !nodes_.empty()) {
      filter.class_name = view_.symbols().Find(nodes_[Index(nodes_.size())].class_name);
    }
    return filter;
  }

  bool Matches(const SpaceFilter& filter, const Node& node) const {
    return !IsAgentKind(node.kind) && (!filter.layer.has_value() || node.layer == *filter.layer) &&
           (!filter.class_name.has_value() ||
            node.class_name == view_.symbols().Text(*filter.class_name));
  }

  void ExpectSame(const ViewNode& node, const Node& expected) const {
    SCOPED_TRACE(ToString(expected.id));
    EXPECT_EQ(node.layer, expected.layer);
    EXPECT_EQ(view_.symbols().Text(node.kind), expected.kind);
    EXPECT_EQ(view_.symbols().Text(node.class_name), expected.class_name);
    EXPECT_EQ(node.class_id, expected.class_id);
    EXPECT_EQ(view_.symbols().Text(node.name), expected.name);
    EXPECT_EQ(node.color, expected.object.has_value() ? expected.object->color : std::nullopt);
    EXPECT_EQ(node.map_T_node.position, expected.map_T_node.position);
    EXPECT_EQ(node.map_T_node.orientation.coeffs(), expected.map_T_node.orientation.coeffs());
    EXPECT_EQ(node.box_node.isEmpty(), expected.box_node.isEmpty());
    EXPECT_EQ(node.BoxMap().min(), expected.BoxMap().min());
    EXPECT_EQ(node.BoxMap().max(), expected.BoxMap().max());
    EXPECT_EQ(node.valid, expected.valid);
    EXPECT_EQ(node.clearance_m, expected.place.has_value() ? expected.place->clearance_m : 0.0);
    Attributes attributes;
    for (const ViewAttribute& attribute : node.attributes()) {
      attributes[view_.symbols().Text(attribute.name)] = attribute.value;
    }
    EXPECT_EQ(attributes, expected.attributes);
  }

  void CompareClasses() {
    std::map<std::pair<LayerId, std::string>, std::set<NodeId>> classes;
    std::map<LayerId, std::set<NodeId>> whole_layers;
    for (const Node& node : nodes_) {
      classes[{node.layer, node.class_name}].insert(node.id);
      whole_layers[node.layer].insert(node.id);
    }
    size_t class_count = 0;
    for (const Layer& layer : view_.layers()) class_count += view_.ClassesOf(layer.id).size();
    EXPECT_EQ(class_count, classes.size());
    for (const auto& [key, ids] : classes) {
      const auto symbol = view_.symbols().Find(key.second);
      ASSERT_TRUE(symbol.has_value()) << key.second;
      const std::pair<Symbol, int64_t> counted(*symbol, std::ssize(ids));
      const auto counts = view_.ClassesOf(key.first);
      EXPECT_TRUE(std::find(counts.begin(), counts.end(), counted) != counts.end()) << key.second;
      std::multiset<NodeId> found;
      view_.ForEachOfClass(key.first, *symbol, [&](const ViewNode& node) {
        found.insert(node.id);
        return true;
      });
      EXPECT_TRUE(std::equal(found.begin(), found.end(), ids.begin(), ids.end())) << key.second;
    }
    for (const auto& [layer, ids] : whole_layers) {
      std::multiset<NodeId> found;
      view_.ForEachInLayer(layer, [&](const ViewNode& node) {
        found.insert(node.id);
        return true;
      });
      EXPECT_TRUE(std::equal(found.begin(), found.end(), ids.begin(), ids.end())) << layer;
    }
  }

  static std::string Capitals(std::string text) {
    for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    return text;
  }

  void CompareNames() {
    std::map<std::string, std::vector<NodeId>> names;
    for (const Node& node : nodes_) names[node.name].push_back(node.id);
    names.erase("");
    for (const auto& [name, ids] : names) EXPECT_EQ(view_.NodesNamed(name), ids) << name;
    for (int i = 0; i < 6; ++i) {
      const std::string name = "spot" + std::to_string(i);
      if (!names.contains(name)) {
        EXPECT_TRUE(view_.NodesNamed(name).empty());
      }
    }
    std::map<std::string, std::vector<NodeId>> folded_names;
    for (const Node& node : nodes_) folded_names[Capitals(node.name)].push_back(node.id);
    folded_names.erase("");
    for (const auto& [name, ids] : folded_names) {
      EXPECT_EQ(view_.NodesNamedIgnoringCase(name), ids) << name;
    }
    EXPECT_TRUE(view_.NodesNamedIgnoringCase("").empty());
    EXPECT_TRUE(view_.NodesNamedIgnoringCase("no such").empty());
    EXPECT_TRUE(view_.NodesNamed("").empty());
    EXPECT_TRUE(view_.NodesNamed("no such").empty());
  }

  using EdgeRow = std::tuple<Symbol, NodeId, NodeId, double, TimeNs, TimeNs>;
  static EdgeRow RowOf(const ViewEdge& edge) {
    return {edge.relation, edge.source,        edge.target,
            edge.weight,   edge.valid.from_ns, edge.valid.to_ns};
  }

  void CompareEdges(NodeId id) {
    for (const bool outgoing : {true, false}) {
      std::vector<EdgeRow> expected;
      for (const Edge& edge : edges_) {
        if ((outgoing ? edge.source : edge.target) != id) continue;
        expected.push_back({view_.symbols().Find(edge.relation).value(), edge.source, edge.target,
                            edge.weight, edge.valid.from_ns, edge.valid.to_ns});
      }
      std::sort(expected.begin(), expected.end());
      std::vector<EdgeRow> found;
      std::map<Symbol, std::vector<EdgeRow>> by_relation;
      const auto collect = [&](const ViewEdge& edge) {
        found.push_back(RowOf(edge));
        return true;
      };
      outgoing ? view_.ForEachEdgeFrom(id, collect) : view_.ForEachEdgeTo(id, collect);
      EXPECT_EQ(found, expected) << ToString(id);
      for (const EdgeRow& row : expected) by_relation[std::get<0>(row)].push_back(row);
      for (const auto& [relation, rows] : by_relation) {
        found.clear();
        outgoing ? view_.ForEachEdgeFrom(id, relation, collect)
                 : view_.ForEachEdgeTo(id, relation, collect);
        EXPECT_EQ(found, rows) << ToString(id);
      }
    }
  }

  void CompareDescendants(NodeId id) {
    std::vector<NodeId> expected;
    std::vector<NodeId> queue = {id};
    std::set<NodeId> seen = {id};
    for (size_t next = 0; next < queue.size(); ++next) {
      // Edges ascend by target within a source.
      for (const Edge& edge : edges_) {
        if (edge.source != queue[next] || edge.relation != relations::kContains) continue;
        if (!seen.insert(edge.target).second) continue;
        queue.push_back(edge.target);
        expected.push_back(edge.target);
      }
    }
    std::vector<NodeId> found;
    view_.ForEachDescendant(id, [&](const ViewNode& node) {
      found.push_back(node.id);
      return true;
    });
    EXPECT_EQ(found, expected) << ToString(id);
  }

  const GraphView& view_;
  const Snapshot& snapshot_;
  RandomWorld* random_;
  std::vector<Node> nodes_;
  std::vector<Edge> edges_;
};

}  // namespace

void ExpectAnswersAsScan(const GraphView& view, const Snapshot& snapshot, RandomWorld* random,
                         int question_count) {
  Comparison comparison(view, snapshot, random);
  comparison.CompareWhole();
  for (int i = 0; i < question_count; ++i) {
    comparison.CompareNode();
    comparison.CompareNearest();
    comparison.CompareTouching();
  }
}

}  // namespace dsg::test
