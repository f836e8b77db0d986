// SPDX-License-Identifier: Apache-2.0
// Furniture of made rooms without labels: one object each, and nothing of the room itself.
#include "ingest/objects/unlabelled_objects.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "ingest/objects/object_matching.h"

namespace dsg::ingest {
namespace {

constexpr double kVoxelM = 0.05;
constexpr double kStepM = 0.025;
constexpr double kCeilingM = 2.5;
constexpr int32_t kThing = 1;

using Eigen::Vector3d;

/// The surface of a room of 5 m by 4 m, of vertices with normals.
class MadeRoom {
 public:
  MadeRoom() {
    AddFace({0, 0, 0}, {5, 0, 0}, {0, 4, 0}, {0, 0, 1});
    AddFace({0, 0, kCeilingM}, {5, 0, 0}, {0, 4, 0}, {0, 0, -1});
    AddFace({0, 0, 0}, {5, 0, 0}, {0, 0, kCeilingM}, {0, 1, 0});
    AddFace({0, 4, 0}, {5, 0, 0}, {0, 0, kCeilingM}, {0, -1, 0});
    AddFace({0, 0, 0}, {0, 4, 0}, {0, 0, kCeilingM}, {1, 0, 0});
    AddFace({5, 0, 0}, {0, 4, 0}, {0, 0, kCeilingM}, {-1, 0, 0});
  }

  /// All sides but the lower one, as cameras see them; what is behind other boxes too.
  void AddBox(const Vector3d& low, const Vector3d& high) {
    const Vector3d size = high - low;
    const Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
    AddFace(low + z, x, y, {0, 0, 1});
    AddFace(low, x, z, {0, -1, 0});
    AddFace(low + y, x, z, {0, 1, 0});
    AddFace(low, y, z, {-1, 0, 0});
    AddFace(low + x, y, z, {1, 0, 0});
  }

  // Seat, back and two arms.
  void AddSofa(double x, double y) {
    AddBox({x, y, 0}, {x + 1.8, y + 0.8, 0.42});
    AddBox({x, y + 0.6, 0.42}, {x + 1.8, y + 0.8, 0.85});
    AddBox({x, y, 0.42}, {x + 0.18, y + 0.6, 0.6});
    AddBox({x + 1.62, y, 0.42}, {x + 1.8, y + 0.6, 0.6});
  }

  void AddTable(double x, double y) {
    AddBox({x, y, 0.7}, {x + 1.2, y + 0.7, 0.75});
    for (const double leg_x : {x + 0.02, x + 1.12}) {
      for (const double leg_y : {y + 0.02, y + 0.62}) {
        AddBox({leg_x, leg_y, 0}, {leg_x + 0.06, leg_y + 0.06, 0.7});
      }
    }
  }

  void AddChair(double x, double y) {
    AddBox({x, y, 0.4}, {x + 0.42, y + 0.42, 0.46});
    AddBox({x, y + 0.38, 0.46}, {x + 0.42, y + 0.42, 0.9});
    for (const double leg_x : {x, x + 0.37}) {
      for (const double leg_y : {y, y + 0.37}) {
        AddBox({leg_x, leg_y, 0}, {leg_x + 0.05, leg_y + 0.05, 0.4});
      }
    }
  }

  void AddFace(const Vector3d& corner, const Vector3d& u, const Vector3d& v,
               const Vector3d& normal) {
    const int columns = static_cast<int>(std::ceil(u.norm() / kStepM));
    const int rows = static_cast<int>(std::ceil(v.norm() / kStepM));
    for (int i = 0; i <= columns; ++i) {
      for (int j = 0; j <= rows; ++j) {
        const Vector3d point = corner + u * i / columns + v * j / rows;
        mesh_.positions_map.push_back(point.cast<float>());
        mesh_.normals_map.push_back(normal.cast<float>());
        mesh_.colors.push_back(0x808080);
      }
    }
  }

  const MeshBlock& mesh() const { return mesh_; }
  MeshBlock* mutable_mesh() { return &mesh_; }

 private:
  MeshBlock mesh_;
};

std::vector<ObjectCluster> Find(const MadeRoom& room, const SegmentOptions& options = {}) {
  return FindUnlabelledObjects({&room.mesh()}, kThing, kVoxelM, {}, options);
}

double OverlapOf(const Box3d& a, const Box3d& b) {
  const Box3d both = a.intersection(b);
  if (both.isEmpty()) return 0.0;
  return both.volume() / (a.volume() + b.volume() - both.volume());
}

/// Each box has an object of its own that covers it, and there is no other object.
void ExpectObjects(const std::vector<ObjectCluster>& found, const std::vector<Box3d>& boxes) {
  for (const Box3d& box : boxes) {
    const auto count = std::count_if(found.begin(), found.end(), [&](const ObjectCluster& one) {
      return OverlapOf(AxisAlignedBox(one), box) > 0.7;
    });
    EXPECT_EQ(count, 1) << "of the box from " << box.min().transpose() << " to "
                        << box.max().transpose();
  }
  EXPECT_EQ(found.size(), boxes.size());
  for (const ObjectCluster& one : found) {
    EXPECT_EQ(one.class_id, kThing);
    if (found.size() == boxes.size()) continue;
    ADD_FAILURE() << "an object of " << one.size.transpose() << " m at "
                  << one.center_map.transpose();
  }
}

TEST(UnlabelledObjects, AnEmptyRoomHasNone) { ExpectObjects(Find(MadeRoom()), {}); }

TEST(UnlabelledObjects, FurnitureIsOneObjectEach) {
  MadeRoom room;
  room.AddSofa(0.4, 3.1);
  room.AddTable(2.0, 1.2);
  room.AddChair(2.4, 0.3);
  room.AddBox({4.4, 2.0, 0}, {5, 3.2, 1.9});
  ExpectObjects(Find(room), {Box3d(Vector3d(0.4, 3.1, 0), Vector3d(2.2, 3.9, 0.85)),
                             Box3d(Vector3d(2.0, 1.2, 0), Vector3d(3.2, 1.9, 0.75)),
                             Box3d(Vector3d(2.4, 0.3, 0), Vector3d(2.82, 0.72, 0.9)),
                             Box3d(Vector3d(4.4, 2.0, 0), Vector3d(5, 3.2, 1.9))});
}

TEST(UnlabelledObjects, RugsFramesAndPillarsAreNone) {
  MadeRoom room;
  room.AddBox({1, 1, 0}, {3, 3, 0.03});
  // A window's frame, a picture, a skirting, and a pillar.
  room.AddBox({1.0, 3.94, 0.9}, {2.4, 4, 0.98});
  room.AddBox({1.0, 3.94, 1.9}, {2.4, 4, 1.98});
  room.AddBox({0, 1, 1.2}, {0.03, 2, 1.8});
  room.AddBox({0, 0, 0}, {5, 0.04, 0.12});
  room.AddBox({4, 1, 0}, {4.4, 1.4, kCeilingM});
  ExpectObjects(Find(room), {});
}

TEST(UnlabelledObjects, SlopedCeilingsAreNone) {
  MadeRoom room;
  room.AddFace({3.5, 1, 2.5}, {0, 2, 0}, {1.5, 0, -1.2}, {-0.62, 0, -0.78});
  ExpectObjects(Find(room), {});
}

TEST(UnlabelledObjects, AMeshWithoutNormalsWillDo) {
  MadeRoom room;
  room.AddTable(2.0, 1.2);
  room.AddBox({4.4, 2.0, 0}, {5, 3.2, 1.9});
  room.mutable_mesh()->normals_map.clear();
  ExpectObjects(Find(room), {Box3d(Vector3d(2.0, 1.2, 0), Vector3d(3.2, 1.9, 0.75)),
                             Box3d(Vector3d(4.4, 2.0, 0), Vector3d(5, 3.2, 1.9))});
}

TEST(UnlabelledObjects, WhatStandsOnATableIsAnObject) {
  MadeRoom room;
  room.AddTable(2.0, 1.2);
  room.AddBox({2.4, 1.4, 0.75}, {2.8, 1.7, 1.05});
  ExpectObjects(Find(room), {Box3d(Vector3d(2.0, 1.2, 0), Vector3d(3.2, 1.9, 0.75)),
                             Box3d(Vector3d(2.4, 1.4, 0.75), Vector3d(2.8, 1.7, 1.05))});
}

TEST(UnlabelledObjects, AChairAtATableIsItsOwnObject) {
  MadeRoom room;
  room.AddTable(2.0, 1.2);
  room.AddChair(2.4, 1.74);
  ExpectObjects(Find(room), {Box3d(Vector3d(2.0, 1.2, 0), Vector3d(3.2, 1.9, 0.75)),
                             Box3d(Vector3d(2.4, 1.74, 0), Vector3d(2.82, 2.16, 0.9))});
}

TEST(UnlabelledObjects, WhatStandsBeforeAWallIsNoPartOfIt) {
  MadeRoom room;
  room.AddBox({1.5, 3.65, 0}, {2.0, 4, 0.75});
  ExpectObjects(Find(room), {Box3d(Vector3d(1.5, 3.65, 0), Vector3d(2.0, 4, 0.75))});
}

TEST(UnlabelledObjects, WhatHangsOutOfReachIsNone) {
  MadeRoom room;
  room.AddBox({1.5, 1.5, 2.0}, {2.1, 2.1, 2.3});
  SegmentOptions options;
  options.reach_m = 1.9;
  ExpectObjects(Find(room, options), {});
  options.reach_m = 2.3;
  EXPECT_EQ(Find(room, options).size(), 1u);
}

TEST(UnlabelledObjects, ADoorThatStandsOpenIsNone) {
  MadeRoom room;
  room.AddBox({2.0, 1.5, 0}, {2.05, 2.4, 2.0});
  ExpectObjects(Find(room), {});
}

TEST(UnlabelledObjects, AStoolBelowATableIsItsOwnObject) {
  MadeRoom room;
  room.AddTable(2.0, 1.2);
  room.AddBox({2.3, 1.35, 0.4}, {2.7, 1.7, 0.46});
  for (const double x : {2.3, 2.65}) {
    for (const double y : {1.35, 1.65}) room.AddBox({x, y, 0}, {x + 0.05, y + 0.05, 0.4});
  }
  ExpectObjects(Find(room), {Box3d(Vector3d(2.0, 1.2, 0), Vector3d(3.2, 1.9, 0.75)),
                             Box3d(Vector3d(2.3, 1.35, 0), Vector3d(2.7, 1.7, 0.46))});
}

TEST(UnlabelledObjects, NoBoxIsLongerThanAllowed) {
  MadeRoom room;
  // A worktop around a corner, 3.6 m and 2.4 m long.
  room.AddBox({0, 0, 0}, {3.6, 0.6, 0.9});
  room.AddBox({0, 0.6, 0}, {0.6, 3, 0.9});
  SegmentOptions options;
  options.size_max_m = 2.5;
  for (const ObjectCluster& one : Find(room, options)) {
    EXPECT_LE(one.size.maxCoeff(), options.size_max_m);
  }
}

TEST(UnlabelledObjects, TheOrderOfBlocksDoesNotMatter) {
  MadeRoom room;
  room.AddSofa(0.4, 3.1);
  room.AddTable(2.0, 1.2);
  const std::vector<MeshBlock> blocks = SplitIntoBlocks(room.mesh(), 0.8);
  std::vector<const MeshBlock*> pointers;
  for (const MeshBlock& block : blocks) pointers.push_back(&block);
  const auto first = FindUnlabelledObjects(pointers, kThing, kVoxelM, {}, {});
  std::reverse(pointers.begin(), pointers.end());
  const auto second = FindUnlabelledObjects(pointers, kThing, kVoxelM, {}, {});
  ASSERT_EQ(first.size(), second.size());
  for (size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].points_map, second[i].points_map);
    EXPECT_EQ(first[i].size, second[i].size);
  }
}

TEST(UnlabelledObjects, BadMeshesGiveNothing) {
  EXPECT_TRUE(FindUnlabelledObjects({}, kThing, kVoxelM, {}, {}).empty());
  EXPECT_TRUE(FindUnlabelledObjects({nullptr}, kThing, kVoxelM, {}, {}).empty());
  MadeRoom room;
  EXPECT_TRUE(FindUnlabelledObjects({&room.mesh()}, kThing, 0.0, {}, {}).empty());
  MeshBlock* mesh = room.mutable_mesh();
  for (Eigen::Vector3f& point : mesh->positions_map) point.x() = NAN;
  EXPECT_TRUE(FindUnlabelledObjects({mesh}, kThing, kVoxelM, {}, {}).empty());
}

TEST(SegmentOptions, DefaultsAreInRangeAndNamesDiffer) {
  EXPECT_TRUE(SegmentOptions().Validate().ok());
  SegmentOptions options;
  for (const BoundOption& field : options.Bind()) {
    const double before = field.Get();
    field.Set(field.max + 1.0);
    const absl::Status status = options.Validate();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_NE(status.message().find(field.name), std::string::npos);
    EXPECT_FALSE(field.Check(NAN).ok());
    field.Set(before == field.min ? field.max : field.min);
    EXPECT_NE(options.Digest(), SegmentOptions().Digest()) << field.name;
    field.Set(before);
  }
  EXPECT_EQ(options.Digest(), SegmentOptions().Digest());
}

}  // namespace
}  // namespace dsg::ingest
