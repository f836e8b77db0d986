// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/proto_convert.h"

#include <gtest/gtest.h>

#include <limits>

#include "dsg/v1/graph.pb.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"

namespace dsg {
namespace {

// A node with every field set, so that a forgotten one shows.
Node FullNode() {
  Node node;
  node.id = NodeId('O', 42);
  node.layer = layers::kObjects;
  node.kind = kinds::kObject;
  node.name = "red cup";
  node.class_id = 7;
  node.class_name = "cup";
  node.map_T_node = {{1, 2, 3}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
  node.box_node = Box3d(Eigen::Vector3d(-1, -2, -3), Eigen::Vector3d(1, 2, 3));
  node.valid = {10, 20};
  node.first_observed_ns = 11;
  node.last_observed_ns = 19;
  node.observation_count = 5;
  node.confidence = 0.0;
  node.provenance = Provenance::kPredicted;
  node.object = ObjectInfo{ComputeSha256("m"),
                           {{4, 5, 6}, Eigen::Quaterniond(1, 0, 0, 0)},
                           0.25,
                           Color{1, 2, 3, 4},
                           {0.1, 0.2, 0.3},
                           9};
  node.agent = AgentInfo{ComputeSha256("b"), {0.5f, -1.0f}, "lost", 77};
  node.place = PlaceInfo{0.75, Box3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 1)), 3};
  node.structure = StructureInfo{"wall", {0, 0, 1}, -2.5, 8};
  node.region = RegionInfo{{{0, 0}, {1, 0}, {1, 1}}, 0.5, 2.5, {{"kitchen", 0.9}}};
  node.attributes = {{"n", 1.5}, {"t", std::string("text")}, {"f", true}};
  return node;
}

TEST(ProtoConvert, NodesSurviveTheWireWithEveryField) {
  const Node node = FullNode();
  v1::Node wire;
  ToProto(node, LayerTable(), &wire);
  EXPECT_EQ(wire.id(), "O42");
  EXPECT_EQ(wire.layer(), "objects");
  const auto back = FromProto(wire, LayerTable());
  ASSERT_TRUE(back.ok()) << back.status();
  v1::Node again;
  ToProto(*back, LayerTable(), &again);
  EXPECT_EQ(again.DebugString(), wire.DebugString());
  // Every field of the message is set above, so equality means that none is dropped.
  for (int i = 0; i < wire.GetDescriptor()->field_count(); ++i) {
    const auto* field = wire.GetDescriptor()->field(i);
    if (field->name() == "revision" || field->name() == "update_mask") continue;
    const bool set = field->is_repeated() ? wire.GetReflection()->FieldSize(wire, field) > 0
                                          : wire.GetReflection()->HasField(wire, field);
    EXPECT_TRUE(set) << field->name();
  }
}

TEST(ProtoConvert, NodePayloadsRestoreAndAreDeterministic) {
  const Node node = FullNode();
  const std::string payload = EncodeNodePayload(node);
  Node back;
  ASSERT_TRUE(DecodeNodePayload(payload, &back));
  EXPECT_EQ(EncodeNodePayload(back), payload);
  EXPECT_EQ(back.attributes, node.attributes);
  EXPECT_EQ(back.valid, node.valid);
  back.id = node.id;
  back.layer = node.layer;
  v1::Node wire, wire_of_back;
  ToProto(node, LayerTable(), &wire);
  ToProto(back, LayerTable(), &wire_of_back);
  EXPECT_EQ(wire_of_back.DebugString(), wire.DebugString());
  EXPECT_FALSE(DecodeNodePayload("\xff\xff", &back));
}

TEST(ProtoConvert, OpenIntervalsAndUnknownsAreLeftOut) {
  Node node;
  node.id = NodeId('p', 1);
  node.layer = layers::kPlaces;
  node.kind = kinds::kPlace;
  v1::Node wire;
  ToProto(node, LayerTable(), &wire);
  EXPECT_FALSE(wire.has_valid_from_ns());
  EXPECT_FALSE(wire.has_bounding_box());
  EXPECT_FALSE(wire.has_confidence());
  const auto back = FromProto(wire, LayerTable());
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->valid, Interval());
  EXPECT_TRUE(back->box_node.isEmpty());
}

TEST(ProtoConvert, RefusesWhatItCannotRead) {
  v1::Node wire;
  wire.set_id("42");
  EXPECT_EQ(ReasonOf(FromProto(wire, LayerTable()).status()), Reason::kNodeIdInvalid);
  wire.set_id("O42");
  wire.set_layer("attic");
  EXPECT_EQ(ReasonOf(FromProto(wire, LayerTable()).status()), Reason::kLayerUnknown);
  wire.set_layer("objects");
  wire.mutable_bounding_box()->mutable_min()->set_x(2.0);
  EXPECT_EQ(ReasonOf(FromProto(wire, LayerTable()).status()), Reason::kBoxInverted);
  wire.mutable_bounding_box()->mutable_min()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(ReasonOf(FromProto(wire, LayerTable()).status()), Reason::kNumberNotFinite);
}

GraphDelta FullDelta() {
  GraphDelta delta;
  delta.map = "m";
  delta.session_id = "s";
  delta.sequence = 3;
  delta.parent_revision = 2;
  delta.author = "a";
  delta.message = "why";
  delta.config_digest = "c";
  delta.layers = {{20, "attic", 450}};
  delta.labels = {{1, "chair"}};
  delta.nodes = {FullNode()};
  delta.nodes.push_back(FullNode());
  delta.nodes[1].id = NodeId('A', 1);
  delta.nodes[1].layer = 20;
  delta.retirements = {{NodeId('p', 1), 5}, {NodeId('p', 2), std::nullopt}};
  delta.edges = {{NodeId('p', 3), "NEAR", NodeId('p', 4), 0.5, {1, 2}, {{"k", 1.0}}}};
  delta.edge_removals = {{NodeId('p', 5), "NEAR", NodeId('p', 6)}};
  TimedPose pose{100, 2, {{1, 2, 3}, Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5)}};
  pose.covariance = std::make_shared<Covariance6>(Covariance6{1.0f, 2.0f});
  delta.appends = {{NodeId('H', 1), {pose}}};
  delta.corrections = {{NodeId('H', 1), 1, 50, {TimedPose{10}}}};
  delta.factors = {
      {NodeId('H', 1), {{"loop_closure", 1, 2, NodeId('r', 1), Pose3d(), Covariance6{3.0f}}}}};
  delta.shapes = {
      {NodeId('H', 1), ComputeSha256("t"), {{5, {1.0f}, {2.0f}, {3.0f, 4.0f, 5.0f}, {6.0f}}}}};
  delta.stays = {{NodeId('H', 1), NodeId('p', 3), NodeId('R', 1), 7, 8}};
  MeshBlock block{{1, -2, 3}};
  block.positions_map = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  block.normals_map = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  block.colors = {1, 2, 3};
  block.labels = {4, 5, 6};
  block.instance_ids = {7, 8, 9};
  block.first_seen_ns = {1, 2, 3};
  block.last_seen_ns = {4, 5, 6};
  block.faces = {{0, 1, 2}};
  delta.mesh_blocks = {block};
  delta.mesh_removals = {{4, 5, 6}};
  delta.factor_removals = {{NodeId('H', 1), 1, 2}};
  delta.shape_removals = {{NodeId('H', 1), 3, 4}};
  delta.stay_removals = {{NodeId('H', 1), 5}};
  delta.is_forgetting = true;
  delta.assets = {{ComputeSha256("x"), "model/ply", "x"}};
  return delta;
}

TEST(ProtoConvert, DeltasSurviveTheWireAndJsonWithEveryPart) {
  const GraphDelta delta = FullDelta();
  v1::GraphDelta wire;
  ToProto(delta, LayerTable(), &wire);
  for (int i = 0; i < wire.GetDescriptor()->field_count(); ++i) {
    const auto* field = wire.GetDescriptor()->field(i);
    const bool set = field->is_repeated() ? wire.GetReflection()->FieldSize(wire, field) > 0
                                          : wire.GetReflection()->HasField(wire, field);
    EXPECT_TRUE(set) << field->name();
  }
  const auto back = FromProto(wire, LayerTable());
  ASSERT_TRUE(back.ok()) << back.status();
  v1::GraphDelta again;
  ToProto(*back, LayerTable(), &again);
  EXPECT_EQ(again.DebugString(), wire.DebugString());
  const auto from_json = DeltaFromJson(DeltaToJson(delta));
  ASSERT_TRUE(from_json.ok()) << from_json.status();
  v1::GraphDelta third;
  ToProto(*from_json, LayerTable(), &third);
  EXPECT_EQ(third.DebugString(), wire.DebugString());
}

TEST(ProtoConvert, JsonThatIsNoDeltaIsRefused) {
  for (const char* text : {"", "{", "[]", "{\"nodes\": 3}", "{\"unknown\": 1}"}) {
    EXPECT_EQ(ReasonOf(DeltaFromJson(text).status()), Reason::kFileMalformed) << text;
  }
}

TEST(ProtoConvert, BlobsRestore) {
  const GraphDelta delta = FullDelta();
  MeshBlock block;
  ASSERT_TRUE(DecodeMeshBlock(EncodeMeshBlock(delta.mesh_blocks[0]), &block));
  EXPECT_EQ(EncodeMeshBlock(block), EncodeMeshBlock(delta.mesh_blocks[0]));
  std::vector<PoseFactor> factors;
  ASSERT_TRUE(DecodeFactors(EncodeFactors(delta.factors[0].factors), &factors));
  EXPECT_EQ(factors[0].to_agent, NodeId('r', 1));
  EXPECT_FALSE(DecodeMeshBlock("garbage", &block));
}

TEST(ProtoConvert, MapSpecsTakeDefaultsAndAreValidated) {
  v1::MapSpec wire;
  wire.set_name("office");
  const auto spec = FromProto(wire);
  ASSERT_TRUE(spec.ok());
  EXPECT_EQ(spec->gap_ns_max, 2 * kNsPerSecond);
  EXPECT_EQ(spec->codec, TrajectoryCodec::kQuantized);
  wire.set_name("../office");
  EXPECT_EQ(ReasonOf(FromProto(wire).status()), Reason::kMapNameInvalid);
  wire.set_name("office");
  wire.set_gap_ns_max(1);
  EXPECT_EQ(ReasonOf(FromProto(wire).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg
