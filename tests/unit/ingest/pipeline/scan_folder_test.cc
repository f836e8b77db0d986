// SPDX-License-Identifier: Apache-2.0
// Lidar scans in a folder of KITTI's form become the mesh of the room in which they were made.
#include <gtest/gtest.h>

#include <cstring>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/pipeline/ingest_log.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/depth/made_scan.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string MatrixLine(const Pose3d& pose) {
  const Eigen::Matrix3d rotation = pose.orientation.toRotationMatrix();
  std::string line;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      absl::StrAppendFormat(&line, "%.12e ", rotation(row, column));
    }
    absl::StrAppendFormat(&line, "%.12e%s", pose.position[row], row == 2 ? "\n" : " ");
  }
  return line;
}

// The lidar goes forward and turns; the camera that the poses are of looks forward, z ahead.
TEST(ScanFolder, MakesTheMeshOfARoom) {
  const TempFolder folder;
  Pose3d camera_T_lidar;
  Eigen::Matrix3d axes;
  axes << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  camera_T_lidar.orientation = Eigen::Quaterniond(axes);
  camera_T_lidar.position = {0.02, -0.08, -0.27};
  // The map is the lidar's frame at first.
  Pose3d room_T_map;
  room_T_map.position = {0.0, 1.0, 1.1};
  std::string times, poses;
  for (int i = 0; i <= 20; ++i) {
    Pose3d map_T_lidar;
    map_T_lidar.position = {0.05 * i, 0.0, 0.01 * i};
    const double half_turn = 0.05 * i;
    map_T_lidar.orientation = Eigen::Quaterniond(std::cos(half_turn), 0, 0, std::sin(half_turn));
    std::string scan;
    for (const Eigen::Vector3f& point : MadeScan(room_T_map * map_T_lidar)) {
      const float values[] = {point.x(), point.y(), point.z(), 0.5f};
      scan.append(reinterpret_cast<const char*>(values), sizeof(values));
    }
    folder.Write(absl::StrFormat("seq/velodyne/%06d.bin", i), scan);
    absl::StrAppend(&times, 0.1 * i, "\n");
    poses += MatrixLine(camera_T_lidar * map_T_lidar * camera_T_lidar.Inverse());
  }
  folder.Write("seq/times.txt", times);
  folder.Write("seq/poses.txt", poses);
  folder.Write("seq/calib.txt", "Tr: " + MatrixLine(camera_T_lidar));
  const auto store = *OpenStore("memory:scans", {.create = true});
  MapSpec spec;
  spec.name = "room";
  ASSERT_TRUE(store->CreateMap(spec).ok());
  const auto log = OpenLog(folder.Path("seq"), {});
  ASSERT_TRUE(log.ok()) << log.status();
  const std::shared_ptr<MapReader> reader = *store->OpenMap("room");
  const auto writer = *store->OpenWriter("room");
  IngestOptions options;
  options.mapping.volume.range_m = 8.0;
  const auto summary =
      IngestLog(**log, {}, options, *MakeSnapshotMapView(*reader->Latest(), reader), *writer, {});
  ASSERT_TRUE(summary.ok()) << summary.status();
  ASSERT_TRUE(summary->mapping.has_value());
  EXPECT_EQ(summary->mapping->volume.frame_count, 4 * 21);
  const auto latest = *reader->Latest();
  int64_t vertex_count = 0, off_count = 0;
  const std::vector<BlockIndex> indices = *latest->MeshBlocks();
  for (const BlockIndex& index : indices) {
    const MeshBlock block = *latest->ReadMeshBlock(index);
    for (const Eigen::Vector3f& vertex : block.positions_map) {
      ++vertex_count;
      if (OffSurface(room_T_map * vertex.cast<double>()) > 0.06) ++off_count;
    }
  }
  EXPECT_GT(vertex_count, 2000);
  EXPECT_LT(off_count, 0.02 * static_cast<double>(vertex_count)) << vertex_count;
}

}  // namespace
}  // namespace dsg::ingest
