// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/engine/planning/random_places.h"

#include <algorithm>
#include <limits>

namespace dsg::test {
namespace {

constexpr double kSideM = 12.0;
constexpr double kRoomM = 4.0;
constexpr TimeNs kTimes = 10;

Interval RandomInterval(Random* random) {
  if (random->Chance(0.6)) return {};
  const TimeNs from_ns = random->Integer(0, static_cast<int>(kTimes));
  if (random->Chance(0.5)) return {from_ns, kTimeMax};
  return {from_ns, from_ns + random->Integer(1, static_cast<int>(kTimes))};
}

query::PlaceGraph::Place RandomPlace(uint64_t number, Random* random) {
  query::PlaceGraph::Place place;
  place.id = NodeId('p', number);
  place.position_map = {random->Uniform(0.0, kSideM), random->Uniform(0.0, kSideM),
                        3.0 * random->Index(2)};
  place.clearance_m = random->Uniform(0.2, 1.0);
  place.valid = RandomInterval(random);
  if (random->Chance(0.9)) {
    const int x = static_cast<int>(place.position_map.x() / kRoomM);
    const int y = static_cast<int>(place.position_map.y() / kRoomM);
    const int storey = place.position_map.z() > 1.0 ? 1 : 0;
    place.room = NodeId('R', static_cast<uint64_t>(storey * 100 + y * 10 + x));
  }
  return place;
}

}  // namespace

RandomPlaces RandomPlaces::Make(Random* random) {
  RandomPlaces world;
  const int count = random->Integer(2, 60);
  uint64_t number = 0;
  for (int i = 0; i < count; ++i) {
    number += static_cast<uint64_t>(random->Integer(1, 3));
    world.places.push_back(RandomPlace(number, random));
  }
  const double reach_m = random->Uniform(1.5, 5.0);
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      const auto& first = world.places[static_cast<size_t>(a)];
      const auto& second = world.places[static_cast<size_t>(b)];
      if ((first.position_map - second.position_map).norm() > reach_m) continue;
      const int parallel_count = random->Chance(0.1) ? 2 : 1;
      for (int i = 0; i < parallel_count; ++i) {
        query::PlaceGraph::Passage passage{first.id, second.id, random->Uniform(0.1, 1.0),
                                           RandomInterval(random)};
        if (random->Chance(0.5)) std::swap(passage.source, passage.target);
        world.passages.push_back(passage);
      }
    }
  }
  return world;
}

RandomPlaces RandomPlaces::Shuffled(Random* random) const {
  RandomPlaces other = *this;
  for (size_t i = other.places.size(); i > 1; --i) {
    std::swap(other.places[i - 1],
              other.places[static_cast<size_t>(random->Index(static_cast<int>(i)))]);
  }
  for (size_t i = other.passages.size(); i > 1; --i) {
    std::swap(other.passages[i - 1],
              other.passages[static_cast<size_t>(random->Index(static_cast<int>(i)))]);
  }
  return other;
}

query::Limits RandomLimits(const RandomPlaces& world, Random* random) {
  query::Limits limits;
  if (random->Chance(0.7)) limits.radius_m = random->Uniform(0.0, 0.5);
  if (random->Chance(0.5)) limits.at_ns = random->Integer(0, static_cast<int>(kTimes));
  if (random->Chance(0.5)) {
    for (size_t i = 0; i < world.places.size(); ++i) {
      limits.blocked.push_back(random->Chance(0.1) ? 1 : 0);
    }
  }
  return limits;
}

std::vector<query::Anchor> RandomAnchors(const RandomPlaces& world, Random* random) {
  std::vector<query::Anchor> anchors;
  const int count = random->Chance(0.1) ? 8 : random->Integer(1, 4);
  for (int i = 0; i < count; ++i) {
    query::Anchor anchor;
    anchor.place = random->Index(static_cast<int>(world.places.size()));
    if (random->Chance(0.5)) anchor.way_m = random->Uniform(0.0, 2.0);
    anchor.node = NodeId('O', static_cast<uint64_t>(i));
    anchors.push_back(anchor);
  }
  query::SortAnchors(&anchors);
  return anchors;
}

std::optional<double> NaiveWay(const RandomPlaces& world, const query::Limits& limits,
                               const std::vector<query::Anchor>& from,
                               const std::vector<query::Anchor>& to) {
  const auto index_of = [&](NodeId id) {
    const auto found = std::find_if(world.places.begin(), world.places.end(),
                                    [id](const auto& place) { return place.id == id; });
    return static_cast<size_t>(found - world.places.begin());
  };
  const auto admits = [&](size_t place) {
    return world.places[place].clearance_m >= limits.radius_m &&
           world.places[place].valid.Contains(limits.at_ns) &&
           (limits.blocked.empty() || limits.blocked[place] == 0);
  };
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<double> way_m(world.places.size(), kFar);
  for (const query::Anchor& anchor : from) {
    const size_t place = static_cast<size_t>(anchor.place);
    if (admits(place)) way_m[place] = std::min(way_m[place], anchor.way_m);
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& passage : world.passages) {
      const size_t a = index_of(passage.source);
      const size_t b = index_of(passage.target);
      if (!admits(a) || !admits(b) || !passage.valid.Contains(limits.at_ns)) continue;
      // As narrow as the graph keeps it.
      if (static_cast<float>(passage.weight_m) < static_cast<float>(limits.radius_m)) continue;
      const double length_m = (world.places[a].position_map - world.places[b].position_map).norm();
      if (way_m[a] + length_m < way_m[b]) way_m[b] = way_m[a] + length_m, changed = true;
      if (way_m[b] + length_m < way_m[a]) way_m[a] = way_m[b] + length_m, changed = true;
    }
  }
  double best_m = kFar;
  for (const query::Anchor& anchor : to) {
    best_m = std::min(best_m, way_m[static_cast<size_t>(anchor.place)] + anchor.way_m);
  }
  return best_m == kFar ? std::nullopt : std::optional<double>(best_m);
}

}  // namespace dsg::test
