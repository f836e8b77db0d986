// SPDX-License-Identifier: Apache-2.0
// Meshes of the volume are stored in the short form of the store, bit by bit as they are, in few
// bytes.
#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/random.h"
#include "schema/codec/mesh_codec.h"
#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

// Reads as a depth camera does: a few millimetres off, more with the distance.
DepthFrame NoisyLook(const TestScene& scene, int i, Random* random) {
  const double angle = i * M_PI / 8.0;
  const Eigen::Vector3d eye(2.2 * std::cos(angle), 2.2 * std::sin(angle), 0.3);
  const Eigen::Vector3d target = i % 2 == 0 ? Eigen::Vector3d(-eye) : Eigen::Vector3d(0, 0, -0.3);
  DepthFrame frame = scene.Render(SmallCamera(), LookAt(eye, target));
  for (float& depth_m : frame.depth_m) {
    depth_m += static_cast<float>(0.002 * random->Normal()) * depth_m;
  }
  frame.time_ns = i * (kNsPerSecond / 10);
  return frame;
}

TEST(MeshBytes, EveryBlockHasAShortFormThatGivesItBack) {
  TestScene scene{{RoomOf({-3, -3, -1.53}, {3, 3, 1.5}), Ball({0.33, 0.24, 0.12}, 0.7),
                   SolidBox({1.2, -1.9, -1.6}, {2.15, -1.1, -0.6})}};
  scene.shapes[0].label = 1 << 8;
  scene.shapes[1].label = 2 << 8 | 1;
  for (const double voxel_m : {0.05, 0.1}) {
    SCOPED_TRACE(voxel_m);
    VolumeOptions options;
    options.voxel_m = voxel_m;
    SemanticVolume volume(options);
    Random random(2, 0);
    size_t vertex_count = 0;
    size_t byte_count = 0;
    for (int i = 0; i < 32; ++i) {
      ASSERT_TRUE(volume.Integrate(NoisyLook(scene, i, &random)).ok());
      // Blocks in the middle of being seen, too.
      if (i % 4 != 3) continue;
      for (const MeshBlock& block : volume.TakeChangedMesh(2.0)) {
        if (block.positions_map.empty()) continue;
        const std::optional<std::string> bytes = EncodeLatticeMesh(block);
        ASSERT_TRUE(bytes.has_value());
        MeshBlock decoded;
        ASSERT_TRUE(DecodeLatticeMesh(*bytes, &decoded));
        EXPECT_EQ(decoded.index, block.index);
        EXPECT_EQ(decoded.positions_map, block.positions_map);
        EXPECT_EQ(decoded.normals_map, block.normals_map);
        EXPECT_EQ(decoded.colors, block.colors);
        EXPECT_EQ(decoded.labels, block.labels);
        EXPECT_EQ(decoded.instance_ids, block.instance_ids);
        EXPECT_EQ(decoded.first_seen_ns, block.first_seen_ns);
        EXPECT_EQ(decoded.last_seen_ns, block.last_seen_ns);
        EXPECT_EQ(decoded.faces, block.faces);
        vertex_count += block.positions_map.size();
        byte_count += bytes->size();
      }
    }
    ASSERT_GT(vertex_count, 5000u);
    const double per_vertex = static_cast<double>(byte_count) / static_cast<double>(vertex_count);
    RecordProperty("bytes_per_vertex", std::to_string(per_vertex));
    EXPECT_LT(per_vertex, 6.0);
  }
}

}  // namespace
}  // namespace dsg::ingest
