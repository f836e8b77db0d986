// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/year/year_world.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/simulator/world/world_graph.h"
#include "schema/model/delta_check.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr int kInhabitantCount = 2;
constexpr double kNoiseM = 0.01;
constexpr double kBlockSizeM = 2.0;
constexpr int kGridSide = 16;
constexpr TimeNs kFactorPeriodNs = 2 * kNsPerSecond;
constexpr TimeNs kShapePeriodNs = 10 * kNsPerSecond;

simulator::World MakeWorld(uint64_t seed) {
  return OrDie(simulator::GenerateWorld({.kind = simulator::WorldKind::kApartment, .seed = seed}));
}

Node MakeAgent(NodeId id, const std::string& kind, const std::string& name) {
  Node node;
  node.id = id;
  node.layer = layers::kAgents;
  node.kind = kind;
  node.name = name;
  node.provenance = Provenance::kPerceived;
  return node;
}

PoseFactor Odometry(const TimedPose& from, const TimedPose& to) {
  PoseFactor factor;
  factor.type = "odometry";
  factor.from_ns = from.time_ns;
  factor.to_ns = to.time_ns;
  factor.relative_pose.position = from.map_T_agent.orientation.inverse() *
                                  (to.map_T_agent.position - from.map_T_agent.position);
  factor.relative_pose.orientation =
      (from.map_T_agent.orientation.inverse() * to.map_T_agent.orientation).normalized();
  return factor;
}

// A body that breathes and swings: 24 joints.
BodyShape Body(TimeNs time_ns, Random* random) {
  BodyShape shape;
  shape.time_ns = time_ns;
  for (int i = 0; i < 72; ++i) {
    shape.pose_coefficients.push_back(static_cast<float>(0.2 * random->Normal()));
  }
  return shape;
}

// A piece of a wavy floor, coloured, as it was seen now.
MeshBlock Patch(const BlockIndex& index, TimeNs now_ns, Random* random) {
  MeshBlock block;
  block.index = index;
  const double step_m = kBlockSizeM / (kGridSide + 1);
  for (int y = 0; y < kGridSide; ++y) {
    for (int x = 0; x < kGridSide; ++x) {
      block.positions_map.emplace_back(
          static_cast<float>(index.x * kBlockSizeM + (x + 0.5) * step_m),
          static_cast<float>(index.y * kBlockSizeM + (y + 0.5) * step_m),
          static_cast<float>(index.z * kBlockSizeM + 0.05 + 0.01 * random->Uniform()));
      block.colors.push_back(0x806040u + static_cast<uint32_t>(random->Index(64)));
      block.labels.push_back(1);
      block.last_seen_ns.push_back(now_ns);
      const auto at = static_cast<uint32_t>(y * kGridSide + x);
      if (x + 1 == kGridSide || y + 1 == kGridSide) continue;
      block.faces.push_back({at, at + 1, at + kGridSide});
      block.faces.push_back({at + 1, at + kGridSide + 1, at + kGridSide});
    }
  }
  return block;
}

}  // namespace

YearWorld::YearWorld(const YearOptions& options)
    : options_(options),
      world_(MakeWorld(options.seed)),
      planner_(&world_),
      graph_(simulator::WorldGraph(world_)),
      random_(options.seed, 1) {
  std::map<NodeId, NodeId> place_of;
  for (const Edge& edge : graph_.edges) {
    if (edge.relation == relations::kContains) place_of[edge.target] = edge.source;
  }
  for (const Node& node : graph_.nodes) {
    if (node.kind == kinds::kPlace && !node.box_node.isEmpty()) {
      places_[node.id] = node.BoxMap();
    }
    if (node.kind == kinds::kObject) things_[node.id] = {node, place_of[node.id]};
  }
}

GraphDelta YearWorld::Building() const {
  GraphDelta delta = graph_;
  delta.session_id = "building";
  delta.sequence = 1;
  delta.nodes.push_back(MakeAgent(Robot(), kinds::kRobot, "robot"));
  for (int i = 0; i < kInhabitantCount; ++i) {
    delta.nodes.push_back(MakeAgent(Inhabitant(i), kinds::kHuman, i == 0 ? "alice" : "bob"));
  }
  return delta;
}

std::vector<NodeId> YearWorld::Things() const {
  std::vector<NodeId> ids;
  for (const auto& [id, thing] : things_) ids.push_back(id);
  return ids;
}

std::vector<YearWorld::Person> YearWorld::PeopleOf(int day) {
  std::vector<Person> people;
  const uint64_t seed = options_.seed * 1000 + static_cast<uint64_t>(day);
  const auto add = [&](NodeId id, bool is_robot) {
    const int index = static_cast<int>(people.size());
    const simulator::AgentSpec agent{ToString(id), is_robot, index};
    people.push_back({.id = id,
                      .walker = simulator::Walker(&world_, &planner_, agent, seed),
                      .is_robot = is_robot,
                      .random = Random(seed, static_cast<uint64_t>(100 + index))});
  };
  add(Robot(), true);
  for (int i = 0; i < kInhabitantCount; ++i) add(Inhabitant(i), false);
  add(Guest(day), false);
  return people;
}

std::vector<GraphDelta> YearWorld::Day(int day) {
  std::vector<Person> people = PeopleOf(day);
  std::vector<GraphDelta> parts;
  for (int part = 0; part < options_.part_count; ++part) {
    GraphDelta delta;
    delta.session_id = absl::StrFormat("day-%03d", day);
    delta.sequence = part + 1;
    delta.author = "robot";
    delta.message = absl::StrCat("day ", day, ", part ", part + 1);
    const TimeNs begin_ns = BeginOf(day) + part * options_.part_ns;
    const TimeNs end_ns = begin_ns + options_.part_ns;
    if (part == 0) {
      delta.nodes.push_back(MakeAgent(Guest(day), kinds::kHuman, absl::StrCat("guest ", day)));
    }
    for (Person& person : people) AddPoses(begin_ns, end_ns, day, &person, &delta);
    if (part + 1 == options_.part_count) delta.retirements.push_back({Guest(day), end_ns});
    SeeThings(part, end_ns, &delta);
    ChangeThings(part, end_ns, &delta);
    RenewMesh(part, end_ns, &delta);
    Coalesce(&delta);
    parts.push_back(std::move(delta));
  }
  return parts;
}

void YearWorld::AddPoses(TimeNs begin_ns, TimeNs end_ns, int day, Person* person,
                         GraphDelta* delta) {
  TrajectoryAppend append{person->id, {}};
  FactorAppend factors{person->id, {}};
  ShapeAppend shapes{person->id, std::nullopt, {}};
  for (TimeNs now_ns = begin_ns; now_ns < end_ns; now_ns += options_.pose_period_ns) {
    const simulator::FloorPose floor = person->walker.PoseAt(now_ns - BeginOf(day));
    TimedPose pose;
    pose.time_ns = now_ns;
    pose.map_T_agent = simulator::BodyPose(floor, person->is_robot);
    for (int axis = 0; axis < 2; ++axis) {
      pose.map_T_agent.position[axis] += kNoiseM * person->random.Normal();
    }
    AddStay(person, world_.plan.RoomAt(floor.position), now_ns, false, delta);
    append.poses.push_back(pose);
    if (person->is_robot && (now_ns - begin_ns) % kFactorPeriodNs == 0 && now_ns > begin_ns) {
      const size_t back = static_cast<size_t>(kFactorPeriodNs / options_.pose_period_ns);
      factors.factors.push_back(Odometry(append.poses[append.poses.size() - 1 - back], pose));
    }
    if (person->id == Inhabitant(0) && (now_ns - begin_ns) % kShapePeriodNs == 0) {
      shapes.shapes.push_back(Body(now_ns, &person->random));
    }
  }
  const bool is_over = end_ns == BeginOf(day) + session_ns();
  if (is_over) AddStay(person, -1, end_ns, true, delta);
  delta->appends.push_back(std::move(append));
  if (!factors.factors.empty()) delta->factors.push_back(std::move(factors));
  if (!shapes.shapes.empty()) delta->shapes.push_back(std::move(shapes));
}

// Closes the stay that was, and opens the next.
void YearWorld::AddStay(Person* person, int room, TimeNs now_ns, bool is_over, GraphDelta* delta) {
  if (room == person->room && now_ns - person->enter_ns < kStayNsMax) return;
  if (person->room >= 0) {
    delta->stays.push_back(
        {person->id, NodeId(), simulator::RoomId(person->room), person->enter_ns, now_ns});
  }
  person->room = room;
  person->enter_ns = now_ns;
  if (room < 0 || is_over) return;
  delta->stays.push_back({person->id, NodeId(), simulator::RoomId(room), now_ns, kTimeMax});
}

// Each thing is looked at once a day.
void YearWorld::SeeThings(int part, TimeNs now_ns, GraphDelta* delta) {
  int number = 0;
  for (auto& [id, thing] : things_) {
    if (number++ % options_.part_count != part) continue;
    thing.node.last_observed_ns = now_ns;
    if (!thing.node.first_observed_ns.has_value()) thing.node.first_observed_ns = now_ns;
    ++thing.node.observation_count;
    delta->nodes.push_back(thing.node);
  }
}

void YearWorld::ChangeThings(int part, TimeNs now_ns, GraphDelta* delta) {
  for (int i = 0; i < options_.moved_count; ++i) {
    if (i * 3 + 1 == part) Move(now_ns, delta);
  }
  for (int i = 0; i < options_.replaced_count; ++i) {
    if (i * 3 + 2 == part) Replace(now_ns, delta);
  }
}

std::map<NodeId, YearWorld::Thing>::iterator YearWorld::AnyThing(const GraphDelta& delta) {
  while (true) {
    const auto thing = std::next(things_.begin(), random_.Index(static_cast<int>(things_.size())));
    const bool is_told = std::any_of(delta.nodes.begin(), delta.nodes.end(),
                                     [&](const Node& node) { return node.id == thing->first; });
    if (!is_told) return thing;
  }
}

void YearWorld::TakeAway(std::map<NodeId, Thing>::iterator thing, TimeNs now_ns,
                         GraphDelta* delta) {
  delta->retirements.push_back({thing->first, now_ns});
  things_.erase(thing);
}

NodeId YearWorld::Bring(const Node& like, TimeNs now_ns, GraphDelta* delta) {
  const auto place = std::next(places_.begin(), random_.Index(static_cast<int>(places_.size())));
  Node node = like;
  node.id = NodeId('O', next_thing_++);
  node.object.reset();
  const Eigen::Vector3d half = place->second.sizes().cwiseMin(0.3) / 2.0;
  node.map_T_node = Pose3d();
  node.map_T_node.position = place->second.center();
  node.box_node = Box3d(-half, half);
  node.valid = {now_ns, kTimeMax};
  node.first_observed_ns = now_ns;
  node.last_observed_ns = now_ns;
  node.observation_count = 1;
  node.attributes.clear();
  delta->nodes.push_back(node);
  Edge inside;
  inside.source = place->first;
  inside.relation = relations::kContains;
  inside.target = node.id;
  delta->edges.push_back(inside);
  const NodeId id = node.id;
  things_[id] = {std::move(node), place->first};
  return id;
}

// The same thing elsewhere: where it was it is no more, and both are known to be one.
void YearWorld::Move(TimeNs now_ns, GraphDelta* delta) {
  const auto thing = AnyThing(*delta);
  const Node before = thing->second.node;
  TakeAway(thing, now_ns, delta);
  Edge same;
  same.source = Bring(before, now_ns, delta);
  same.relation = relations::kSameAs;
  same.target = before.id;
  delta->edges.push_back(same);
}

void YearWorld::Replace(TimeNs now_ns, GraphDelta* delta) {
  const auto thing = AnyThing(*delta);
  const Node before = thing->second.node;
  TakeAway(thing, now_ns, delta);
  Bring(before, now_ns, delta);
}

void YearWorld::RenewMesh(int part, TimeNs now_ns, GraphDelta* delta) {
  const auto high = world_.Bounds().max();
  const int columns = std::max(1, static_cast<int>(high.x() / kBlockSizeM));
  const int rows = std::max(1, static_cast<int>(high.y() / kBlockSizeM));
  for (int i = part; i < options_.block_count; i += options_.part_count) {
    const int at = next_block_++ % (columns * rows);
    delta->mesh_blocks.push_back(Patch({at % columns, at / columns, 0}, now_ns, &random_));
  }
}

}  // namespace dsg::test
