// SPDX-License-Identifier: Apache-2.0
// The mesh of one node: by its instance id, on its surface, in its box, over its footprint.
#include "query/engine/node_mesh.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using test::kMap;

constexpr double kBlockM = 2.0;

// A small triangle that faces up or east, known by its time of first sight.
struct Piece {
  TimeNs mark = 0;
  Vector3f middle;
  bool faces_east = false;
  uint32_t label = 0;
  uint32_t instance = 0;
};

// Triangles of these marks, in the blocks in which they belong.
std::vector<MeshBlock> BlocksOf(const std::vector<Piece>& pieces) {
  MeshBlock whole;
  for (const Piece& piece : pieces) {
    const auto first = static_cast<uint32_t>(whole.positions_map.size());
    const Vector3f side = piece.faces_east ? Vector3f(0, 0, 0.02f) : Vector3f(0.02f, 0, 0);
    whole.positions_map.push_back(piece.middle - side);
    whole.positions_map.push_back(piece.middle + side);
    whole.positions_map.push_back(piece.middle + Vector3f(0, 0.02f, 0));
    whole.faces.push_back({first, first + 1, first + 2});
    for (int i = 0; i < 3; ++i) {
      whole.labels.push_back(piece.label);
      whole.instance_ids.push_back(piece.instance);
      whole.first_seen_ns.push_back(piece.mark);
      whole.last_seen_ns.push_back(piece.mark);
    }
  }
  return SplitIntoBlocks(whole, kBlockM);
}

Node Wall(NodeId id, const Box3d& box) {
  Node wall = test::MakeNode(id, layers::kStructures, kinds::kStructure, "", box);
  wall.structure.emplace();
  wall.structure->structure_type = "wall";
  wall.structure->plane_normal_map = Vector3d::UnitX();
  wall.structure->plane_offset_m = -10.0;
  return wall;
}

Node Thing(NodeId id, const Box3d& box, uint32_t instance) {
  Node thing = test::MakeNode(id, layers::kObjects, kinds::kObject, "", box);
  thing.class_id = 5;
  thing.object.emplace();
  thing.object->mesh_instance_id = instance;
  return thing;
}

// In room R1: a thing of instance 7 and one without, both of class 5, and the wall to R2 at x = 10.
class NodesMesh : public testing::Test {
 protected:
  NodesMesh() {
    test::MakeOffice(folder_.path());
    GraphDelta delta;
    delta.nodes = {Thing(NodeId('O', 21), Box3d(Vector3d(2, 2, 0), Vector3d(3, 3, 1)), 7),
                   Thing(NodeId('O', 22), Box3d(Vector3d(5, 5, 0), Vector3d(6, 6, 1)), 0),
                   Wall(NodeId('W', 1), Box3d(Vector3d(9.9, 0, 0), Vector3d(10.1, 10, 3)))};
    delta.mesh_blocks = BlocksOf({
        {.mark = 1, .middle = {2.5f, 2.5f, 0.5f}, .label = 5, .instance = 7},
        // Of another piece of what was one thing.
        {.mark = 2, .middle = {4.5f, 2.5f, 0.5f}, .label = 5, .instance = 7},
        {.mark = 3, .middle = {2.5f, 2.5f, 0.9f}, .label = 5, .instance = 8},
        {.mark = 4, .middle = {5.5f, 5.5f, 1.04f}, .label = 5},
        // Of another class, and too far out.
        {.mark = 5, .middle = {5.5f, 5.5f, 0.2f}, .label = 6},
        {.mark = 6, .middle = {5.5f, 5.5f, 1.2f}, .label = 5},
        {.mark = 7, .middle = {10.05f, 5.0f, 1.5f}, .faces_east = true},
        // Lies at the wall, and does not face it.
        {.mark = 8, .middle = {10.05f, 6.0f, 1.5f}},
        {.mark = 9, .middle = {15.0f, 5.0f, 0.0f}},
        {.mark = 10, .middle = {15.0f, 5.0f, 3.5f}},
    });
    test::CommitToOffice(folder_.path(), delta);
    core_ = test::OpenCore(folder_.path());
  }

  absl::StatusOr<std::set<TimeNs>> Marks(const std::string& node) {
    v1::GetMeshRequest request;
    request.set_map(kMap);
    request.set_node(node);
    std::set<TimeNs> marks;
    const absl::Status status =
        query::ReadStream(CallContext(), core_->GetMesh(CallContext(), request),
                          [&](const v1::GetMeshResponse& message) {
                            for (const v1::MeshBlock& in : message.blocks()) {
                              const MeshBlock block = *FromProto(in);
                              EXPECT_EQ(block.positions_map.size(), 3 * block.faces.size());
                              for (const auto& face : block.faces)
                                marks.insert(block.first_seen_ns[face[0]]);
                            }
                            return true;
                          });
    if (!status.ok()) return status;
    return marks;
  }

  test::TempFolder folder_;
  std::unique_ptr<ServiceCore> core_;
};

using Set = std::set<TimeNs>;

TEST_F(NodesMesh, OfAnObjectAreTheTrianglesOfItsInstanceInItsBox) {
  EXPECT_EQ(*Marks("O21"), Set({1}));
}

TEST_F(NodesMesh, OfAnObjectWithoutAnInstanceAreThoseInItsBoxOfItsClass) {
  EXPECT_EQ(*Marks("O22"), Set({4}));
}

TEST_F(NodesMesh, OfAWallAreThoseThatFaceIt) { EXPECT_EQ(*Marks("W1"), Set({7})); }

TEST_F(NodesMesh, OfRoomsAreThoseBetweenFloorAndCeilingWithTheWallsOfBoth) {
  EXPECT_EQ(*Marks("R1"), Set({1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(*Marks("R2"), Set({7, 8, 9}));
  EXPECT_EQ(*Marks("B1"), Set({1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST_F(NodesMesh, RefusesAgentsPlacesAndUnknownNodes) {
  for (const char* node : {"H12", "p1"}) {
    EXPECT_EQ(ReasonOf(Marks(node).status()), Reason::kFieldInvalid) << node;
  }
  EXPECT_EQ(ReasonOf(Marks("O99").status()), Reason::kNodeUnknown);
}

TEST(NodeMesh, CutsAFootprintWithoutHeightsByItsBox) {
  Node room = test::MakeNode(NodeId('R', 5), layers::kRooms, kinds::kRoom, "",
                             Box3d(Vector3d(0, 0, 0), Vector3d(4, 4, 3)));
  room.region.emplace();
  // Half of the box.
  room.region->footprint_map = {{0, 0}, {4, 0}, {0, 4}};
  const absl::StatusOr<NodeMesh> mesh = NodeMesh::Of(room);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  Set marks;
  for (const MeshBlock& block : BlocksOf({{.mark = 1, .middle = {1.0f, 1.0f, 1.0f}},
                                          {.mark = 2, .middle = {3.0f, 3.0f, 1.0f}},
                                          {.mark = 3, .middle = {1.0f, 1.0f, 3.2f}}})) {
    const MeshBlock part = mesh->Cut(block);
    marks.insert(part.first_seen_ns.begin(), part.first_seen_ns.end());
  }
  EXPECT_EQ(marks, Set({1}));
}

TEST(NodeMesh, RefusesANodeWithoutExtent) {
  const Node bare = test::MakeNode(NodeId('O', 1), layers::kObjects, kinds::kObject, "", Box3d());
  EXPECT_EQ(ReasonOf(NodeMesh::Of(bare).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::query
