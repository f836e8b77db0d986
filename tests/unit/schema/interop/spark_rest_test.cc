// SPDX-License-Identifier: Apache-2.0
// What a node keeps of a Spark-DSG file: all of it, no longer than it is true, and safely.
#include "schema/interop/spark_rest.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "schema/base/random.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_mesh.h"
#include "schema/interop/spark_to_delta.h"
#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

SparkNode Room() {
  SparkNode room;
  room.id = NodeId('R', 1).value;
  room.key = {4, 0};
  room.type = SparkClass::kRoom;
  room.box = {SparkBox::Type::kAligned, {0.1f, 0.1f, 0.1f}, {9, 9, 9}, Eigen::Matrix3f::Identity()};
  FinishNode(MakeFields(room), &room);
  return room;
}

Node ImportedRoom() {
  SparkGraph graph;
  graph.nodes = {Room()};
  const auto imported = SparkToDelta(graph, "g.json", 2.0);
  EXPECT_TRUE(imported.ok()) << imported.status();
  return imported.ok() ? imported->delta.nodes.front() : Node();
}

TEST(SparkRest, HoldsWhileTheNodeIsWhatItWas) {
  const Node node = ImportedRoom();
  EXPECT_TRUE(node.box_node.isEmpty());
  const SparkNode back = ToSparkWithRest(node, {4, 0});
  EXPECT_EQ(back.fields.dump(), Room().fields.dump());
}

TEST(SparkRest, GivesWayToWhatTheMapHasLearnt) {
  Node node = ImportedRoom();
  node.box_node = Box3d(Eigen::Vector3d(-2, -2, 0), Eigen::Vector3d(2, 2, 3));
  node.name = "kitchen";
  const SparkNode back = ToSparkWithRest(node, {4, 0});
  EXPECT_EQ(back.fields["name"], "kitchen");
  EXPECT_EQ(back.fields["bounding_box"]["dimensions"], Json({4.0, 4.0, 3.0}));
}

TEST(SparkRest, CostsNothingWhereNothingIsLeftOver) {
  SparkNode chair;
  chair.id = NodeId('O', 1).value;
  chair.key = {2, 0};
  chair.type = SparkClass::kObject;
  chair.box = {
      SparkBox::Type::kAligned, {0.5f, 0.5f, 1.0f}, {0, 0, 0}, Eigen::Matrix3f::Identity()};
  FinishNode(MakeFields(chair), &chair);
  SparkGraph graph;
  graph.nodes = {chair};
  const auto imported = SparkToDelta(graph, "g.json", 2.0);
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_FALSE(imported->delta.nodes[0].attributes.contains(attributes::kSparkRest));
}

TEST(SparkRest, SplitsLongTextsAndRefusesOnesThatAreTooLong) {
  Random random(5, 0);
  Json numbers = Json::array();
  for (int i = 0; i < 60'000; ++i) numbers.push_back(random.Index(1 << 30));
  Attributes attributes;
  ASSERT_TRUE(KeepText(attributes::kSparkRest, numbers, &attributes));
  EXPECT_GT(attributes.size(), 1u);
  for (const auto& [name, value] : attributes) {
    EXPECT_LE(std::get<std::string>(value).size(), kAttributeLengthMax) << name;
  }
  EXPECT_EQ(KeptText(attributes::kSparkRest, attributes), numbers);
  attributes.erase("spark_dsg_2");
  EXPECT_TRUE(KeptText(attributes::kSparkRest, attributes).is_null());

  for (int i = 0; i < 600'000; ++i) numbers.push_back(random.Index(1 << 30));
  Attributes none;
  EXPECT_FALSE(KeepText(attributes::kSparkRest, numbers, &none));
  EXPECT_TRUE(none.empty());
}

// Corners on a grid, so that many faces cross the borders of blocks.
MeshBlock RandomMesh(Random* random) {
  MeshBlock mesh;
  for (int i = 0; i < 400; ++i) {
    mesh.positions_map.emplace_back(static_cast<float>(0.5 * random->Index(12)),
                                    static_cast<float>(0.5 * random->Index(12)), 0.25f);
    mesh.colors.push_back(static_cast<uint32_t>(random->Index(3)));
    mesh.labels.push_back(static_cast<uint32_t>(random->Index(2)));
  }
  for (int i = 0; i < 900; ++i) {
    mesh.faces.push_back({static_cast<uint32_t>(random->Index(400)),
                          static_cast<uint32_t>(random->Index(400)),
                          static_cast<uint32_t>(random->Index(400))});
  }
  return mesh;
}

using Look = std::tuple<float, float, float, uint32_t, uint32_t>;

std::vector<Look> LooksOf(const MeshBlock& mesh) {
  std::vector<Look> looks;
  for (size_t i = 0; i < mesh.positions_map.size(); ++i) {
    const Eigen::Vector3f& p = mesh.positions_map[i];
    looks.emplace_back(p.x(), p.y(), p.z(), mesh.colors[i], mesh.labels[i]);
  }
  return looks;
}

std::vector<std::array<Look, 3>> FacesOf(const MeshBlock& mesh) {
  const std::vector<Look> looks = LooksOf(mesh);
  std::vector<std::array<Look, 3>> faces;
  for (const auto& face : mesh.faces)
    faces.push_back({looks[face[0]], looks[face[1]], looks[face[2]]});
  std::sort(faces.begin(), faces.end());
  return faces;
}

TEST(JoinBlocks, UndoesTheCutIntoBlocks) {
  const uint64_t seed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  for (int round = 0; round < 20; ++round) {
    const MeshBlock whole = RandomMesh(&random);
    const MeshBlock joined = JoinBlocks(SplitIntoBlocks(whole, 1.5), 1.5);
    std::vector<Look> before = LooksOf(whole);
    std::vector<Look> after = LooksOf(joined);
    std::sort(before.begin(), before.end());
    std::sort(after.begin(), after.end());
    EXPECT_EQ(before, after);
    EXPECT_EQ(FacesOf(whole), FacesOf(joined));
  }
}

TEST(MeshNumbers, FollowTheVerticesTheyNamed) {
  Random random(12, 0);
  SparkGraph graph;
  graph.mesh = RandomMesh(&random);
  SparkNode object;
  object.id = NodeId('O', 1).value;
  object.key = {2, 0};
  object.type = SparkClass::kObject;
  Json fields = MakeFields(object);
  fields["mesh_connections"] = {7u, 399u, 0u, 31u};
  FinishNode(fields, &object);
  graph.nodes = {object};
  const auto imported = SparkToDelta(graph, "g.json", 2.0);
  ASSERT_TRUE(imported.ok()) << imported.status();
  const MeshBlock joined = JoinBlocks(imported->delta.mesh_blocks, 2.0);
  const SparkNode back = ToSparkWithRest(imported->delta.nodes[0], {2, 0});
  const std::vector<Look> before = LooksOf(*graph.mesh);
  const std::vector<Look> after = LooksOf(joined);
  ASSERT_EQ(back.fields["mesh_connections"].size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(after.at(back.fields["mesh_connections"][i].get<size_t>()),
              before.at(fields["mesh_connections"][i].get<size_t>()));
  }
}

// Stores write them as a byte; see attributes::NumberOf.
TEST(SparkRest, TheNamesOfAllFieldsHaveANumber) {
  for (int type = 0; type <= static_cast<int>(SparkClass::kTraversability); ++type) {
    for (const SparkField& field : FieldsOf(static_cast<SparkClass>(type))) {
      EXPECT_TRUE(attributes::NumberOf(field.name).has_value()) << field.name;
    }
  }
}

}  // namespace
}  // namespace dsg
