// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/world.h"

#include "absl/strings/str_cat.h"
#include "ingest/simulator/world/catalogue.h"
#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

// Streams of the world's seed; walkers take theirs from another range (walker.cc).
constexpr uint64_t kPlanStream = 1;
constexpr uint64_t kFurnitureStream = 2;
constexpr uint64_t kDecorationStream = 3;

// People need somewhere to go in each room, and a way through each door.
absl::Status CheckReachable(const World& world, uint64_t seed) {
  std::vector<int> place_count(world.plan.rooms.size(), 0);
  size_t door_count = 0;
  for (const Place& place : world.places.places) {
    if (place.door < 0) ++place_count[place.room];
    if (place.door >= 0) ++door_count;
  }
  for (size_t i = 0; i < place_count.size(); ++i) {
    if (place_count[i] > 0) continue;
    return absl::InternalError(absl::StrCat("the world of seed ", seed, " has no way into room \"",
                                            world.plan.rooms[i].name, "\"; take another seed"));
  }
  if (door_count == world.plan.doors.size()) return absl::OkStatus();
  return absl::InternalError(
      absl::StrCat("the world of seed ", seed, " has a blocked door; take another seed"));
}

}  // namespace

Rect World::Bounds() const {
  Rect bounds;
  for (const Room& room : plan.rooms) bounds.extend(room.cell);
  return bounds;
}

absl::StatusOr<World> GenerateWorld(const WorldOptions& options) {
  Random plan_random(options.seed, kPlanStream);
  Random furniture_random(options.seed, kFurnitureStream);
  Random decoration_random(options.seed, kDecorationStream);
  World world;
  world.kind = options.kind;
  world.plan = options.kind == WorldKind::kOffice
                   ? DrawOfficePlan(&plan_random)
                   : DrawSpinePlan(PlanSpecOf(options.kind), &plan_random);
  world.furniture = Furnish(world.plan, &furniture_random);
  Decorate(world.plan, &decoration_random, &world.furniture);
  NameFurniture(&world.furniture);
  world.free_space = FreeSpaceOf(world.plan, world.furniture);
  world.places = BuildPlaceGraph(world.plan, world.free_space);
  const absl::Status reachable = CheckReachable(world, options.seed);
  if (!reachable.ok()) return reachable;
  return world;
}

}  // namespace dsg::simulator
