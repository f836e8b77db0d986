// SPDX-License-Identifier: Apache-2.0
// Mesh blocks, assets, factors and shapes: what goes in comes out, at every revision.
#include <gtest/gtest.h>

#include <random>

#include "schema/codec/checksum.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

MeshBlock FullBlock(BlockIndex index, size_t vertex_count, uint64_t seed) {
  std::mt19937_64 random(seed);
  MeshBlock block;
  block.index = index;
  for (size_t i = 0; i < vertex_count; ++i) {
    const auto coordinate = [&](int32_t at) {
      return 2.0f * static_cast<float>(at) + static_cast<float>(random() % 20'000) * 1e-4f;
    };
    const float x = coordinate(index.x);
    const float y = coordinate(index.y);
    block.positions_map.emplace_back(x, y, coordinate(index.z));
    block.normals_map.emplace_back(0.0f, -1.0f, 1.0f);
    block.colors.push_back(static_cast<uint32_t>(random() & 0xffffff));
    block.labels.push_back(static_cast<uint32_t>(random() % 30));
    block.instance_ids.push_back(static_cast<uint32_t>(random()));
    block.first_seen_ns.push_back(static_cast<TimeNs>(random()));
    block.last_seen_ns.push_back(static_cast<TimeNs>(random()));
  }
  for (size_t i = 0; i + 2 < vertex_count; ++i) {
    const auto v = static_cast<uint32_t>(i);
    block.faces.push_back({v, v + 1, v + 2});
  }
  return block;
}

void ExpectEqual(const MeshBlock& kept, const MeshBlock& block) {
  EXPECT_EQ(kept.index, block.index);
  EXPECT_EQ(kept.positions_map, block.positions_map);
  EXPECT_EQ(kept.normals_map, block.normals_map);
  EXPECT_EQ(kept.colors, block.colors);
  EXPECT_EQ(kept.labels, block.labels);
  EXPECT_EQ(kept.instance_ids, block.instance_ids);
  EXPECT_EQ(kept.first_seen_ns, block.first_seen_ns);
  EXPECT_EQ(kept.last_seen_ns, block.last_seen_ns);
  EXPECT_EQ(kept.faces, block.faces);
}

class Mesh : public OnEveryBackend {};
class Assets : public OnEveryBackend {};
class FactorPayloads : public OnEveryBackend {};
class ShapePayloads : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(Mesh);
DSG_ON_EVERY_BACKEND(Assets);
DSG_ON_EVERY_BACKEND(FactorPayloads);
DSG_ON_EVERY_BACKEND(ShapePayloads);

TEST_P(Mesh, ComesBackWithEveryChannelAndWithFew) {
  TestMap map(GetParam());
  GraphDelta delta;
  delta.mesh_blocks = {FullBlock({-3, 0, 7}, 1000, 1), FullBlock({0, 0, 0}, 3, 2)};
  MeshBlock bare;
  bare.index = {900'000, -900'000, -1};
  bare.positions_map = {{1'800'001, -1'799'999, -1}};
  delta.mesh_blocks.push_back(bare);
  MeshBlock empty;
  empty.index = {INT32_MAX, INT32_MIN, -1};
  delta.mesh_blocks.push_back(empty);
  map.MustCommit(delta);
  const auto snapshot = map.Latest();
  for (const MeshBlock& block : delta.mesh_blocks) {
    ExpectEqual(OrDie(snapshot->ReadMeshBlock(block.index)), block);
  }
  EXPECT_EQ(OrDie(snapshot->MeshBlocks()),
            (std::vector<BlockIndex>{
                {-3, 0, 7}, {0, 0, 0}, {900'000, -900'000, -1}, {INT32_MAX, INT32_MIN, -1}}));
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Mesh, OfPastRevisionsIsAsItWas) {
  TestMap map(GetParam());
  const BlockIndex index{1, 2, 3};
  GraphDelta delta;
  delta.mesh_blocks = {FullBlock(index, 50, 1)};
  map.MustCommit(delta);
  GraphDelta changed;
  changed.mesh_blocks = {FullBlock(index, 60, 2), FullBlock({9, 9, 9}, 5, 3)};
  map.MustCommit(changed);
  GraphDelta removed;
  removed.mesh_removals = {index};
  map.MustCommit(removed);
  ExpectEqual(OrDie(map.At(1)->ReadMeshBlock(index)), delta.mesh_blocks[0]);
  ExpectEqual(OrDie(map.At(2)->ReadMeshBlock(index)), changed.mesh_blocks[0]);
  EXPECT_EQ(ReasonOf(map.At(3)->ReadMeshBlock(index).status()), Reason::kNodeUnknown);
  EXPECT_EQ(OrDie(map.At(1)->MeshBlocks()).size(), 1u);
  EXPECT_EQ(OrDie(map.At(2)->MeshBlocks()).size(), 2u);
  EXPECT_EQ(OrDie(map.At(3)->MeshBlocks()).size(), 1u);
  EXPECT_EQ(OrDie(map.reader().Head()).mesh_block_count, 1);
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Mesh, WithAFaceOfAVertexThatIsNotThereIsRefused) {
  TestMap map(GetParam());
  GraphDelta delta;
  delta.mesh_blocks = {FullBlock({0, 0, 0}, 3, 1)};
  delta.mesh_blocks[0].faces.push_back({0, 1, 3});
  EXPECT_EQ(ReasonOf(map.Commit(delta).status()), Reason::kDeltaInvalid);
}

Asset MakeAsset(std::string content, const std::string& media_type) {
  Asset asset;
  asset.sha256 = ComputeSha256(content);
  asset.media_type = media_type;
  asset.content = std::move(content);
  return asset;
}

TEST_P(Assets, OfAnySizeComeBackInOnePiece) {
  TestMap map(GetParam());
  std::mt19937_64 random(RecordSeed());
  constexpr size_t kMiB = size_t{1} << 20;
  GraphDelta delta;
  for (const size_t size : {size_t{0}, size_t{1}, kMiB - 1, kMiB, kMiB + 1, 3 * kMiB + 12'345}) {
    std::string content(size, '\0');
    for (char& c : content) c = static_cast<char>(random());
    delta.assets.push_back(MakeAsset(std::move(content), "model/ply"));
  }
  map.MustCommit(delta);
  for (const Asset& asset : delta.assets) {
    const Asset kept = OrDie(map.Latest()->ReadAsset(asset.sha256));
    EXPECT_TRUE(kept.content == asset.content) << asset.content.size();
    EXPECT_EQ(kept.media_type, "model/ply");
    EXPECT_EQ(kept.sha256, asset.sha256);
  }
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Assets, GivenTwiceAreStoredOnce) {
  TestMap map(GetParam());
  GraphDelta delta;
  delta.assets = {MakeAsset("cube", "model/ply")};
  map.MustCommit(delta);
  map.MustCommit(delta);
  EXPECT_EQ(OrDie(map.Latest()->ReadAsset(delta.assets[0].sha256)).content, "cube");
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(Assets, OfAnotherContentThanTheirHashAreRefused) {
  TestMap map(GetParam());
  GraphDelta delta;
  delta.assets = {MakeAsset("cube", "model/ply")};
  delta.assets[0].content = "ball";
  EXPECT_EQ(ReasonOf(map.Commit(delta).status()), Reason::kDeltaInvalid);
}

TEST_P(Assets, AreUnknownBeforeTheirRevisionAndToNodesThatComeEarlier) {
  TestMap map(GetParam());
  const Asset cube = MakeAsset("cube", "model/ply");
  Node node = MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1));
  node.object.emplace().model = cube.sha256;
  EXPECT_EQ(ReasonOf(map.Commit(DeltaOfNodes({node})).status()), Reason::kDeltaInvalid);
  GraphDelta delta = DeltaOfNodes({node});
  delta.assets = {cube};
  map.MustCommit(delta);
  EXPECT_EQ(ReasonOf(map.At(0)->ReadAsset(cube.sha256).status()), Reason::kAssetUnknown);
  EXPECT_EQ(OrDie(map.Latest()->GetNode(node.id)).object->model, cube.sha256);
}

TEST_P(FactorPayloads, ComeBackByAgentAndTime) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann"), MakeHuman(2, "bob")}));
  PoseFactor odometry;
  odometry.type = "odometry";
  odometry.from_ns = 10;
  odometry.to_ns = 20;
  odometry.relative_pose.position = {0.1, 0.2, 0.3};
  odometry.relative_pose.orientation = Eigen::Quaterniond(0.5, 0.5, 0.5, -0.5);
  odometry.information.emplace();
  for (size_t i = 0; i < 21; ++i) (*odometry.information)[i] = static_cast<float>(i) * 0.5f;
  PoseFactor closure = odometry;
  closure.type = "loop_closure";
  closure.from_ns = 5;
  closure.to_ns = 90;
  closure.to_agent = NodeId('H', 2);
  closure.information.reset();
  GraphDelta delta;
  delta.factors = {{NodeId('H', 1), {odometry, closure}}};
  map.MustCommit(delta);
  const auto snapshot = map.Latest();
  const auto kept = OrDie(snapshot->Factors(NodeId('H', 1), kTimeMin, kTimeMax));
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0].type, "loop_closure");
  EXPECT_EQ(kept[0].to_agent, NodeId('H', 2));
  EXPECT_FALSE(kept[0].information.has_value());
  EXPECT_EQ(kept[1].type, "odometry");
  EXPECT_EQ(kept[1].from_ns, 10);
  EXPECT_EQ(kept[1].to_ns, 20);
  EXPECT_TRUE(kept[1].to_agent.empty());
  EXPECT_EQ(kept[1].relative_pose.position, odometry.relative_pose.position);
  EXPECT_EQ(kept[1].relative_pose.orientation.coeffs(),
            odometry.relative_pose.orientation.coeffs());
  EXPECT_EQ(kept[1].information, odometry.information);
  EXPECT_EQ(OrDie(snapshot->Factors(NodeId('H', 1), 21, 90)).size(), 1u);
  EXPECT_TRUE(OrDie(snapshot->Factors(NodeId('H', 2), kTimeMin, kTimeMax)).empty());
  EXPECT_TRUE(OrDie(map.At(1)->Factors(NodeId('H', 1), kTimeMin, kTimeMax)).empty());
  EXPECT_EQ(map.Problems(), "");
}

TEST_P(ShapePayloads, ComeBackByAgentAndTime) {
  TestMap map(GetParam());
  const Asset topology = MakeAsset("faces", "application/octet-stream");
  GraphDelta delta = DeltaOfNodes({MakeHuman(1, "ann")});
  delta.assets = {topology};
  BodyShape coefficients;
  coefficients.time_ns = 10;
  coefficients.pose_coefficients.assign(72, 0.25f);
  coefficients.shape_coefficients.assign(10, -1.5f);
  BodyShape vertices;
  vertices.time_ns = 20;
  for (int i = 0; i < 3 * 6890; ++i) vertices.vertices.push_back(static_cast<float>(i) * 1e-3f);
  delta.shapes = {{NodeId('H', 1), topology.sha256, {coefficients, vertices}}};
  map.MustCommit(delta);
  const auto kept = OrDie(map.Latest()->Shapes(NodeId('H', 1), kTimeMin, kTimeMax));
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0].time_ns, 10);
  EXPECT_EQ(kept[0].pose_coefficients, coefficients.pose_coefficients);
  EXPECT_EQ(kept[0].shape_coefficients, coefficients.shape_coefficients);
  EXPECT_EQ(kept[1].vertices, vertices.vertices);
  EXPECT_EQ(OrDie(map.Latest()->Shapes(NodeId('H', 1), 10, 20)).size(), 1u);
  EXPECT_TRUE(OrDie(map.Latest()->Shapes(NodeId('H', 1), 11, 20)).empty());
  EXPECT_EQ(map.Problems(), "");
}

}  // namespace
}  // namespace dsg::test
