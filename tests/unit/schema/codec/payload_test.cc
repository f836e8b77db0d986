// SPDX-License-Identifier: Apache-2.0
// Nodes as the store keeps them: every field comes back bit for bit, and nothing else is taken.
#include <gtest/gtest.h>

#include <limits>

#include "dsg/v1/graph.pb.h"
#include "schema/base/random.h"
#include "schema/codec/bit_stream.h"
#include "schema/codec/checksum.h"
#include "schema/codec/proto_convert.h"

namespace dsg {
namespace {

std::string Wire(const Node& node) {
  v1::Node message;
  ToProto(node, LayerTable(), &message);
  return message.DebugString();
}

Eigen::Vector3d RandomPoint(Random* random) {
  return {random->Uniform(-9, 9), random->Uniform(-9, 9), random->Uniform(-9, 9)};
}

// With all four forms of rotations and of boxes.
Pose3d RandomPose(Random* random) {
  Pose3d pose{RandomPoint(random), Eigen::Quaterniond::Identity()};
  const double half_angle = random->Uniform(-3, 3);
  switch (random->Index(4)) {
    case 0:
      break;
    case 1:
      pose.orientation = {std::cos(half_angle), 0, 0, std::sin(half_angle)};
      break;
    case 2:
      pose.orientation = {-1, 0, 0, 0};
      break;
    default:
      pose.orientation = Eigen::Quaterniond(Eigen::Vector4d::Random()).normalized();
  }
  return pose;
}

Box3d RandomBox(Random* random) {
  const Eigen::Vector3d half = RandomPoint(random).cwiseAbs();
  switch (random->Index(4)) {
    case 0:
      return Box3d();
    case 1:
      return Box3d(Eigen::Vector3d::Zero().eval());
    case 2:
      return Box3d(-half, half);
    default:
      return Box3d(-half, 2 * half);
  }
}

ObjectInfo RandomObject(const Box3d& box, Random* random) {
  ObjectInfo object;
  if (random->Chance(0.5)) {
    object.model = ComputeSha256("model");
    object.map_T_model = RandomPose(random);
  }
  if (random->Chance(0.5)) object.registration_residual_m = random->Uniform();
  if (random->Chance(0.5)) object.color = Color{1, 2, 3, 4};
  if (random->Chance(0.5)) object.size = RandomPoint(random);
  if (random->Chance(0.5) && !box.isEmpty()) object.size = box.sizes();
  object.mesh_instance_id = random->Chance(0.5) ? 4'000'000'000u : 0;
  return object;
}

Node RandomNode(Random* random) {
  constexpr std::array kKinds = {kinds::kObject, kinds::kPlace, kinds::kRobot, "desk lamp", ""};
  Node node;
  node.id = NodeId('O', 42);
  node.layer = layers::kObjects;
  node.kind = kKinds[static_cast<size_t>(random->Index(kKinds.size()))];
  if (random->Chance(0.5)) node.name = std::string("a\0name", 6);
  if (random->Chance(0.5)) node.class_id = random->Index(3) - 1;
  if (random->Chance(0.5)) node.class_name = "chair";
  node.map_T_node = RandomPose(random);
  node.box_node = RandomBox(random);
  const TimeNs now = 1'700'000'000'000'000'000;
  if (random->Chance(0.3)) node.valid.from_ns = now;
  if (random->Chance(0.3)) node.valid.to_ns = now + 5;
  if (random->Chance(0.5)) node.first_observed_ns = random->Chance(0.1) ? kTimeMin : now;
  if (random->Chance(0.5)) node.last_observed_ns = random->Chance(0.1) ? kTimeMax : now + 7;
  if (random->Chance(0.5)) node.observation_count = random->Chance(0.5) ? -3 : 3'000'000'000;
  if (random->Chance(0.5)) node.confidence = random->Uniform();
  node.provenance = static_cast<Provenance>(random->Index(5));
  if (random->Chance(0.5)) node.object = RandomObject(node.box_node, random);
  if (random->Chance(0.2)) {
    node.agent = AgentInfo{{}, {0.5f}, "lost", 77, {Sha256{1, 2, 3}, Sha256{4}}};
  }
  if (random->Chance(0.5)) node.place = PlaceInfo{0.75, RandomBox(random), random->Index(9) - 4};
  if (random->Chance(0.2)) node.structure = StructureInfo{"wall", {0, 0, 1}, -2.5, 8};
  if (random->Chance(0.2)) node.region = RegionInfo{{{0, 0}, {1, 0}}, 0.5, 2.5, {{"hall", 0.9}}};
  if (random->Chance(0.2)) node.attributes = {{"n", 1.5}, {"t", std::string("text")}};
  return node;
}

TEST(NodeCodec, GivesEveryFieldBack) {
  Random random(17, 0);
  for (int i = 0; i < 20'000; ++i) {
    const Node node = RandomNode(&random);
    const std::string payload = EncodeNodePayload(node);
    Node back;
    back.id = node.id;
    back.layer = node.layer;
    ASSERT_TRUE(DecodeNodePayload(payload, &back)) << Wire(node);
    ASSERT_EQ(Wire(back), Wire(node)) << i;
    ASSERT_EQ(EncodeNodePayload(back), payload) << i;
  }
}

// ToProto alone would say nothing of a field that neither of the two knows.
TEST(NodeCodec, GivesEveryFieldBackFromProtobuf) {
  Random random(18, 0);
  for (int i = 0; i < 5'000; ++i) {
    Node node = RandomNode(&random);
    node.kind = kinds::kObject;
    v1::Node message;
    ToProto(node, LayerTable(), &message);
    const absl::StatusOr<Node> back = FromProto(message, LayerTable());
    ASSERT_TRUE(back.ok()) << back.status() << message.DebugString();
    ASSERT_EQ(EncodeNodePayload(*back), EncodeNodePayload(node)) << message.DebugString();
  }
}

TEST(NodeCodec, KeepsTheSignOfZero) {
  Node node;
  node.map_T_node.position.x() = -0.0;
  node.map_T_node.orientation = {1, -0.0, 0, 0};
  node.box_node = Box3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-0.0, 1, 1));
  Node back;
  ASSERT_TRUE(DecodeNodePayload(EncodeNodePayload(node), &back));
  EXPECT_TRUE(std::signbit(back.map_T_node.position.x()));
  EXPECT_TRUE(std::signbit(back.map_T_node.orientation.x()));
  EXPECT_FALSE(std::signbit(back.box_node.min().x()));
  EXPECT_TRUE(std::signbit(back.box_node.max().x()));
}

TEST(NodeCodec, ReadsThePayloadsOfFormatOne) {
  Random random(17, 1);
  for (int i = 0; i < 1000; ++i) {
    const Node node = RandomNode(&random);
    v1::Node message;
    ToProto(node, LayerTable(), &message);
    message.clear_id();
    message.clear_layer();
    Node back;
    back.id = node.id;
    back.layer = node.layer;
    ASSERT_TRUE(DecodeNodePayload(message.SerializeAsString(), &back));
    ASSERT_EQ(Wire(back), Wire(node)) << i;
  }
}

// Format 2 kept attributes in the message of rare details.
TEST(NodeCodec, ReadsAttributesWhereFormatTwoWroteThem) {
  Random random(17, 4);
  for (int i = 0; i < 1000; ++i) {
    Node node = RandomNode(&random);
    node.attributes = {{"n", 1.5}, {"spark_dsg", std::string(R"({"key":[3,0]})")}, {"yes", true}};
    node.agent.reset();
    node.structure.reset();
    node.region.reset();
    Node bare = node;
    bare.attributes.clear();
    const std::string payload = EncodeNodePayload(bare);
    ByteReader in(std::string_view(payload).substr(1));
    const uint64_t flags = in.Varint();
    std::string old = payload.substr(0, 1);
    AppendVarint(flags | 1u << 12, &old);
    old += payload.substr(1 + in.position());
    v1::Node message;
    (*message.mutable_attributes())["n"].set_number(1.5);
    (*message.mutable_attributes())["spark_dsg"].set_text(R"({"key":[3,0]})");
    (*message.mutable_attributes())["yes"].set_flag(true);
    old += message.SerializeAsString();
    Node back;
    back.id = node.id;
    back.layer = node.layer;
    ASSERT_TRUE(DecodeNodePayload(old, &back)) << i;
    ASSERT_EQ(Wire(back), Wire(node)) << i;
  }
}

TEST(NodeCodec, RefusesWhatIsCutOrTooLong) {
  Random random(17, 2);
  for (int i = 0; i < 300; ++i) {
    Node node = RandomNode(&random);
    // A message that is cut between two fields is a message too.
    node.agent.reset();
    node.structure.reset();
    node.region.reset();
    node.attributes["kept"] = std::string(R"({"fields":{"distance":[7,0.25]}})");
    const std::string payload = EncodeNodePayload(node);
    for (size_t size = 1; size < payload.size(); ++size) {
      Node back;
      ASSERT_FALSE(DecodeNodePayload(payload.substr(0, size), &back)) << i << " at " << size;
    }
    Node back;
    ASSERT_FALSE(DecodeNodePayload(payload + '\0', &back)) << i;
  }
}

TEST(NodeCodec, TakesNoHarmFromFlippedBits) {
  Random random(17, 3);
  for (int i = 0; i < 500; ++i) {
    std::string payload = EncodeNodePayload(RandomNode(&random));
    for (int flip = 0; flip < 20; ++flip) {
      payload[static_cast<size_t>(random.Index(static_cast<int>(payload.size())))] ^=
          static_cast<char>(1 << random.Index(8));
      Node back;
      if (DecodeNodePayload(payload, &back)) EncodeNodePayload(back);
    }
  }
}

TEST(NodeCodec, WritesAPlaceInFewBytes) {
  Node node;
  node.kind = kinds::kPlace;
  node.map_T_node.position = {1.1, 2.2, 3.3};
  node.box_node = Box3d(Eigen::Vector3d::Zero().eval());
  node.place = PlaceInfo{0.7, Box3d(), 2};
  EXPECT_EQ(EncodeNodePayload(node).size(), 41u);
}

}  // namespace
}  // namespace dsg
