// SPDX-License-Identifier: Apache-2.0
#include "tests/support/random_world.h"

#include "schema/model/delta_check.h"

namespace dsg::test {
namespace {

constexpr double kHalfWorldM = 50.0;

Node MakeNode(NodeId id, LayerId layer, const char* kind, const std::string& name) {
  Node node;
  node.id = id;
  node.layer = layer;
  node.kind = kind;
  node.name = name;
  node.provenance = Provenance::kPerceived;
  return node;
}

template <typename Map>
std::vector<typename Map::key_type> KeysWithLetter(const Map& map, char letter) {
  std::vector<typename Map::key_type> keys;
  for (const auto& [id, unused] : map) {
    if (id.letter() == letter) keys.push_back(id);
  }
  return keys;
}

}  // namespace

void NaiveMap::Apply(const GraphDelta& original) {
  GraphDelta delta = original;
  Coalesce(&delta);
  for (const Node& node : delta.nodes) nodes[node.id] = node;
  for (const EdgeKey& key : delta.edge_removals) edges.erase(key);
  for (const Retirement& item : delta.retirements) {
    if (item.valid_to_ns.has_value()) {
      nodes[item.id].valid.to_ns = *item.valid_to_ns;
      continue;
    }
    nodes.erase(item.id);
    tracks.erase(item.id);
    std::erase_if(edges, [&](const auto& entry) {
      return entry.first.source == item.id || entry.first.target == item.id;
    });
    std::erase_if(stays, [&](const auto& entry) { return entry.first.first == item.id; });
  }
  for (const Edge& edge : delta.edges) edges[edge.key()] = edge;
  for (const TrajectoryCorrection& item : delta.corrections) {
    auto& track = tracks[item.agent];
    track.erase(track.lower_bound(item.from_ns), track.lower_bound(item.to_ns));
    for (const TimedPose& pose : item.poses) track[pose.time_ns] = pose;
  }
  for (const TrajectoryAppend& item : delta.appends) {
    for (const TimedPose& pose : item.poses) tracks[item.agent][pose.time_ns] = pose;
  }
  for (const Stay& stay : delta.stays) stays[{stay.agent, stay.enter_ns}] = stay;
}

int64_t RandomWorld::Int(int64_t low, int64_t high) {
  return std::uniform_int_distribution<int64_t>(low, high)(random_);
}

double RandomWorld::Real(double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random_);
}

Pose3d RandomWorld::RandomPose() {
  Pose3d pose;
  pose.position = {Real(-40, 40), Real(-40, 40), Real(0, 3)};
  pose.orientation =
      Eigen::Quaterniond(Real(-1, 1), Real(-1, 1), Real(-1, 1), Real(-1, 1)).normalized();
  return pose;
}

Node RandomWorld::MakePlace(NodeId id) {
  Node place = MakeNode(id, layers::kPlaces, kinds::kPlace, "");
  place.map_T_node = RandomPose();
  place.box_node = Box3d(Eigen::Vector3d::Constant(-0.5), Eigen::Vector3d::Constant(0.5));
  place.place = PlaceInfo{Real(0.1, 2.0), Box3d(), 3};
  place.observation_count = Int(1, 100);
  if (Int(0, 3) == 0) place.attributes["note"] = std::string("n") + std::to_string(Int(0, 9));
  return place;
}

GraphDelta RandomWorld::First() {
  GraphDelta delta;
  delta.session_id = "random";
  delta.sequence = ++sequence_;
  for (uint64_t i = 0; i < 4; ++i) {
    Node room = MakeNode(NodeId('R', i), layers::kRooms, kinds::kRoom, "room" + std::to_string(i));
    room.box_node =
        Box3d(Eigen::Vector3d::Constant(-kHalfWorldM), Eigen::Vector3d::Constant(kHalfWorldM));
    delta.nodes.push_back(room);
  }
  for (int i = 0; i < kPeople; ++i) {
    delta.nodes.push_back(MakeNode(Person(i), layers::kAgents,
                                   i == 0 ? kinds::kRobot : kinds::kHuman,
                                   "person" + std::to_string(i)));
  }
  return delta;
}

GraphDelta RandomWorld::Next(const NaiveMap& map) {
  GraphDelta delta;
  delta.session_id = "random";
  delta.sequence = ++sequence_;
  delta.message = "delta " + std::to_string(sequence_);
  ChangePlaces(map, &delta);
  ChangeEdges(map, &delta);
  if (Int(0, 7) == 0) Correct(map, &delta);
  Walk(map, &delta);
  Visit(map, &delta);
  return delta;
}

void RandomWorld::ChangePlaces(const NaiveMap& map, GraphDelta* delta) {
  for (int64_t i = Int(0, 4); i > 0; --i) {
    const NodeId id('p', next_place_++);
    delta->nodes.push_back(MakePlace(id));
    delta->edges.push_back(
        {NodeId('R', static_cast<uint64_t>(Int(0, 3))), relations::kContains, id});
  }
  const auto places = KeysWithLetter(map.nodes, 'p');
  if (places.empty()) return;
  const auto any = [&] { return places[static_cast<size_t>(Int(0, std::ssize(places) - 1))]; };
  if (Int(0, 1) == 0) delta->nodes.push_back(MakePlace(any()));
  const NodeId leaving = any();
  const bool written = std::any_of(delta->nodes.begin(), delta->nodes.end(),
                                   [&](const Node& node) { return node.id == leaving; });
  if (Int(0, 3) == 0 && !written) {
    Retirement item{leaving, std::nullopt};
    if (Int(0, 1) == 0) item.valid_to_ns = Int(1, 1'000'000);
    delta->retirements.push_back(item);
  }
}

void RandomWorld::ChangeEdges(const NaiveMap& map, GraphDelta* delta) {
  auto places = KeysWithLetter(map.nodes, 'p');
  std::erase_if(places, [&](NodeId id) {
    return std::any_of(delta->retirements.begin(), delta->retirements.end(),
                       [&](const Retirement& item) { return item.id == id; });
  });
  if (places.size() < 2) return;
  const auto any = [&] { return places[static_cast<size_t>(Int(0, std::ssize(places) - 1))]; };
  for (int64_t i = Int(0, 4); i > 0; --i) {
    Edge edge{any(), Int(0, 4) == 0 ? "custom" : relations::kTraversable, any(), Real(0, 2)};
    if (Int(0, 5) == 0) edge.valid = {Int(0, 100), Int(101, 200)};
    if (edge.source != edge.target) delta->edges.push_back(std::move(edge));
  }
  if (!map.edges.empty() && Int(0, 1) == 0) {
    auto edge = map.edges.begin();
    std::advance(edge, Int(0, std::ssize(map.edges) - 1));
    delta->edge_removals.push_back(edge->first);
  }
}

void RandomWorld::Walk(const NaiveMap& map, GraphDelta* delta) {
  for (int i = 0; i < kPeople; ++i) {
    if (Int(0, 2) == 0) continue;
    TimedPose pose;
    pose.map_T_agent = RandomPose();
    const auto track = map.tracks.find(Person(i));
    if (track != map.tracks.end() && !track->second.empty()) {
      pose = track->second.rbegin()->second;
    }
    TrajectoryAppend append{Person(i), {}};
    // Corrections of this delta may reach to the old end: begin after it.
    for (int64_t n = Int(1, 120); n > 0; --n) {
      const bool gap = Int(0, 60) == 0;
      pose.time_ns += gap ? Int(3, 9) * kNsPerSecond : Int(1, 200'000'000);
      if (Int(0, 3) != 0) pose.time_ns = (pose.time_ns / 1000 + 1) * 1000;
      pose.flags = Int(0, 40) == 0 ? pose_flags::kPredicted : 0;
      pose.map_T_agent.position += Eigen::Vector3d(Real(-.1, .1), Real(-.1, .1), Real(-.01, .01));
      pose.map_T_agent.orientation =
          (pose.map_T_agent.orientation *
           Eigen::Quaterniond(1.0, Real(-.02, .02), Real(-.02, .02), Real(-.2, .2)))
              .normalized();
      append.poses.push_back(pose);
    }
    delta->appends.push_back(std::move(append));
  }
}

void RandomWorld::Correct(const NaiveMap& map, GraphDelta* delta) {
  const NodeId agent = Person(static_cast<int>(Int(0, kPeople - 1)));
  const auto track = map.tracks.find(agent);
  if (track == map.tracks.end() || track->second.size() < 3) return;
  auto first = track->second.begin();
  std::advance(first, Int(0, std::ssize(track->second) - 2));
  TrajectoryCorrection correction{agent, first->first, first->first, {}};
  for (int64_t n = Int(1, 200); n > 0 && first != track->second.end(); --n, ++first) {
    TimedPose moved = first->second;
    moved.flags |= pose_flags::kCorrected;
    moved.map_T_agent.position += Eigen::Vector3d(0.5, -0.25, 0.0);
    correction.to_ns = moved.time_ns + 1;
    // Some poses are dropped, but never the last of the track, so that later times stay later.
    if (Int(0, 9) != 0 || std::next(first) == track->second.end()) {
      correction.poses.push_back(moved);
    }
  }
  delta->corrections.push_back(std::move(correction));
}

void RandomWorld::Visit(const NaiveMap& map, GraphDelta* delta) {
  for (int i = 0; i < kPeople; ++i) {
    const auto last = map.stays.upper_bound({Person(i), kTimeMax});
    const bool any = last != map.stays.begin() && std::prev(last)->first.first == Person(i);
    TimeNs from = Int(0, kNsPerSecond);
    if (any) {
      Stay open = std::prev(last)->second;
      from = open.enter_ns + Int(1, 60) * kNsPerSecond;
      if (open.exit_ns == kTimeMax) {
        open.exit_ns = from;
        delta->stays.push_back(open);
      } else {
        from = open.exit_ns;
      }
    }
    if (Int(0, 1) == 0) {
      const NodeId room('R', static_cast<uint64_t>(Int(0, 3)));
      delta->stays.push_back({Person(i), NodeId(), room, from, kTimeMax});
    }
  }
}

}  // namespace dsg::test
