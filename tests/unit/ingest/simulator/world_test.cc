// SPDX-License-Identifier: Apache-2.0
// What every generated world promises, over many seeds.
#include "ingest/simulator/world.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kSeedCount = 25;

Box3d BoxOf(const Furniture& item) {
  const Rect footprint = item.Footprint();
  const double half = 0.5 * item.size.z();
  return Box3d(Eigen::Vector3d(footprint.min().x(), footprint.min().y(), item.center.z() - half),
               Eigen::Vector3d(footprint.max().x(), footprint.max().y(), item.center.z() + half));
}

class Worlds : public testing::TestWithParam<WorldKind> {
 protected:
  void ForEachWorld(const std::function<void(const World&)>& check) {
    for (uint64_t seed = 1; seed <= kSeedCount; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed);
      const auto world = GenerateWorld({GetParam(), seed});
      ASSERT_TRUE(world.ok()) << world.status();
      check(*world);
    }
  }
};

TEST_P(Worlds, CellsTileTheBuilding) {
  ForEachWorld([](const World& world) {
    double area = 0.0;
    for (const Room& room : world.plan.rooms) {
      area += room.cell.volume();
      for (const Room& other : world.plan.rooms) {
        if (&other == &room) continue;
        const Rect shared = room.cell.intersection(other.cell);
        EXPECT_TRUE(shared.isEmpty() || shared.volume() < 1e-9);
      }
    }
    EXPECT_NEAR(area, world.Bounds().volume(), 1e-6);
  });
}

TEST_P(Worlds, NamesAreUnique) {
  ForEachWorld([](const World& world) {
    std::set<std::string> names;
    for (const Room& room : world.plan.rooms) EXPECT_TRUE(names.insert(room.name).second);
    names.clear();
    for (const Furniture& item : world.furniture) EXPECT_TRUE(names.insert(item.name).second);
  });
}

TEST_P(Worlds, FurnitureStandsAndDoesNotOverlap) {
  ForEachWorld([](const World& world) {
    EXPECT_GT(world.furniture.size(), 2 * world.plan.rooms.size());
    for (size_t i = 0; i < world.furniture.size(); ++i) {
      const Furniture& item = world.furniture[i];
      const Box3d box = BoxOf(item);
      const double base =
          item.on < 0 ? 0.0 : BoxOf(world.furniture[static_cast<size_t>(item.on)]).max().z();
      EXPECT_NEAR(box.min().z(), base, 1e-12) << item.name;
      EXPECT_LT(box.max().z(), world.plan.ceiling_m);
      EXPECT_TRUE(
          world.plan.rooms[static_cast<size_t>(item.room)].Interior().contains(item.Footprint()))
          << item.name;
      if (item.on >= 0) {
        const Furniture& under = world.furniture[static_cast<size_t>(item.on)];
        EXPECT_TRUE(under.Footprint().contains(item.Footprint())) << item.name;
      }
      for (size_t j = 0; j < i; ++j) {
        const Box3d shared = box.intersection(BoxOf(world.furniture[j]));
        EXPECT_TRUE(shared.isEmpty() || shared.volume() < 1e-12)
            << item.name << " and " << world.furniture[j].name;
      }
    }
  });
}

TEST_P(Worlds, PlacesAndTheirEdgesKeepClear) {
  ForEachWorld([](const World& world) {
    for (const Place& place : world.places.places) {
      EXPECT_DOUBLE_EQ(place.clearance_m, world.free_space.Clearance(place.position));
      EXPECT_GE(place.clearance_m, kWalkClearanceM);
      const Room& room = world.plan.rooms[static_cast<size_t>(place.room)];
      if (place.door < 0) {
        EXPECT_TRUE(room.Interior().contains(place.position));
      }
    }
    for (const PlaceEdge& edge : world.places.edges) {
      const Point& from = world.places.places[static_cast<size_t>(edge.from)].position;
      const Point& to = world.places.places[static_cast<size_t>(edge.to)].position;
      EXPECT_LT(edge.from, edge.to);
      EXPECT_GE(edge.clearance_m, kWalkClearanceM);
      EXPECT_DOUBLE_EQ(edge.clearance_m, world.free_space.SegmentClearance(from, to));
    }
  });
}

TEST_P(Worlds, EveryRoomAndDoorIsReachableOverPlaces) {
  ForEachWorld([](const World& world) {
    const auto neighbours = world.places.Neighbours();
    std::vector<bool> reached(neighbours.size(), false);
    std::vector<int> open = {0};
    reached[0] = true;
    while (!open.empty()) {
      const int current = open.back();
      open.pop_back();
      for (const int next : neighbours[static_cast<size_t>(current)]) {
        if (reached[static_cast<size_t>(next)]) continue;
        reached[static_cast<size_t>(next)] = true;
        open.push_back(next);
      }
    }
    std::set<int> rooms;
    std::set<int> doors;
    for (size_t i = 0; i < reached.size(); ++i) {
      EXPECT_TRUE(reached[i]) << "place " << i;
      const Place& place = world.places.places[i];
      if (place.door < 0) rooms.insert(place.room);
      if (place.door >= 0) doors.insert(place.door);
    }
    EXPECT_EQ(rooms.size(), world.plan.rooms.size());
    EXPECT_EQ(doors.size(), world.plan.doors.size());
  });
}

TEST_P(Worlds, WallsCloseAllButTheDoors) {
  ForEachWorld([](const World& world) {
    FreeSpace walls;
    for (const Structure& part : world.plan.structures) {
      if (part.IsObstacle()) walls.Add(part.rect);
    }
    // Walk along every wall: covered, unless in a doorway.
    for (const Room& room : world.plan.rooms) {
      for (double x = room.cell.min().x(); x <= room.cell.max().x(); x += 0.05) {
        for (const double y : {room.cell.min().y() + 0.01, room.cell.max().y() - 0.01}) {
          const Point point(x, y);
          bool in_door = false;
          for (const Door& door : world.plan.doors) in_door |= door.Opening().contains(point);
          EXPECT_TRUE(in_door || walls.Clearance(point) < 1e-9) << room.name << " at " << x;
        }
      }
      for (double y = room.cell.min().y(); y <= room.cell.max().y(); y += 0.05) {
        for (const double x : {room.cell.min().x() + 0.01, room.cell.max().x() - 0.01}) {
          EXPECT_LT(walls.Clearance(Point(x, y)), 1e-9) << room.name << " at " << y;
        }
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Kinds, Worlds, testing::Values(WorldKind::kOffice, WorldKind::kApartment),
                         [](const auto& param) {
                           return param.param == WorldKind::kOffice ? "Office" : "Apartment";
                         });

TEST(World, DiffersBetweenSeeds) {
  const auto one = GenerateWorld({WorldKind::kOffice, 1});
  const auto two = GenerateWorld({WorldKind::kOffice, 2});
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_NE(one->Bounds().max().x(), two->Bounds().max().x());
}

}  // namespace
}  // namespace dsg::simulator
