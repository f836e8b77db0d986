// SPDX-License-Identifier: Apache-2.0
// The short form gives back every bit of the meshes that it takes; others keep the general form,
// and blocks of older stores are read.
#include "schema/codec/mesh_codec.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "dsg/v1/graph.pb.h"
#include "schema/base/random.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shuffle.h"
#include "schema/model/mesh_grid.h"

namespace dsg {
namespace {

constexpr int64_t kPitch = 500;
constexpr int64_t kOffset = 250;

// A relief over n x n cells, of vertices on edges along `axis` in one layer of cells: as marching
// cubes would make of a rough wall.
class Relief {
 public:
  Relief(int axis, int size, uint64_t seed) : axis_(axis), random_(seed, 0) {
    block_.index = {3, -2, 1};
    // Cells ascend by z, y, x; the layer's own axis does not move.
    const int slow = axis == 2 ? 1 : 2;
    const int fast = axis == 0 ? 1 : 0;
    for (int a = 0; a < size; ++a) {
      for (int b = 0; b < size; ++b) {
        std::array<int64_t, 3> cell{};
        cell[slow] = a - 7;
        cell[fast] = b + 40;
        cell[axis] = -3;
        AddFaces(cell, slow, fast);
      }
    }
  }

  MeshBlock block() const { return block_; }

 private:
  void AddFaces(const std::array<int64_t, 3>& cell, int slow, int fast) {
    std::array<uint32_t, 4> corners{};
    const bool turned = random_.Chance(0.3);
    for (const int corner : {0, 1, 2, 1, 3, 2}) {
      std::array<int64_t, 3> point = cell;
      point[fast] += corner & 1;
      point[slow] += corner >> 1;
      corners[static_cast<size_t>(corner)] = VertexAt(point);
    }
    block_.faces.push_back({corners[0], corners[1], corners[2]});
    block_.faces.push_back(turned ? std::array<uint32_t, 3>{corners[2], corners[1], corners[3]}
                                  : std::array<uint32_t, 3>{corners[1], corners[3], corners[2]});
  }

  uint32_t VertexAt(const std::array<int64_t, 3>& point) {
    const auto [entry, is_new] =
        index_of_.try_emplace(point, static_cast<uint32_t>(block_.positions_map.size()));
    if (!is_new) return entry->second;
    Eigen::Vector3f& position = block_.positions_map.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t fraction =
          axis == axis_ ? 150 + random_.Index(static_cast<int>(kPitch) / 10) : 0;
      position[axis] = MeshCoordinateOf(point[axis] * kPitch + kOffset + fraction);
    }
    Eigen::Vector3f normal(0.1f * static_cast<float>(random_.Normal()), -0.2f, 0.05f);
    normal[axis_] = -1.0f;
    block_.normals_map.push_back(NormalOf(NormalCodeOf(normal)));
    block_.colors.push_back(0x805020u + static_cast<uint32_t>(random_.Index(16)) * 0x010101u);
    block_.labels.push_back(point[0] > 50 || point[1] > 50 ? 7u : 4'000'000'000u);
    block_.instance_ids.push_back(static_cast<uint32_t>(random_.Index(3)));
    block_.first_seen_ns.push_back(1'700'000'000'000'000'000 + 100'000'000 * (point[0] / 8));
    block_.last_seen_ns.push_back(block_.first_seen_ns.back() +
                                  100'000'000 * random_.Integer(0, 2));
    return entry->second;
  }

  int axis_;
  Random random_;
  MeshBlock block_;
  std::map<std::array<int64_t, 3>, uint32_t> index_of_;
};

bool SameBits(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b) {
  if (a.size() != b.size()) return false;
  for (size_t i = 0; i < a.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      if (std::bit_cast<uint32_t>(a[i][axis]) != std::bit_cast<uint32_t>(b[i][axis])) return false;
    }
  }
  return true;
}

void ExpectSame(const MeshBlock& a, const MeshBlock& b) {
  EXPECT_EQ(a.index, b.index);
  EXPECT_TRUE(SameBits(a.positions_map, b.positions_map));
  EXPECT_TRUE(SameBits(a.normals_map, b.normals_map));
  EXPECT_EQ(a.colors, b.colors);
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.instance_ids, b.instance_ids);
  EXPECT_EQ(a.first_seen_ns, b.first_seen_ns);
  EXPECT_EQ(a.last_seen_ns, b.last_seen_ns);
  EXPECT_EQ(a.faces, b.faces);
}

std::string GeneralForm(const MeshBlock& block) {
  v1::MeshBlock message;
  ToProto(block, &message);
  return Compress(message.SerializeAsString());
}

void ExpectGeneralForm(const MeshBlock& block) {
  EXPECT_FALSE(EncodeLatticeMesh(block).has_value());
  const std::string bytes = EncodeMeshBlock(block);
  EXPECT_EQ(bytes, GeneralForm(block));
  MeshBlock decoded;
  ASSERT_TRUE(DecodeMeshBlock(bytes, &decoded));
  ExpectSame(decoded, block);
}

TEST(MeshCodec, GivesBackEveryBit) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int size : {1, 2, 30}) {
      SCOPED_TRACE(testing::Message() << "axis " << axis << " size " << size);
      const MeshBlock block = Relief(axis, size, 17).block();
      const std::optional<std::string> bytes = EncodeLatticeMesh(block);
      ASSERT_TRUE(bytes.has_value());
      MeshBlock decoded;
      ASSERT_TRUE(DecodeLatticeMesh(*bytes, &decoded));
      ExpectSame(decoded, block);
      EXPECT_EQ(EncodeMeshBlock(decoded), *bytes);
    }
  }
}

TEST(MeshCodec, TakesAFractionOfTheGeneralForm) {
  const MeshBlock block = Relief(2, 40, 5).block();
  EXPECT_LT(3 * EncodeMeshBlock(block).size(), GeneralForm(block).size());
}

TEST(MeshCodec, ChannelsThatAreMissingStayMissing) {
  using Drop = std::function<void(MeshBlock*)>;
  const std::vector<Drop> drops = {
      [](MeshBlock* block) { block->normals_map.clear(); },
      [](MeshBlock* block) { block->colors.clear(); },
      [](MeshBlock* block) { block->labels.clear(); },
      [](MeshBlock* block) { block->instance_ids.clear(); },
      [](MeshBlock* block) { block->first_seen_ns.clear(); },
      [](MeshBlock* block) { block->last_seen_ns.clear(); },
  };
  for (unsigned which = 0; which < 1u << drops.size(); ++which) {
    MeshBlock block = Relief(1, 4, which).block();
    for (size_t i = 0; i < drops.size(); ++i) {
      if ((which >> i & 1) != 0) drops[i](&block);
    }
    const std::optional<std::string> bytes = EncodeLatticeMesh(block);
    ASSERT_TRUE(bytes.has_value()) << which;
    MeshBlock decoded;
    ASSERT_TRUE(DecodeLatticeMesh(*bytes, &decoded)) << which;
    ExpectSame(decoded, block);
  }
}

TEST(MeshCodec, TimesAtTheLimitsComeBack) {
  MeshBlock block = Relief(0, 3, 1).block();
  block.first_seen_ns[0] = kTimeMin;
  block.last_seen_ns[0] = kTimeMax;
  block.last_seen_ns[1] = 0;
  MeshBlock decoded;
  ASSERT_TRUE(DecodeMeshBlock(EncodeLatticeMesh(block).value(), &decoded));
  ExpectSame(decoded, block);
}

TEST(MeshCodec, WhatIsNoSuchMeshKeepsTheGeneralForm) {
  using Change = std::function<void(MeshBlock*)>;
  const std::map<std::string, Change> changes = {
      {"off the grid", [](MeshBlock* block) { block->positions_map[5].x() += 3e-5f; }},
      {"off the lattice", [](MeshBlock* block) { block->positions_map[5].x() = 20.1234f; }},
      {"minus zero", [](MeshBlock* block) { block->positions_map[5].x() = -0.0f; }},
      {"far away", [](MeshBlock* block) { block->positions_map[5].y() = 3e7f; }},
      {"a vertex without a face",
       [](MeshBlock* block) {
         block->positions_map.push_back(block->positions_map.front());
         block->normals_map.push_back(block->normals_map.front());
         block->colors.push_back(1);
         block->labels.push_back(1);
         block->instance_ids.push_back(1);
         block->first_seen_ns.push_back(1);
         block->last_seen_ns.push_back(1);
       }},
      {"faces in another order",
       [](MeshBlock* block) { std::swap(block->faces.front(), block->faces.back()); }},
      {"a face across cells", [](MeshBlock* block) { block->faces.back()[0] = 0; }},
      {"a normal of any direction",
       [](MeshBlock* block) { block->normals_map[3] = Eigen::Vector3f(1, 2, 3).normalized(); }},
      {"a colour of 32 bits", [](MeshBlock* block) { block->colors[2] = 0xff000000u; }},
      {"no faces", [](MeshBlock* block) { block->faces.clear(); }},
      {"nothing", [](MeshBlock* block) { *block = MeshBlock(); }},
  };
  for (const auto& [what, change] : changes) {
    SCOPED_TRACE(what);
    MeshBlock block = Relief(2, 6, 9).block();
    ASSERT_TRUE(EncodeLatticeMesh(block).has_value());
    change(&block);
    ExpectGeneralForm(block);
  }
}

TEST(MeshCodec, TwoVerticesOnOneEdgeKeepTheGeneralForm) {
  MeshBlock block = Relief(2, 6, 9).block();
  // Two vertices where the lattice has room for one, at different heights.
  block.positions_map[7].x() = block.positions_map[6].x();
  block.positions_map[7].y() = block.positions_map[6].y();
  ExpectGeneralForm(block);
}

// What an older build wrote.
TEST(MeshCodec, ReadsTheGeneralFormOfAMeshThatHasAShortOne) {
  const MeshBlock block = Relief(2, 10, 3).block();
  MeshBlock decoded;
  ASSERT_TRUE(DecodeMeshBlock(GeneralForm(block), &decoded));
  ExpectSame(decoded, block);
}

TEST(MeshCodec, BytesThatAreDamagedNeverCrash) {
  const std::string bytes = EncodeLatticeMesh(Relief(1, 12, 4).block()).value();
  MeshBlock decoded;
  // The last four bytes may be missing and still give a mesh, another one: checksums find that.
  for (size_t size = 0; size + 4 < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeLatticeMesh(bytes.substr(0, size), &decoded)) << size;
  }
  Random random(6, 0);
  for (int i = 0; i < 3000; ++i) {
    std::string damaged = bytes;
    for (int flips = random.Integer(1, 4); flips > 0; --flips) {
      damaged[static_cast<size_t>(random.Index(static_cast<int>(bytes.size())))] ^=
          static_cast<char>(1 << random.Index(8));
    }
    if (!DecodeLatticeMesh(damaged, &decoded)) continue;
    for (const auto& face : decoded.faces) {
      for (const uint32_t vertex : face) ASSERT_LT(vertex, decoded.positions_map.size());
    }
  }
  EXPECT_FALSE(DecodeLatticeMesh(bytes + '\0', &decoded));
  EXPECT_FALSE(DecodeLatticeMesh("", &decoded));
  EXPECT_FALSE(DecodeLatticeMesh(std::string(1, kLatticeMeshVersion), &decoded));
}

TEST(MeshGrid, RoundsByHalfAStepAndOnceOnly) {
  Random random(8, 0);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d point(random.Uniform(-300, 300), random.Uniform(-300, 300),
                                random.Uniform(-30, 30));
    const Eigen::Vector3f rounded = RoundToMeshGrid(point);
    // Half a step, and half a last digit of a float at 300 m.
    EXPECT_LE((rounded.cast<double>() - point).cwiseAbs().maxCoeff(), 0.5 * kMeshStepM + 1.6e-5);
    EXPECT_EQ(RoundToMeshGrid(rounded.cast<double>()), rounded);
  }
  EXPECT_FALSE(std::signbit(RoundToMeshGrid({-1e-6, 0.0, 0.0}).x()));
}

TEST(MeshGrid, DirectionsAreWithinTheirBoundAndKeepTheirCode) {
  Random random(9, 0);
  double worst_rad = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d direction(random.Normal(), random.Normal(), random.Normal());
    const Eigen::Vector3f rounded = NormalOf(NormalCodeOf(direction.normalized().cast<float>()));
    EXPECT_NEAR(rounded.norm(), 1.0f, 1e-6f);
    worst_rad = std::max(
        worst_rad, std::acos(std::min(1.0, direction.normalized().dot(rounded.cast<double>()))));
    EXPECT_EQ(NormalOf(NormalCodeOf(rounded)), rounded);
  }
  EXPECT_LT(worst_rad, 0.7 * M_PI / 180.0);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3f along = -Eigen::Vector3f::Unit(axis);
    EXPECT_EQ(NormalOf(NormalCodeOf(along)), along);
  }
  EXPECT_EQ(NormalCodeOf(Eigen::Vector3f::Zero()), NormalCode());
}

}  // namespace
}  // namespace dsg
