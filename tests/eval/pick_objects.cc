// SPDX-License-Identifier: Apache-2.0
#include "tests/eval/pick_objects.h"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

#include "ingest/simulator/body/errand_board.h"
#include "ingest/simulator/body/life.h"
#include "ingest/simulator/world/catalogue.h"

namespace dsg::eval {
namespace {

constexpr uint64_t kSpotStream = 720;
constexpr uint64_t kMapStream = 721;
// Above the ids of the world's furniture.
constexpr uint64_t kFirstId = 10000;
constexpr double kHalfSizeMinM = 0.02;

}  // namespace

ObjectSensor::ObjectSensor(const simulator::World& world, const simulator::CrowdMotion& crowd,
                           const PickSensorModel& sensor, double duration_s, uint64_t seed)
    : world_(world),
      sensor_(sensor),
      end_ns_(simulator::NsOf(duration_s)),
      random_(seed, kMapStream) {
  Random random(seed, kSpotStream);
  for (size_t i = 0; i < world.furniture.size(); ++i) {
    const simulator::Furniture& item = world.furniture[i];
    if (item.on < 0) continue;
    Spot first;
    first.furniture = static_cast<int>(i);
    first.room = item.room;
    first.at_map = item.center;
    Spot second = first;
    for (size_t p = 0; p < crowd.picks().size(); ++p) {
      const simulator::PickEvent& pick = crowd.picks()[p];
      if (pick.object != first.furniture) continue;
      first.there.to_ns = pick.pick_ns;
      first.taken_by = static_cast<int>(p);
      if (pick.place_ns == kTimeMax) continue;
      second.at_map = pick.map_T_object_after.position;
      second.room = world.plan.RoomAt(second.at_map.head<2>());
      second.there.from_ns = pick.place_ns;
      second.put_by = static_cast<int>(p);
    }
    AddSpot(first, &random);
    AddTwin(first, &random);
    if (second.put_by >= 0) AddSpot(second, &random);
  }
}

void ObjectSensor::AddSpot(Spot spot, Random* random) {
  spot.is_never_mapped = random->Chance(sensor_.never_mapped_probability);
  if (random->Chance(sensor_.false_change_probability)) {
    spot.false_end_ns = static_cast<TimeNs>(random->Uniform() * static_cast<double>(end_ns_));
  }
  spot.is_reappearing = random->Chance(sensor_.reappear_probability);
  spots_.push_back(std::move(spot));
}

void ObjectSensor::AddTwin(const Spot& spot, Random* random) {
  const bool has_twin = random->Chance(sensor_.twin_probability);
  const double away_m = random->Uniform(sensor_.twin_m_min, sensor_.twin_m_max);
  const double angle = random->Uniform(0.0, 2.0 * std::numbers::pi);
  if (!has_twin) return;
  Spot twin = spot;
  twin.there = Interval();
  twin.taken_by = twin.put_by = -1;
  twin.at_map += away_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
  AddSpot(std::move(twin), random);
}

void ObjectSensor::Look(TimeNs at_ns, const Cameras& cameras, const std::vector<Blocker>& bodies) {
  for (Spot& spot : spots_) {
    if (spot.is_never_mapped || spot.is_over) continue;
    if (!cameras.Sees(spot.room, spot.at_map, sensor_.object_range_m, bodies, -1)) continue;
    const bool is_false = spot.mapped >= 0 && at_ns >= spot.false_end_ns;
    const bool is_there = spot.there.Contains(at_ns);
    See(at_ns, is_there && !is_false, is_there && is_false, &spot);
  }
}

void ObjectSensor::See(TimeNs at_ns, bool is_present, bool is_false, Spot* spot) {
  if (is_present) {
    ++spot->present_count;
    spot->absent_run = 0;
    if (spot->mapped < 0 && spot->present_count >= sensor_.present_count_min) Map(at_ns, spot);
    if (spot->mapped < 0) return;
    Node& node = mapped_[spot->mapped].node;
    node.last_observed_ns = std::max(at_ns, node.valid.from_ns);
    ++node.observation_count;
    return;
  }
  if (spot->mapped < 0 || at_ns < mapped_[spot->mapped].node.valid.from_ns) return;
  if (spot->absent_run++ == 0) spot->first_absent_ns = at_ns;
  if (spot->absent_run >= sensor_.absent_count_min) End(is_false, spot);
}

// Told at the mapper's next update, also if it is gone by then.
void ObjectSensor::Map(TimeNs at_ns, Spot* spot) {
  const simulator::Furniture& item = world_.furniture[static_cast<size_t>(spot->furniture)];
  spot->mapped = static_cast<int>(mapped_.size());
  MappedObject object;
  object.room = spot->room;
  object.truth.put_by = spot->put_by;
  Node& node = object.node;
  node.id = NodeId('O', kFirstId + mapped_.size());
  node.layer = layers::kObjects;
  node.kind = kinds::kObject;
  node.class_id = simulator::ClassId(item.class_name);
  node.class_name = item.class_name;
  node.name = item.class_name + " " + std::to_string(mapped_.size());
  node.map_T_node = simulator::InitialPose(item);
  node.map_T_node.position = spot->at_map;
  Eigen::Vector3d half;
  for (int axis = 0; axis < 3; ++axis) {
    node.map_T_node.position[axis] += sensor_.object_sigma_m * random_.Normal();
    const double factor = random_.Uniform(sensor_.size_factor_min, sensor_.size_factor_max);
    half[axis] = std::max(kHalfSizeMinM, 0.5 * factor * item.size[axis]);
  }
  node.box_node = Box3d(-half, half);
  node.object.emplace();
  node.object->size = 2.0 * half;
  node.valid.from_ns = (at_ns / sensor_.update_ns + 1) * sensor_.update_ns;
  node.first_observed_ns = node.valid.from_ns;
  node.last_observed_ns = node.valid.from_ns;
  mapped_.push_back(std::move(object));
}

void ObjectSensor::End(bool is_false, Spot* spot) {
  MappedObject& object = mapped_[spot->mapped];
  object.node.valid.to_ns = std::max(spot->first_absent_ns, *object.node.last_observed_ns + 1);
  object.truth.has_false_end = is_false;
  if (!is_false) object.truth.taken_by = spot->taken_by;
  spot->is_over = !is_false || !spot->is_reappearing;
  spot->mapped = -1;
  spot->present_count = 0;
  spot->absent_run = 0;
  spot->false_end_ns = kTimeMax;
  spot->put_by = -1;
}

std::vector<MappedObject> ObjectSensor::Finish() {
  // Mapped after the end: never told.
  std::erase_if(mapped_,
                [&](const MappedObject& object) { return object.node.valid.from_ns >= end_ns_; });
  return std::move(mapped_);
}

}  // namespace dsg::eval
