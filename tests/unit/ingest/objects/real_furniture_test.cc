// SPDX-License-Identifier: Apache-2.0
// Furniture of two real rooms without labels, measured against instances that people annotated.
#include <gtest/gtest.h>

#include <iostream>

#include "ingest/objects/unlabelled_objects.h"
#include "tests/unit/ingest/objects/aria_apartment.h"
#include "tests/unit/ingest/objects/room_truth.h"

namespace dsg::ingest {
namespace {

// Less than what is reached by about a third, since a few objects more or less are chance.
struct Least {
  double precision = 0.0;
  double recall = 0.0;
};

void ExpectAtLeast(const Least& least, const RealRoom& room) {
  const MeshBlock plain = WithoutLabels(room.mesh);
  const auto objects = FindUnlabelledObjects({&plain}, 1, kTruthCellM, {}, {});
  for (const ObjectCluster& object : objects) EXPECT_LE(object.size.maxCoeff(), 3.0);
  const InstanceScore all = ScoreInstances(objects, room);
  const InstanceScore score = ScoreInstances(objects, OnlyFurniture(room));
  std::cout << score.object_count << " objects, " << score.right_count << " of them among "
            << score.truth_count << " pieces of furniture; " << all.right_count << " of "
            << all.object_count << " among all " << all.truth_count << " instances\n";
  EXPECT_GE(score.Precision(), least.precision);
  EXPECT_GE(score.Recall(), least.recall);
}

TEST(RealFurniture, OfScannet) {
  const auto room = ReadScannetRoom(DataFolder() / "scannet-scene0000");
  if (!room.has_value()) GTEST_SKIP() << "no scannet-scene0000 in " << DataFolder();
  ASSERT_EQ(room->mesh.labels.size(), 81369u);
  ExpectAtLeast({0.28, 0.17}, *room);
}

TEST(RealFurniture, OfTheDigitalTwin) {
  const auto room = ReadAriaApartment(DataFolder() / "adt-apartment");
  if (!room.has_value()) GTEST_SKIP() << "no adt-apartment in " << DataFolder();
  ASSERT_GT(room->mesh.labels.size(), 100000u);
  ExpectAtLeast({0.25, 0.15}, *room);
}

TEST(RealFurniture, OfTheDigitalTwinFused) {
  const auto room = FuseAriaApartment(DataFolder() / "adt-apartment");
  if (!room.has_value()) GTEST_SKIP() << "no adt-apartment in " << DataFolder();
  ASSERT_GT(room->mesh.labels.size(), 10000u);
  ExpectAtLeast({0.25, 0.2}, *room);
}

}  // namespace
}  // namespace dsg::ingest
