// SPDX-License-Identifier: Apache-2.0
// What every generated world promises, over many seeds.
#include "ingest/simulator/world/world.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "ingest/simulator/world/catalogue.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {
namespace {

/// The office takes as long as ten of the others.
uint64_t SeedCount(WorldKind kind) { return kind == WorldKind::kOffice ? 12 : 25; }

/// Made once a program.
const World& CachedWorld(WorldKind kind, uint64_t seed) {
  static std::map<std::pair<WorldKind, uint64_t>, World> worlds;
  const auto found = worlds.find({kind, seed});
  if (found != worlds.end()) return found->second;
  auto world = GenerateWorld({kind, seed});
  EXPECT_TRUE(world.ok()) << world.status();
  return worlds.emplace(std::pair(kind, seed), *std::move(world)).first->second;
}

Box3d BoxOf(const Furniture& item) {
  const Rect footprint = item.Footprint();
  const double half = 0.5 * item.size.z();
  return Box3d(Eigen::Vector3d(footprint.min().x(), footprint.min().y(), item.center.z() - half),
               Eigen::Vector3d(footprint.max().x(), footprint.max().y(), item.center.z() + half));
}

class Worlds : public testing::TestWithParam<WorldKind> {
 protected:
  void ForEachWorld(const std::function<void(const World&)>& check) {
    for (uint64_t seed = 1; seed <= SeedCount(GetParam()); ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed);
      check(CachedWorld(GetParam(), seed));
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
      const bool hangs = item.class_name == "whiteboard" || item.class_name == "picture";
      EXPECT_EQ(item.StandsOnFloor(), item.on < 0 && !hangs) << item.name;
      if (!hangs) {
        const double base =
            item.on < 0 ? 0.0 : BoxOf(world.furniture[static_cast<size_t>(item.on)]).max().z();
        EXPECT_NEAR(box.min().z(), base, 1e-12) << item.name;
      }
      EXPECT_LT(box.max().z(), world.plan.rooms[static_cast<size_t>(item.room)].ceiling_m);
      EXPECT_TRUE(
          world.plan.rooms[static_cast<size_t>(item.room)].Interior().contains(item.Footprint()))
          << item.name;
      if (item.on >= 0) {
        const Furniture& under = world.furniture[static_cast<size_t>(item.on)];
        EXPECT_TRUE(under.Footprint().contains(item.Footprint())) << item.name;
      }
      for (size_t j = 0; j < i; ++j) {
        if (world.furniture[j].room != item.room) continue;
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
    std::vector<Rect> solid;
    for (const Structure& part : world.plan.structures) {
      if (part.IsObstacle() && part.type != "pillar") solid.push_back(part.rect);
    }
    const FreeSpace walls(solid);
    const auto is_closed = [&](const Point& point) {
      for (const Door& door : world.plan.doors) {
        if (Inflate(door.Opening(), 1e-6).contains(point)) return true;
      }
      return walls.Clearance(point) < 1e-9;
    };
    // Walk along every wall: covered, unless in a doorway.
    for (const Room& room : world.plan.rooms) {
      for (double x = room.cell.min().x(); x <= room.cell.max().x(); x += 0.05) {
        EXPECT_TRUE(is_closed(Point(x, room.cell.min().y() + 0.01))) << room.name << " at " << x;
        EXPECT_TRUE(is_closed(Point(x, room.cell.max().y() - 0.01))) << room.name << " at " << x;
      }
      for (double y = room.cell.min().y(); y <= room.cell.max().y(); y += 0.05) {
        EXPECT_TRUE(is_closed(Point(room.cell.min().x() + 0.01, y))) << room.name << " at " << y;
        EXPECT_TRUE(is_closed(Point(room.cell.max().x() - 0.01, y))) << room.name << " at " << y;
      }
    }
    // And no wall stands in a doorway.
    for (const Door& door : world.plan.doors) {
      EXPECT_GT(walls.Clearance(door.center), 0.3) << door.room_a << " to " << door.room_b;
    }
  });
}

TEST_P(Worlds, DoorsJoinTwoRoomsOnTheLineBetweenThem) {
  ForEachWorld([](const World& world) {
    for (const Door& door : world.plan.doors) {
      ASSERT_LT(door.room_a, door.room_b);
      const Point step = door.walks_along_y ? Point(0.0, 0.2) : Point(0.2, 0.0);
      const std::set<int> sides = {world.plan.RoomAt(door.center - step),
                                   world.plan.RoomAt(door.center + step)};
      EXPECT_EQ(sides, (std::set<int>{door.room_a, door.room_b}));
      EXPECT_GE(door.width_m, 0.9);
      EXPECT_LE(door.width_m, 2.4);
      if (door.kind == OpeningKind::kDoor) {
        EXPECT_LE(door.width_m, 1.0);
      }
    }
  });
}

TEST_P(Worlds, HaveSoFewPiecesOfAClassThatEightBitsCountThem) {
  ForEachWorld([](const World& world) {
    std::map<std::string, int> count;
    for (const Furniture& item : world.furniture) {
      EXPECT_LE(++count[item.class_name], kPiecesOfClassMax) << item.class_name;
      EXPECT_LT(ClassId(item.class_name), 100);
    }
    // Pieces that people carry.
    EXPECT_GT(count["cup"] + count["book"] + count["bottle"] + count["phone"] + count["laptop"], 1);
    for (const Furniture& item : world.furniture) {
      if (item.class_name != "couch") continue;
      EXPECT_EQ(item.size, Eigen::Vector3d(1.9, 0.85, 0.8));
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Kinds, Worlds,
                         testing::Values(WorldKind::kOffice, WorldKind::kWing,
                                         WorldKind::kApartment),
                         [](const auto& param) { return std::string(Name(param.param)); });

TEST(World, DiffersBetweenSeeds) {
  EXPECT_NE(CachedWorld(WorldKind::kWing, 1).Bounds().max().x(),
            CachedWorld(WorldKind::kWing, 2).Bounds().max().x());
  EXPECT_NE(CachedWorld(WorldKind::kOffice, 1).plan.rooms.front().cell.min(),
            CachedWorld(WorldKind::kOffice, 2).plan.rooms.front().cell.min());
}

TEST(World, ApartmentIsAboutFourteenByTwelveMetresWithFiveRooms) {
  for (uint64_t seed = 1; seed <= 25; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const World& world = CachedWorld(WorldKind::kApartment, seed);
    EXPECT_NEAR(world.Bounds().sizes().x(), 14.0, 0.8);
    EXPECT_NEAR(world.Bounds().sizes().y(), 12.0, 0.6);
    ASSERT_EQ(world.plan.rooms.size(), 6u);
    EXPECT_TRUE(world.plan.rooms.front().is_passage);
  }
}

}  // namespace
}  // namespace dsg::simulator
