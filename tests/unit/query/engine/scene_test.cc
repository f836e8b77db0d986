// SPDX-License-Identifier: Apache-2.0
// A scene in columns says what the lists of nodes and edges say.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/scene.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/columns.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;

struct Row {
  std::string id;
  std::string layer;
  std::string kind;
  std::string name;
  std::string class_name;
  uint32_t parent = 0;
  Eigen::Vector3d position;
  std::vector<float> box;
  std::vector<Eigen::Vector2d> outline;
};

// The rows of a stream, and its edges by ids.
struct Decoded {
  v1::SceneHead head;
  int message_count = 0;
  std::vector<Row> rows;
  std::set<std::tuple<std::string, std::string, std::string>> edges;
  std::map<std::tuple<std::string, std::string, std::string>, float> weights;

  const Row* Find(const std::string& id) const {
    for (const Row& row : rows) {
      if (row.id == id) return &row;
    }
    return nullptr;
  }
  std::string ParentOf(const std::string& id) const {
    const Row* const row = Find(id);
    return row == nullptr || row->parent >= rows.size() ? "" : rows[row->parent].id;
  }
};

std::string TextAt(const std::string& ends_column, const std::string& texts, size_t row) {
  const auto ends = ValuesOf<uint32_t>(ends_column);
  if (ends.empty()) return "";
  const uint32_t begin = row == 0 ? 0 : ends[row - 1];
  return texts.substr(begin, ends[row] - begin);
}

void AddNodes(const v1::SceneNodes& in, const v1::Vector3& origin, Decoded* out) {
  EXPECT_EQ(in.first_row(), std::ssize(out->rows));
  const auto ids = ValuesOf<uint64_t>(in.ids());
  const auto parents = ValuesOf<uint32_t>(in.parents());
  const auto positions = ValuesOf<float>(in.positions());
  const auto boxes = ValuesOf<float>(in.boxes());
  const auto kinds = ValuesOf<uint16_t>(in.kind_indices());
  const auto classes = ValuesOf<uint16_t>(in.class_indices());
  const auto outline_ends = ValuesOf<uint32_t>(in.outline_ends());
  const auto outlines = ValuesOf<float>(in.outlines());
  ASSERT_EQ(std::ssize(ids), in.row_count());
  ASSERT_EQ(positions.size(), 3 * ids.size());
  for (size_t i = 0; i < ids.size(); ++i) {
    Row row;
    row.id = ToString(NodeId(ids[i]));
    row.layer = in.layer();
    row.kind = in.kinds(kinds.empty() ? 0 : kinds[i]);
    row.class_name = in.classes(classes.empty() ? 0 : classes[i]);
    row.name = TextAt(in.name_ends(), in.names(), i);
    row.parent = parents[i];
    row.position = Eigen::Vector3d(origin.x() + positions[3 * i], origin.y() + positions[3 * i + 1],
                                   origin.z() + positions[3 * i + 2]);
    if (!boxes.empty()) {
      row.box.assign(boxes.begin() + static_cast<long>(6 * i),
                     boxes.begin() + static_cast<long>(6 * i + 6));
    }
    if (!outline_ends.empty()) {
      for (uint32_t k = i == 0 ? 0 : outline_ends[i - 1]; k < outline_ends[i]; ++k) {
        row.outline.emplace_back(origin.x() + outlines[2 * k], origin.y() + outlines[2 * k + 1]);
      }
    }
    out->rows.push_back(std::move(row));
  }
}

class Scene : public testing::Test {
 protected:
  Scene() {
    MakeOffice(folder_.path());
    request_.set_map(kMap);
  }

  absl::StatusOr<Decoded> Get() {
    core_ = OpenCore(folder_.path());
    Decoded decoded;
    const absl::Status status = query::ReadStream(
        CallContext(), core_->GetScene(CallContext(), request_), [&](const auto& message) {
          if (decoded.message_count++ == 0) {
            EXPECT_TRUE(message.has_header());
            decoded.head = message.head();
          }
          if (message.has_nodes()) {
            AddNodes(message.nodes(), decoded.head.origin_map(), &decoded);
          }
          if (message.has_edges()) AddEdges(message.edges(), &decoded);
          return true;
        });
    if (!status.ok()) return status;
    return decoded;
  }

  static void AddEdges(const v1::SceneEdges& in, Decoded* out) {
    const auto sources = ValuesOf<uint32_t>(in.sources());
    const auto targets = ValuesOf<uint32_t>(in.targets());
    const auto weights = ValuesOf<float>(in.weights());
    ASSERT_EQ(std::ssize(sources), in.row_count());
    for (size_t i = 0; i < sources.size(); ++i) {
      const auto edge =
          std::make_tuple(out->rows.at(sources[i]).id, in.relation(), out->rows.at(targets[i]).id);
      EXPECT_TRUE(out->edges.insert(edge).second);
      out->weights[edge] = weights.empty() ? 1.0F : weights[i];
    }
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  v1::GetSceneRequest request_;
};

TEST_F(Scene, HasEveryNodeOnceTheHighestLayersFirst) {
  const auto scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  std::vector<std::string> ids;
  for (const Row& row : scene->rows) ids.push_back(row.id);
  EXPECT_EQ(ids, (std::vector<std::string>{"B1", "R1", "R2", "p1", "p2", "p3", "H12", "H13", "r1",
                                           "O1", "O2"}));
  EXPECT_EQ(scene->Find("R1")->name, "kitchen");
  EXPECT_EQ(scene->Find("R1")->kind, "room");
  EXPECT_EQ(scene->Find("r1")->kind, "robot");
  EXPECT_EQ(scene->Find("H12")->kind, "human");
  EXPECT_EQ(scene->Find("p2")->name, "");
  EXPECT_EQ(scene->ParentOf("O2"), "p3");
  EXPECT_EQ(scene->ParentOf("p3"), "R2");
  EXPECT_EQ(scene->ParentOf("B1"), "");
  EXPECT_NEAR((scene->Find("O1")->position - Eigen::Vector3d(2.1, 4.6, 1.0)).norm(), 0.0, 1e-6);
  EXPECT_NEAR(scene->Find("O2")->box.at(3), 0.5, 1e-6);
  EXPECT_TRUE(std::isnan(scene->Find("H13")->box.empty() ? NAN : scene->Find("H13")->box[0]));
  EXPECT_EQ(scene->head.bounds_map().max().x(), 20.0);
}

TEST_F(Scene, HasTheEdgesOfTheList) {
  const auto scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  v1::ListEdgesRequest list;
  list.set_map(kMap);
  v1::ListEdgesResponse listed;
  ASSERT_TRUE(core_->ListEdges(CallContext(), list, &listed).ok());
  EXPECT_EQ(std::ssize(scene->edges), listed.edges_size());
  for (const v1::Edge& edge : listed.edges()) {
    const auto key = std::make_tuple(edge.source(), edge.relation(), edge.target());
    ASSERT_TRUE(scene->edges.contains(key)) << edge.ShortDebugString();
    EXPECT_NEAR(scene->weights.at(key), edge.weight(), 1e-6);
  }
}

TEST_F(Scene, NarrowsToLayersAndRelations) {
  request_.add_layers("places");
  request_.add_relations("TRAVERSABLE");
  auto scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->rows.size(), 3u);
  EXPECT_EQ(scene->edges.size(), 2u);
  // Their rooms are not sent.
  EXPECT_EQ(scene->ParentOf("p1"), "");
  request_.set_without_edges(true);
  scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_TRUE(scene->edges.empty());
  request_.add_layers("plaices");
  EXPECT_EQ(ReasonOf(Get().status()), Reason::kLayerUnknown);
}

TEST_F(Scene, ThinsALayerEvenlyAndSaysSo) {
  request_.set_nodes_per_layer_max(2);
  const auto scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  for (const v1::SceneLayer& layer : scene->head.layers()) {
    EXPECT_LE(layer.sent_count(), 2);
    if (layer.layer().name() == "places") {
      EXPECT_EQ(layer.node_count(), 3);
      EXPECT_EQ(layer.sent_count(), 2);
    }
  }
  request_.set_nodes_per_layer_max(-1);
  EXPECT_EQ(ReasonOf(Get().status()), Reason::kFieldInvalid);
}

TEST_F(Scene, OfAnInstantHasWhoWasThereWhereTheyWere) {
  request_.set_at_ns(4 * kSecond);
  auto scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  // The robot has one pose, a second later.
  EXPECT_EQ(scene->Find("r1"), nullptr);
  EXPECT_NEAR(scene->Find("H12")->position.x(), 5.0, 1e-6);
  request_.set_at_ns(30 * kSecond);
  scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  ASSERT_NE(scene->Find("H12"), nullptr);
  EXPECT_TRUE(std::isnan(scene->Find("H12")->position.x())) << "in a gap of its track";
  EXPECT_EQ(scene->Find("H13"), nullptr);
}

TEST_F(Scene, HasOutlinesOfRoomsAndWhenThingsWereThere) {
  GraphDelta delta;
  Node room = OfficeDelta().nodes[1];
  room.region = RegionInfo{{{0, 0}, {10, 0}, {10, 10}, {0, 10}}, 0.0, 3.0, {}};
  Node chair = OfficeDelta().nodes[7];
  chair.valid = {2 * kSecond, 5 * kSecond};
  chair.class_name = "seat";
  chair.class_id = 7;
  delta.labels = {{7, "seat"}};
  delta.nodes = {room, chair};
  CommitToOffice(folder_.path(), std::move(delta));
  auto scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  ASSERT_EQ(scene->Find("R1")->outline.size(), 4u);
  EXPECT_NEAR(scene->Find("R1")->outline[2].x(), 10.0, 1e-6);
  EXPECT_TRUE(scene->Find("R2")->outline.empty());
  EXPECT_EQ(scene->Find("O2")->class_name, "seat");
  EXPECT_EQ(scene->Find("O1")->class_name, "");
  request_.set_at_ns(6 * kSecond);
  scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->Find("O2"), nullptr);
  EXPECT_EQ(scene->edges.count({"p3", "CONTAINS", "O2"}), 0u);
}

TEST_F(Scene, OfAnEmptyMapIsAHead) {
  request_.mutable_read_at()->set_exact_revision(0);
  const auto scene = Get();
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->message_count, 1);
  EXPECT_TRUE(scene->rows.empty());
  EXPECT_FALSE(scene->head.has_bounds_map());
}

TEST_F(Scene, OfManyNodesComesInBoundedMessages) {
  GraphDelta delta;
  for (uint64_t i = 100; i < 60'100; ++i) {
    delta.nodes.push_back(MakeNode(NodeId('p', i), layers::kPlaces, kinds::kPlace, "",
                                   Box3d(Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(2, 2, 2))));
    Edge edge;
    edge.source = NodeId('R', 1);
    edge.relation = relations::kContains;
    edge.target = NodeId('p', i);
    delta.edges.push_back(edge);
  }
  CommitToOffice(folder_.path(), std::move(delta));
  core_ = OpenCore(folder_.path());
  int64_t rows = 0;
  int64_t edges = 0;
  size_t largest = 0;
  const absl::Status status = query::ReadStream(
      CallContext(), core_->GetScene(CallContext(), request_), [&](const auto& message) {
        largest = std::max(largest, message.ByteSizeLong());
        rows += message.nodes().row_count();
        edges += message.edges().row_count();
        return true;
      });
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(rows, 60'011);
  EXPECT_EQ(edges, 60'009);
  EXPECT_LT(largest, size_t{2} << 20);
}

}  // namespace
}  // namespace dsg::test
