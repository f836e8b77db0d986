// SPDX-License-Identifier: Apache-2.0
// The mesh of a painted room, from images and inertial samples to walls.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <vector>

#include "ingest/odometry/estimator/stereo_eye.h"
#include "ingest/odometry/estimator/visual_inertial_odometry.h"
#include "ingest/odometry/mesher/multi_frame_mesh.h"
#include "tests/unit/ingest/odometry/estimator/textured_room.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

// Of a point in the room, or behind one of its walls.
double DistanceToWalls(const Vector3d& point) {
  const Eigen::Array3d to_walls = (Eigen::Array3d(3.5, 3.0, 1.5) - point.array().abs()).abs();
  return to_walls.minCoeff();
}

struct RoomMesh {
  int keyframe_count = 0;
  size_t least_triangles = SIZE_MAX;
  std::vector<double> vertex_errors_m;
  std::vector<double> middle_errors_m;
  ObstacleMesh last;
};

// Where the robot knows itself to be, as it uses the mesh: drift does not count.
void Compare(const MultiFrameMesh& mesh, const Pose3d& room_T_odom, RoomMesh* room) {
  ++room->keyframe_count;
  room->least_triangles = std::min(room->least_triangles, mesh.triangle_count());
  room->last = mesh.Mesh();
  std::vector<Vector3d> points;
  for (const Vector3d& vertex : room->last.vertices_odom) points.push_back(room_T_odom * vertex);
  for (const Vector3d& point : points) room->vertex_errors_m.push_back(DistanceToWalls(point));
  for (const auto& face : room->last.faces) {
    const Vector3d middle = (points[face[0]] + points[face[1]] + points[face[2]]) / 3.0;
    room->middle_errors_m.push_back(DistanceToWalls(middle));
  }
}

RoomMesh MeshOfRoom(double seconds) {
  const TexturedRoom painted;
  const RoomRig rig;
  const Carried carried;
  auto eye = MakeStereoEye(rig.left, rig.right(), {});
  EXPECT_TRUE(eye.ok()) << eye.status();
  auto odometry = VisualInertialOdometry::Make((*eye)->camera(), rig.imu, {});
  EXPECT_TRUE(odometry.ok()) << odometry.status();
  const CameraCalibration& camera = (*eye)->camera().left;
  auto mesh = MultiFrameMesh::Make(camera, {});
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  RoomMesh room;
  int sample = 0;
  for (int frame = 1; frame <= static_cast<int>(20.0 * seconds); ++frame) {
    const double t = 0.05 * frame;
    for (; sample <= 10 * frame; ++sample) odometry->AddSample(carried.Measured(sample / 200.0));
    const auto seen = [&](const CameraCalibration& by) {
      return painted.Seen(by, carried.At(t) * by.body_T_camera);
    };
    const ImageLoad load_right = [&]() -> absl::StatusOr<Image> { return seen(rig.right()); };
    auto image = (*eye)->FrameOf(std::llround(1e9 * t), seen(rig.left), load_right, {});
    EXPECT_TRUE(image.ok()) << image.status();
    const auto poses = odometry->AddFrame(*image);
    EXPECT_TRUE(poses.ok()) << poses.status();
    if (poses->empty() || !poses->back().is_keyframe) continue;
    const OdometryPose& pose = poses->back();
    EXPECT_TRUE(mesh->Add(pose.time_ns, pose.map_T_body * camera.body_T_camera,
                          odometry->landmarks(), image->mask)
                    .ok());
    Compare(*mesh, carried.At(t) * pose.map_T_body.Inverse(), &room);
  }
  return room;
}

double RootMeanSquare(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

TEST(RoomMesh, LiesOnTheWallsOfAPaintedRoom) {
  const RoomMesh room = MeshOfRoom(6.0);
  ASSERT_GT(room.keyframe_count, 8);
  EXPECT_GT(room.least_triangles, 50u);
  const double vertex_m = RootMeanSquare(room.vertex_errors_m);
  const double middle_m = RootMeanSquare(room.middle_errors_m);
  std::cout << "room: " << room.keyframe_count << " keyframes, " << room.last.vertices_odom.size()
            << " vertices and " << room.last.faces.size() << " triangles at the end, RMSE of "
            << "vertices " << vertex_m << " m, of middles " << middle_m << " m\n";
  EXPECT_LT(vertex_m, 0.10);
  EXPECT_LT(middle_m, 0.10);
}

TEST(RoomMesh, IsTheSameTwice) {
  const RoomMesh a = MeshOfRoom(3.0);
  const RoomMesh b = MeshOfRoom(3.0);
  EXPECT_GT(a.last.faces.size(), 50u);
  EXPECT_EQ(a.last.feature_ids, b.last.feature_ids);
  EXPECT_EQ(a.last.faces, b.last.faces);
  EXPECT_TRUE(a.last.vertices_odom == b.last.vertices_odom);
}

}  // namespace
}  // namespace dsg::ingest
