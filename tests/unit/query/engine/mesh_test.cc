// SPDX-License-Identifier: Apache-2.0
// The mesh arrives whole, in order, and in messages that every peer accepts.
#include "query/engine/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/scene.pb.h"
#include "query/engine/coarse_mesh.h"
#include "query/engine/mesh_columns.h"
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

TEST_F(Mesh, GivesTheBlocksAndChannelsThatAreNamed) {
  v1::GetMeshRequest request = OfMap();
  for (const int x : {4, 9}) request.add_blocks()->set_x(x);
  request.add_channels(v1::MESH_CHANNEL_COLORS);
  const auto messages = Ask(request);
  ASSERT_TRUE(messages.ok()) << messages.status();
  ASSERT_EQ(messages->front().blocks_size(), 1) << "there is no block 9";
  const MeshBlock block = *FromProto(messages->front().blocks(0));
  EXPECT_EQ(block.index.x, 4);
  EXPECT_EQ(block.colors.size(), block.positions_map.size());
  EXPECT_TRUE(block.normals_map.empty());
  EXPECT_TRUE(block.labels.empty());
  EXPECT_TRUE(block.last_seen_ns.empty());
  request.add_channels(static_cast<v1::MeshChannel>(99));
  EXPECT_EQ(ReasonOf(Ask(request).status()), Reason::kFieldInvalid);
}

// The numbers of a column.
template <typename T>
std::vector<T> ValuesOf(const std::string& column) {
  std::vector<T> values(column.size() / sizeof(T));
  std::memcpy(values.data(), column.data(), values.size() * sizeof(T));
  return values;
}

TEST_F(Mesh, ComesAsColumnsWithTheSameNumbers) {
  v1::GetMeshRequest request = OfMap();
  const auto fields = Ask(request);
  request.set_encoding(v1::MESH_ENCODING_COLUMNS);
  const auto columns = Ask(request);
  ASSERT_TRUE(columns.ok()) << columns.status();
  std::vector<v1::MeshColumns> pieces;
  for (const v1::GetMeshResponse& message : *columns) {
    EXPECT_EQ(message.blocks_size(), 0);
    EXPECT_LT(message.ByteSizeLong(), size_t{3} << 20);
    pieces.insert(pieces.end(), message.columns().begin(), message.columns().end());
  }
  size_t next = 0;
  for (const v1::GetMeshResponse& message : *fields) {
    for (const v1::MeshBlock& in : message.blocks()) {
      const MeshBlock block = *FromProto(in);
      ASSERT_LT(next, pieces.size());
      const v1::MeshColumns& piece = pieces[next++];
      EXPECT_EQ(piece.index().x(), block.index.x);
      EXPECT_EQ(piece.vertex_count(), in.positions_size() / 3);
      EXPECT_EQ(piece.face_count(), in.faces_size() / 3);
      EXPECT_EQ(piece.step_m(), 0.0);
      EXPECT_EQ(ValuesOf<float>(piece.positions()),
                std::vector<float>(in.positions().begin(), in.positions().end()));
      EXPECT_EQ(ValuesOf<float>(piece.normals()),
                std::vector<float>(in.normals().begin(), in.normals().end()));
      EXPECT_EQ(piece.colors().substr(0, 3), "\x11\x22\x33");
      EXPECT_EQ(ValuesOf<uint32_t>(piece.labels()), block.labels);
      EXPECT_EQ(ValuesOf<uint32_t>(piece.instance_ids()), block.instance_ids);
      EXPECT_EQ(ValuesOf<TimeNs>(piece.first_seen_ns()), block.first_seen_ns);
      EXPECT_EQ(ValuesOf<TimeNs>(piece.last_seen_ns()), block.last_seen_ns);
      EXPECT_EQ(ValuesOf<uint16_t>(piece.faces()),
                std::vector<uint16_t>(in.faces().begin(), in.faces().end()));
    }
  }
  EXPECT_EQ(next, pieces.size());
}

TEST_F(Mesh, CoarseColumnsAreWithinHalfAStep) {
  v1::GetMeshRequest request = OfMap();
  request.add_blocks()->set_x(4);
  const auto exact = Ask(request);
  request.set_encoding(v1::MESH_ENCODING_COARSE_COLUMNS);
  const auto coarse = Ask(request);
  ASSERT_TRUE(exact.ok() && coarse.ok()) << coarse.status();
  const v1::MeshBlock& block = exact->front().blocks(0);
  ASSERT_EQ(coarse->front().columns_size(), 1);
  const v1::MeshColumns& piece = coarse->front().columns(0);
  EXPECT_GT(piece.step_m(), 0.0);
  EXPECT_LT(piece.step_m(), 1.9 / 65'535);
  const auto steps = ValuesOf<uint16_t>(piece.positions());
  ASSERT_EQ(steps.size(), static_cast<size_t>(block.positions_size()));
  const double origin_map[] = {piece.origin_map().x(), piece.origin_map().y(),
                               piece.origin_map().z()};
  for (size_t i = 0; i < steps.size(); ++i) {
    EXPECT_NEAR(origin_map[i % 3] + piece.step_m() * steps[i], block.positions(static_cast<int>(i)),
                0.5001 * piece.step_m());
  }
  const auto normals = ValuesOf<int8_t>(piece.normals());
  ASSERT_EQ(normals.size(), steps.size());
  EXPECT_EQ(normals[2], 127);
}

TEST_F(Mesh, RefusesAnUnknownEncoding) {
  v1::GetMeshRequest request = OfMap();
  request.set_encoding(static_cast<v1::MeshEncoding>(9));
  const absl::Status refused = Ask(request).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid);
  EXPECT_EQ(MetadataOf(refused).at("field"), "encoding");
}

TEST(FillMeshColumns, TakesOneVertexAndNone) {
  v1::MeshColumns none;
  FillMeshColumns(MeshBlock(), /*is_coarse=*/true, &none);
  EXPECT_EQ(none.vertex_count(), 0);
  MeshBlock point;
  point.positions_map.emplace_back(3.0f, 4.0f, 5.0f);
  v1::MeshColumns one;
  FillMeshColumns(point, /*is_coarse=*/true, &one);
  EXPECT_GT(one.step_m(), 0.0);
  EXPECT_EQ(ValuesOf<uint16_t>(one.positions()), (std::vector<uint16_t>{0, 0, 0}));
  EXPECT_EQ(one.origin_map().z(), 5.0);
}

TEST_F(Mesh, IsCoarserWithACell) {
  v1::GetMeshRequest request = OfMap();
  request.set_cell_m(0.1);
  const auto messages = Ask(request);
  ASSERT_TRUE(messages.ok()) << messages.status();
  size_t vertices = 0;
  for (const v1::GetMeshResponse& message : *messages) {
    for (const v1::MeshBlock& in : message.blocks())
      vertices += FromProto(in)->positions_map.size();
  }
  // Three strips of 1.9 m, two vertices wide.
  EXPECT_LE(vertices, 3u * 2 * 20);
  EXPECT_GE(vertices, 40u);
  for (const double cell : {-1.0, 1e-9, std::nan("")}) {
    request.set_cell_m(cell);
    EXPECT_EQ(ReasonOf(Ask(request).status()), Reason::kFieldInvalid) << cell;
  }
}

TEST(CoarsenBlock, KeepsASurfaceAndItsSide) {
  // A square of 1 m, 11 x 11 vertices, facing up, with colours that grow along x.
  MeshBlock square;
  for (uint32_t i = 0; i < 121; ++i) {
    square.positions_map.emplace_back(0.1f * static_cast<float>(i % 11),
                                      0.1f * static_cast<float>(i / 11), 0.0f);
    square.normals_map.emplace_back(0.0f, 0.0f, 1.0f);
    square.colors.push_back(i % 11 * 20 << 16);
    square.first_seen_ns.push_back(i);
    square.last_seen_ns.push_back(i);
  }
  for (uint32_t row = 0; row < 10; ++row) {
    for (uint32_t i = 11 * row; i < 11 * row + 10; ++i) {
      square.faces.push_back({i, i + 1, i + 12});
      square.faces.push_back({i, i + 12, i + 11});
    }
  }
  const MeshBlock coarse = CoarsenBlock(square, 0.25);
  EXPECT_EQ(coarse.positions_map.size(), 25u);
  EXPECT_EQ(coarse.colors.size(), 25u);
  EXPECT_EQ(coarse.first_seen_ns.front(), 0);
  EXPECT_EQ(coarse.last_seen_ns.back(), 120);
  double area = 0.0;
  for (const auto& [a, b, c] : coarse.faces) {
    const Eigen::Vector3f u = coarse.positions_map[b] - coarse.positions_map[a];
    const Eigen::Vector3f v = coarse.positions_map[c] - coarse.positions_map[a];
    EXPECT_GT(u.cross(v).z(), 0.0f);
    area += 0.5 * u.cross(v).z();
  }
  // Only the outermost half cells are lost.
  EXPECT_GT(area, 0.7);
  EXPECT_LE(area, 1.0);
}

TEST_F(Mesh, ListsItsBlocksWithTheirRevisions) {
  v1::ListMeshBlocksRequest request;
  request.set_map(kMap);
  request.set_page_size(2);
  core_ = test::OpenCore(folder_.path());
  std::vector<int> found;
  do {
    v1::ListMeshBlocksResponse reply;
    ASSERT_TRUE(core_->ListMeshBlocks(CallContext(), request, &reply).ok());
    for (const v1::MeshBlockVersion& block : reply.blocks()) {
      found.push_back(block.index().x());
      EXPECT_EQ(block.revision(), 2);
    }
    request.set_page_token(reply.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(found, (std::vector<int>{-1, 0, 4}));
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
