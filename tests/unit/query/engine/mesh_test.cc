// SPDX-License-Identifier: Apache-2.0
// The mesh arrives whole, in order, and in messages that every peer accepts.
#include "query/engine/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::query {
namespace {

using test::kMap;

// A strip of triangles along x inside one block, each vertex with a label of its own.
MeshBlock Strip(BlockIndex index, uint32_t vertex_count) {
  MeshBlock block;
  block.index = index;
  for (uint32_t i = 0; i < vertex_count; ++i) {
    const float along = 1.9f * static_cast<float>(i) / static_cast<float>(vertex_count);
    block.positions_map.emplace_back(2.0f * static_cast<float>(index.x) + along,
                                     i % 2 == 0 ? 0.1f : 0.2f, 0.5f);
    block.normals_map.emplace_back(0.0f, 0.0f, 1.0f);
    block.colors.push_back(0x112233);
    block.labels.push_back(i);
    block.instance_ids.push_back(7);
    block.first_seen_ns.push_back(1'000'000'000'000 + i);
    block.last_seen_ns.push_back(2'000'000'000'000 + i);
    if (i >= 2) block.faces.push_back({i - 2, i - 1, i});
  }
  return block;
}

// Faces as the labels of their corners, which say which vertices were meant.
std::vector<std::array<uint32_t, 3>> FacesByLabel(const std::vector<MeshBlock>& blocks) {
  std::vector<std::array<uint32_t, 3>> faces;
  for (const MeshBlock& block : blocks) {
    for (const auto& face : block.faces) {
      faces.push_back({block.labels[face[0]], block.labels[face[1]], block.labels[face[2]]});
    }
  }
  return faces;
}

TEST(CutBlock, KeepsEveryFaceOnceAndEveryVertexOfASmallPiece) {
  MeshBlock block = Strip({3, -1, 0}, 100);
  // One vertex that no face needs.
  block.faces.erase(block.faces.end() - 1);
  const std::vector<MeshBlock> pieces = CutBlock(block, 10);
  EXPECT_GT(pieces.size(), 9u);
  std::set<uint32_t> labels;
  for (const MeshBlock& piece : pieces) {
    EXPECT_EQ(piece.index, block.index);
    EXPECT_LE(piece.positions_map.size(), 10u);
    EXPECT_EQ(piece.last_seen_ns.size(), piece.positions_map.size());
    labels.insert(piece.labels.begin(), piece.labels.end());
    for (size_t i = 0; i < piece.labels.size(); ++i) {
      EXPECT_EQ(piece.positions_map[i], block.positions_map[piece.labels[i]]);
    }
  }
  EXPECT_EQ(FacesByLabel(pieces), FacesByLabel({block}));
  EXPECT_EQ(labels.size(), 100u);
}

TEST(CutBlock, LeavesASmallBlockAsItIsAndBoundsRepeatedFaces) {
  const MeshBlock block = Strip({0, 0, 0}, 100);
  EXPECT_EQ(CutBlock(block, 100).size(), 1u);
  MeshBlock repeated = Strip({0, 0, 0}, 3);
  repeated.faces.assign(1000, {0, 1, 2});
  const std::vector<MeshBlock> pieces = CutBlock(repeated, 10);
  EXPECT_EQ(FacesByLabel(pieces).size(), 1000u);
  for (const MeshBlock& piece : pieces) EXPECT_LE(piece.faces.size(), 30u);
}

class Mesh : public testing::Test {
 protected:
  Mesh() {
    test::MakeOffice(folder_.path());
    GraphDelta delta;
    delta.mesh_blocks = {Strip({-1, 0, 0}, 10), Strip({0, 0, 0}, 90'000), Strip({4, 0, 0}, 20)};
    test::CommitToOffice(folder_.path(), delta);
    core_ = test::OpenCore(folder_.path());
  }

  absl::StatusOr<std::vector<v1::GetMeshResponse>> Ask(const v1::GetMeshRequest& request) {
    std::vector<v1::GetMeshResponse> messages;
    const absl::Status status =
        query::ReadStream(CallContext(), core_->GetMesh(CallContext(), request),
                          [&](const v1::GetMeshResponse& message) {
                            messages.push_back(message);
                            return true;
                          });
    if (!status.ok()) return status;
    return messages;
  }

  static v1::GetMeshRequest OfMap() {
    v1::GetMeshRequest request;
    request.set_map(kMap);
    return request;
  }

  test::TempFolder folder_;
  std::unique_ptr<ServiceCore> core_;
};

TEST_F(Mesh, StreamsAllBlocksInOrderInBoundedMessages) {
  const auto messages = Ask(OfMap());
  ASSERT_TRUE(messages.ok()) << messages.status();
  std::vector<MeshBlock> blocks;
  for (const v1::GetMeshResponse& message : *messages) {
    EXPECT_EQ(message.has_header(), &message == &messages->front());
    EXPECT_LT(message.ByteSizeLong(), size_t{3} << 20);
    for (const v1::MeshBlock& in : message.blocks()) blocks.push_back(*FromProto(in));
  }
  EXPECT_EQ(messages->front().header().read_revision(), 2);
  EXPECT_GT(messages->size(), 2u);
  EXPECT_TRUE(std::is_sorted(blocks.begin(), blocks.end(),
                             [](const auto& a, const auto& b) { return a.index < b.index; }));
  EXPECT_EQ(FacesByLabel(blocks),
            FacesByLabel({Strip({-1, 0, 0}, 10), Strip({0, 0, 0}, 90'000), Strip({4, 0, 0}, 20)}));
}

TEST_F(Mesh, GivesOnlyBlocksThatTouchTheBox) {
  v1::GetMeshRequest request = OfMap();
  ToProto(Box3d(Eigen::Vector3d(7, 0, 0), Eigen::Vector3d(8, 1, 1)), request.mutable_box());
  const auto messages = Ask(request);
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  ASSERT_EQ(messages->front().blocks_size(), 1);
  EXPECT_EQ(messages->front().blocks(0).x(), 4);
}

TEST_F(Mesh, AnswersWithAHeaderAloneWhereThereIsNoMesh) {
  v1::GetMeshRequest request = OfMap();
  request.mutable_read_at()->set_exact_revision(1);
  const auto messages = Ask(request);
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->size(), 1u);
  EXPECT_EQ(messages->front().header().read_revision(), 1);
  EXPECT_EQ(messages->front().blocks_size(), 0);
}

TEST_F(Mesh, RefusesBoxesThatAreNone) {
  v1::GetMeshRequest request = OfMap();
  request.mutable_box()->mutable_min()->set_x(1.0);
  request.mutable_box()->mutable_max()->set_x(-1.0);
  EXPECT_EQ(ReasonOf(Ask(request).status()), Reason::kBoxInverted);
  request = OfMap();
  request.set_map("attic");
  EXPECT_EQ(ReasonOf(Ask(request).status()), Reason::kMapUnknown);
}

TEST_F(Mesh, StopsWhenTheCallerHasEnough) {
  int message_count = 0;
  const absl::Status status = query::ReadStream(
      CallContext(), core_->GetMesh(CallContext(), OfMap()), [&](const v1::GetMeshResponse&) {
        ++message_count;
        return false;
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(message_count, 1);
}

}  // namespace
}  // namespace dsg::query
