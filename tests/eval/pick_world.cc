// SPDX-License-Identifier: Apache-2.0
#include "tests/eval/pick_world.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/contact_edges.h"
#include "ingest/presence/region_index.h"
#include "ingest/presence/stay_tracker.h"
#include "ingest/simulator/body/life.h"
#include "ingest/simulator/world/world_graph.h"
#include "schema/base/status.h"
#include "tests/eval/pick_cameras.h"
#include "tests/eval/pick_objects.h"
#include "tests/eval/pick_people.h"

namespace dsg::eval {
namespace {

using simulator::CrowdMotion;
using simulator::RobotMotion;
using simulator::World;

constexpr NodeId kRobot('r', 0);
constexpr TimeNs kGapNs = 2 * kNsPerSecond;
// As high as a robot looks for the free floor.
constexpr double kPlaceLookM = 0.3;
constexpr double kPlaceRangeM = 8.0;

// Everything of one world while it is watched.
struct Stage {
  const PickWorldOptions& options;
  const World& world;
  const CrowdMotion& crowd;
  /// Null unless the tier has one.
  const RobotMotion* robot;
};

std::unique_ptr<RobotMotion> MakeRobot(const World& world, const PickWorldOptions& options) {
  if (options.tier != Tier::kRobot) return nullptr;
  return RobotMotion::Make(world, {.duration_s = options.duration_s}, options.world.seed);
}

// With a robot about, people are where it is more often than elsewhere, as in simulated logs.
std::unique_ptr<CrowdMotion> MakePeople(const World& world, const RobotMotion* robot,
                                        const PickWorldOptions& options) {
  simulator::CrowdMotionOptions people;
  people.people_count = options.people_count;
  people.duration_s = options.duration_s;
  people.meet_share = std::min(0.8, 4.0 / std::max(1, options.people_count));
  if (robot != nullptr) {
    people.robot_at = [robot](TimeNs time_ns) -> simulator::Point {
      const TimeNs until_ns = std::min(time_ns, robot->duration_ns());
      return robot->StateAt(until_ns).map_T_body.position.head<2>();
    };
  }
  return CrowdMotion::Make(&world, people, options.world.seed);
}

// Small things are the mapper's to find.
void DropSmallThings(const World& world, GraphDelta* delta) {
  std::set<NodeId> small;
  for (size_t i = 0; i < world.furniture.size(); ++i) {
    if (world.furniture[i].on >= 0) small.insert(simulator::ObjectId(static_cast<int>(i)));
  }
  std::erase_if(delta->nodes, [&](const Node& node) { return small.contains(node.id); });
  std::erase_if(delta->edges, [&](const Edge& edge) {
    return small.contains(edge.source) || small.contains(edge.target);
  });
}

// Places are in the map from the first update after a camera saw them.
class PlaceClock {
 public:
  explicit PlaceClock(const Stage& stage)
      : stage_(stage), seen_ns_(stage.world.places.places.size(), kTimeMax) {}

  void Look(TimeNs at_ns, const Cameras& cameras) {
    for (size_t i = 0; i < seen_ns_.size(); ++i) {
      if (seen_ns_[i] != kTimeMax) continue;
      const simulator::Place& place = stage_.world.places.places[i];
      const Eigen::Vector3d at(place.position.x(), place.position.y(), kPlaceLookM);
      if (cameras.Sees(place.room, at, kPlaceRangeM, {}, -1)) seen_ns_[i] = at_ns;
    }
  }

  void Apply(GraphDelta* delta) const {
    for (size_t i = 0; i < seen_ns_.size(); ++i) {
      if (seen_ns_[i] == kTimeMax) continue;
      const NodeId id = simulator::PlaceId(static_cast<int>(i));
      const auto node = std::find_if(delta->nodes.begin(), delta->nodes.end(),
                                     [&](const Node& other) { return other.id == id; });
      const TimeNs update_ns = stage_.options.sensor.update_ns;
      node->valid.from_ns = seen_ns_[i] == 0 ? 0 : (seen_ns_[i] / update_ns + 1) * update_ns;
    }
  }

 private:
  const Stage& stage_;
  std::vector<TimeNs> seen_ns_;
};

NodeId NearestPlace(const World& world, int room, const Eigen::Vector3d& at_map) {
  int best = -1;
  double best_m = 0.0;
  for (size_t i = 0; i < world.places.places.size(); ++i) {
    const simulator::Place& place = world.places.places[i];
    const double distance_m = (place.position - at_map.head<2>()).norm();
    if (place.room != room || (best >= 0 && distance_m >= best_m)) continue;
    best = static_cast<int>(i);
    best_m = distance_m;
  }
  return best < 0 ? NodeId() : simulator::PlaceId(best);
}

void AddObjects(const World& world, std::vector<MappedObject> objects, PickWorld* out) {
  for (MappedObject& object : objects) {
    out->objects.emplace(object.node.id, object.truth);
    const NodeId place = NearestPlace(world, object.room, object.node.map_T_node.position);
    if (!place.empty()) {
      Edge edge{place, relations::kContains, object.node.id};
      edge.valid = object.node.valid;
      out->delta.edges.push_back(edge);
    }
    out->delta.nodes.push_back(std::move(object.node));
  }
}

ingest::RegionIndex Regions(const World& world, const GraphDelta& delta) {
  std::vector<Node> rooms, places;
  for (const Node& node : delta.nodes) {
    if (node.layer == layers::kRooms) rooms.push_back(node);
    if (node.layer == layers::kPlaces) places.push_back(node);
  }
  std::vector<ingest::RegionIndex::Containment> contains;
  for (size_t i = 0; i < world.places.places.size(); ++i) {
    contains.push_back(
        {simulator::RoomId(world.places.places[i].room), simulator::PlaceId(static_cast<int>(i))});
  }
  return ingest::RegionIndex(std::move(rooms), std::move(places), contains);
}

void AddTracks(const World& world, const std::vector<PersonTrack>& tracks, PickWorld* out) {
  GraphDelta& delta = out->delta;
  ingest::StayTracker stays(Regions(world, delta), kGapNs);
  for (const PersonTrack& track : tracks) {
    Node node;
    node.id = track.id;
    node.layer = layers::kAgents;
    node.kind = kinds::kHuman;
    node.name = absl::StrCat("person-", track.id.index());
    node.valid.from_ns = track.poses.front().time_ns;
    delta.nodes.push_back(node);
    delta.appends.push_back({track.id, track.poses});
    delta.shapes.push_back({track.id, std::nullopt, track.shapes});
    for (const TimedPose& pose : track.poses) {
      stays.Observe(track.id, pose.time_ns, pose.map_T_agent.position);
    }
    out->person_of_track[track.id] =
        std::max_element(track.votes.begin(), track.votes.end(), [](const auto& a, const auto& b) {
          return a.second < b.second;
        })->first;
  }
  stays.Finish();
  delta.stays = stays.TakeChanges();
}

void AddContacts(const std::vector<PersonTrack>& tracks, GraphDelta* delta) {
  std::vector<ingest::AgentPath> paths;
  for (const PersonTrack& track : tracks) {
    ingest::AgentPath path;
    path.agent = track.id;
    for (size_t i = 0; i < track.poses.size(); ++i) {
      const TimedPose& pose = track.poses[i];
      path.torso.push_back({pose.time_ns, pose.map_T_agent.position});
      const auto hand = [&](size_t joint) -> ingest::TimedPoint {
        const float* at = track.shapes[i].joints.data() + 3 * joint;
        return {pose.time_ns, pose.map_T_agent * Eigen::Vector3d(at[0], at[1], at[2])};
      };
      path.left_hand.push_back(hand(ingest::kLeftHand));
      path.right_hand.push_back(hand(ingest::kRightHand));
    }
    paths.push_back(std::move(path));
  }
  std::vector<ingest::ThingBox> things;
  for (const Node& node : delta->nodes) {
    if (node.kind != kinds::kObject) continue;
    things.push_back({node.id, node.BoxMap(), node.valid.from_ns, node.valid.to_ns});
  }
  for (Edge& edge : ingest::FindContactEdges(paths, things, {})) {
    delta->edges.push_back(std::move(edge));
  }
}

void AddRobot(const Stage& stage, GraphDelta* delta) {
  if (stage.robot == nullptr) return;
  Node node;
  node.id = kRobot;
  node.layer = layers::kAgents;
  node.kind = kinds::kRobot;
  node.name = "robot";
  delta->nodes.push_back(node);
  TrajectoryAppend track{kRobot, {}};
  const TimeNs end_ns = simulator::NsOf(stage.options.duration_s);
  for (TimeNs at_ns = 0; at_ns < end_ns; at_ns += stage.options.sensor.frame_ns) {
    TimedPose pose;
    pose.time_ns = at_ns;
    pose.map_T_agent = stage.robot->StateAt(at_ns).map_T_body;
    track.poses.push_back(pose);
  }
  delta->appends.push_back(std::move(track));
}

double SecondsApart(const std::vector<TimeNs>& seen_ns, TimeNs at_ns) {
  double least_s = 1e9;
  if (at_ns == kTimeMax) return least_s;
  for (const TimeNs seen : seen_ns) {
    least_s = std::min(least_s, std::abs(simulator::SecondsOf(seen - at_ns)));
  }
  return least_s;
}

void AddTruth(const Stage& stage, const PeopleSensor& people, PickWorld* out) {
  for (size_t i = 0; i < stage.crowd.picks().size(); ++i) {
    PickTruth pick;
    pick.event = stage.crowd.picks()[i];
    const std::vector<TimeNs>& seen_ns = people.seen_ns(pick.event.person);
    pick.seen_apart_s = SecondsApart(seen_ns, pick.event.pick_ns);
    pick.put_seen_apart_s = SecondsApart(seen_ns, pick.event.place_ns);
    for (const Node& node : out->delta.nodes) {
      const auto object = out->objects.find(node.id);
      if (object == out->objects.end()) continue;
      if (object->second.taken_by != static_cast<int>(i)) continue;
      const TimeNs last_ns = node.last_observed_ns.value_or(node.valid.from_ns);
      pick.is_held = pick.is_held || node.valid.from_ns <= pick.event.pick_ns;
      pick.is_noticed = last_ns <= pick.event.pick_ns && pick.event.pick_ns <= node.valid.to_ns;
    }
    out->picks.push_back(pick);
  }
}

PickWorld Watch(const Stage& stage) {
  const PickWorldOptions& options = stage.options;
  const PickSensorModel& sensor = options.sensor;
  const uint64_t seed = options.world.seed;
  Cameras cameras(stage.world, stage.robot, options.tier, sensor, options.duration_s, seed);
  PeopleSensor people(stage.crowd, sensor, seed);
  ObjectSensor objects(stage.world, stage.crowd, sensor, options.duration_s, seed);
  PlaceClock places(stage);
  const TimeNs end_ns = simulator::NsOf(options.duration_s);
  for (TimeNs at_ns = 0; at_ns < end_ns; at_ns += sensor.frame_ns) {
    cameras.SetTime(at_ns);
    people.SetTime(at_ns);
    people.Look(stage.world.plan, cameras);
    objects.Look(at_ns, cameras, people.bodies());
    places.Look(at_ns, cameras);
  }
  PickWorld out;
  out.tier = options.tier;
  out.name = absl::StrCat(std::string(simulator::Name(options.world.kind)), " ", seed);
  out.delta = simulator::WorldGraph(stage.world);
  DropSmallThings(stage.world, &out.delta);
  AddObjects(stage.world, objects.Finish(), &out);
  places.Apply(&out.delta);
  AddTracks(stage.world, people.tracks(), &out);
  AddContacts(people.tracks(), &out.delta);
  AddRobot(stage, &out.delta);
  AddTruth(stage, people, &out);
  FitBoxesToChildren(&out.delta);
  return out;
}

}  // namespace

absl::StatusOr<PickWorld> MakePickWorld(const PickWorldOptions& options) {
  DSG_ASSIGN_OR_RETURN(const World world, simulator::GenerateWorld(options.world));
  const std::unique_ptr<RobotMotion> robot = MakeRobot(world, options);
  const std::unique_ptr<CrowdMotion> crowd = MakePeople(world, robot.get(), options);
  return Watch({options, world, *crowd, robot.get()});
}

}  // namespace dsg::eval
