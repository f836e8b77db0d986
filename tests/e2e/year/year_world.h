// SPDX-License-Identifier: Apache-2.0
// A year of a robot's life in the simulator's apartment, at the level of the graph: an hour a day,
// with people, things that are seen again, moved, taken away and brought, and a mesh that is
// renewed in parts. Refuses to render: what perception makes of a day is not the question here.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ingest/simulator/world/planner.h"
#include "ingest/simulator/world/walker.h"
#include "ingest/simulator/world/world.h"
#include "schema/base/random.h"
#include "schema/model/graph_delta.h"

namespace dsg::test {

inline constexpr TimeNs kDayNs = 24 * 3600 * kNsPerSecond;
inline constexpr TimeNs kYearEpochNs = 1'735'689'600 * kNsPerSecond;

/// How much happens in a day.
struct YearOptions {
  uint64_t seed = 1;
  /// Deltas a day, and how long each is.
  int part_count = 12;
  TimeNs part_ns = 300 * kNsPerSecond;
  TimeNs pose_period_ns = kNsPerSecond / 5;
  int moved_count = 2;
  int replaced_count = 2;
  int block_count = 12;
};

/// Makes one day after the other. Same options, same deltas.
///
/// Threads: one caller at a time.
class YearWorld {
 public:
  explicit YearWorld(const YearOptions& options);

  /// The building and who lives in it; session "building".
  GraphDelta Building() const;
  /// The day numbered `day` (from 0), to be asked for in order; a session of its own.
  std::vector<GraphDelta> Day(int day);

  /// When the session of a day begins: nine in the morning.
  static TimeNs BeginOf(int day) { return kYearEpochNs + day * kDayNs + 9 * kDayNs / 24; }
  TimeNs session_ns() const { return options_.part_count * options_.part_ns; }

  /// For questions: the robot, two people who are always there, and a guest of each day.
  static NodeId Robot() { return NodeId('r', 1); }
  static NodeId Inhabitant(int index) { return NodeId('H', static_cast<uint64_t>(index)); }
  static NodeId Guest(int day) { return NodeId('H', 1000 + static_cast<uint64_t>(day)); }
  const simulator::World& world() const { return world_; }
  /// Things that are in the apartment now, ascending by id.
  std::vector<NodeId> Things() const;

 private:
  struct Thing {
    Node node;
    NodeId place;
  };
  struct Person {
    NodeId id;
    simulator::Walker walker;
    bool is_robot = false;
    int room = -1;
    TimeNs enter_ns = 0;
    /// The state of noise.
    Random random;
  };

  std::vector<Person> PeopleOf(int day);
  void AddPoses(TimeNs begin_ns, TimeNs end_ns, int day, Person* person, GraphDelta* delta);
  void AddStay(Person* person, int room, TimeNs now_ns, bool is_over, GraphDelta* delta);
  void SeeThings(int part, TimeNs now_ns, GraphDelta* delta);
  void ChangeThings(int part, TimeNs now_ns, GraphDelta* delta);
  void Move(TimeNs now_ns, GraphDelta* delta);
  void Replace(TimeNs now_ns, GraphDelta* delta);
  NodeId Bring(const Node& like, TimeNs now_ns, GraphDelta* delta);
  void TakeAway(std::map<NodeId, Thing>::iterator thing, TimeNs now_ns, GraphDelta* delta);
  void RenewMesh(int part, TimeNs now_ns, GraphDelta* delta);
  std::map<NodeId, Thing>::iterator AnyThing(const GraphDelta& delta);

  const YearOptions options_;
  const simulator::World world_;
  const simulator::Planner planner_;
  GraphDelta graph_;
  std::map<NodeId, Thing> things_;
  std::map<NodeId, Box3d> places_;
  uint64_t next_thing_ = 10'000;
  int next_block_ = 0;
  Random random_;
};

}  // namespace dsg::test
