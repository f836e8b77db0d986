// SPDX-License-Identifier: Apache-2.0
// Every invariant has a delta that breaks it and nothing else.
#include "schema/model/delta_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "schema/base/status.h"

namespace dsg {
namespace {

// The graph before the delta: one room that holds one place, and one agent with a track.
class SmallGraph : public GraphLookup {
 public:
  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override {
    const Box3d box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, 10, 3));
    if (id == NodeId('R', 0)) return std::optional(NodeFacts{layers::kRooms, false, {}, box});
    if (id == NodeId('p', 0)) {
      return std::optional(NodeFacts{layers::kPlaces, false, {}, Box3d(), {1, 1, 1}});
    }
    if (id == NodeId('H', 0)) return std::optional(NodeFacts{layers::kAgents, true, {}, Box3d()});
    return std::optional<NodeFacts>();
  }
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override {
    for (const Layer& layer : DefaultLayers()) {
      if (layer.id == id) return std::optional(layer);
    }
    return std::optional<Layer>();
  }
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override {
    if (id == NodeId('p', 0)) return std::vector{NodeId('R', 0)};
    return std::vector<NodeId>();
  }
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override {
    if (id == NodeId('R', 0)) return std::vector{NodeId('p', 0)};
    return std::vector<NodeId>();
  }
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override {
    if (agent == NodeId('H', 0)) return std::optional<TimeNs>(1000);
    return std::optional<TimeNs>();
  }
  absl::StatusOr<bool> HasAsset(const Sha256&) const override { return false; }
  const MapSpec* FindSpec() const override { return &spec_; }
  absl::StatusOr<std::optional<Interval>> FindSpan() const override { return span; }

  /// Of the poses.
  std::optional<Interval> span = Interval{0, 1000};

 private:
  const MapSpec spec_;
};

Node Place(uint64_t index, double x) {
  Node node;
  node.id = NodeId('p', index);
  node.layer = layers::kPlaces;
  node.kind = kinds::kPlace;
  node.map_T_node.position = {x, 1, 1};
  return node;
}

GraphDelta Empty() {
  GraphDelta delta;
  delta.session_id = "s";
  delta.sequence = 1;
  return delta;
}

GraphDelta With(const std::function<void(GraphDelta*)>& change) {
  GraphDelta delta = Empty();
  change(&delta);
  return delta;
}

void ExpectRefused(const std::function<void(GraphDelta*)>& change, Reason reason,
                   const std::string& part_of_message) {
  const auto status = CheckDelta(With(change), SmallGraph());
  EXPECT_EQ(ReasonOf(status), reason) << status;
  EXPECT_NE(std::string(status.message()).find(part_of_message), std::string::npos) << status;
}

TEST(CheckDelta, AcceptsASoundDelta) {
  EXPECT_TRUE(CheckDelta(With([](GraphDelta* delta) {
                           delta->nodes = {Place(1, 5.0)};
                           delta->edges = {
                               {NodeId('R', 0), relations::kContains, NodeId('p', 1)},
                               {NodeId('p', 0), relations::kTraversable, NodeId('p', 1)}};
                           delta->appends = {{NodeId('H', 0), {TimedPose{1001}}}};
                           delta->stays = {{NodeId('H', 0), NodeId('p', 1), NodeId('R', 0), 5}};
                         }),
                         SmallGraph())
                  .ok());
}

TEST(CheckDelta, RefusesADeltaWithoutIdentity) {
  ExpectRefused([](GraphDelta* d) { d->session_id.clear(); }, Reason::kDeltaInvalid, "session_id");
  ExpectRefused([](GraphDelta* d) { d->sequence = 0; }, Reason::kDeltaInvalid, "sequence is 0");
}

TEST(CheckDelta, RefusesNodesOutOfPlace) {
  ExpectRefused([](GraphDelta* d) { d->nodes = {Place(1, std::nan(""))}; },
                Reason::kNumberNotFinite, "position");
  ExpectRefused([](GraphDelta* d) { d->nodes = {Place(1, 3.0e6)}; }, Reason::kNumberNotFinite,
                "position (3e+06, 1, 1) of node p1");
  ExpectRefused(
      [](GraphDelta* d) {
        d->nodes = {Place(1, 1)};
        d->nodes[0].map_T_node.orientation.w() = 2.0;
      },
      Reason::kDeltaInvalid, "norm 2");
  ExpectRefused(
      [](GraphDelta* d) {
        d->nodes = {Place(1, 1)};
        d->nodes[0].layer = layers::kRooms;
      },
      Reason::kDeltaInvalid, "cannot be in layer \"rooms\"");
  ExpectRefused(
      [](GraphDelta* d) {
        d->nodes = {Place(1, 1)};
        d->nodes[0].layer = 99;
      },
      Reason::kDeltaInvalid, "layer 99");
  ExpectRefused(
      [](GraphDelta* d) {
        d->nodes = {Place(1, 1)};
        d->nodes[0].valid = {5, 5};
      },
      Reason::kDeltaInvalid, "validity [5, 5)");
}

TEST(CheckDelta, RefusesTextThatIsNotUtf8WhereverItStands) {
  const std::string latin1 = "J\xf6rg";
  const auto expect_refused = [&](const std::function<void(GraphDelta*)>& change) {
    ExpectRefused(change, Reason::kDeltaInvalid, "is not UTF-8");
  };
  expect_refused([&](GraphDelta* d) { d->session_id = latin1; });
  expect_refused([&](GraphDelta* d) { d->author = latin1; });
  expect_refused([&](GraphDelta* d) { d->message = latin1; });
  expect_refused([&](GraphDelta* d) { d->layers = {{99, latin1, 450}}; });
  expect_refused([&](GraphDelta* d) { d->labels = {{1, latin1}}; });
  expect_refused([&](GraphDelta* d) {
    d->nodes = {Place(1, 1)};
    d->nodes[0].name = latin1;
  });
  expect_refused([&](GraphDelta* d) {
    d->nodes = {Place(1, 1)};
    d->nodes[0].class_name = latin1;
  });
  expect_refused([&](GraphDelta* d) {
    d->nodes = {Place(1, 1)};
    d->nodes[0].attributes["note"] = latin1;
  });
  expect_refused([&](GraphDelta* d) {
    d->nodes = {Place(1, 1)};
    d->nodes[0].attributes[latin1] = 1.0;
  });
  expect_refused([&](GraphDelta* d) {
    d->nodes = {Place(1, 1)};
    d->edges = {{NodeId('p', 0), latin1, NodeId('p', 1)}};
  });
}

TEST(CheckDelta, RefusesEdgesThatDangleOrLoop) {
  ExpectRefused(
      [](GraphDelta* d) {
        d->edges = {{NodeId('p', 0), relations::kNear, NodeId('p', 7)}};
      },
      Reason::kDeltaInvalid, "p7, which does not exist");
  ExpectRefused(
      [](GraphDelta* d) {
        d->edges = {{NodeId('p', 0), relations::kNear, NodeId('p', 0)}};
      },
      Reason::kDeltaInvalid, "ends where it begins");
  ExpectRefused(
      [](GraphDelta* d) {
        d->retirements = {{NodeId('p', 0), std::nullopt}};
        d->edges = {{NodeId('R', 0), relations::kContains, NodeId('p', 0)}};
      },
      Reason::kDeltaInvalid, "does not exist");
}

TEST(CheckDelta, RefusesContainmentAgainstRankOrBox) {
  ExpectRefused(
      [](GraphDelta* d) {
        d->edges = {{NodeId('p', 0), relations::kContains, NodeId('R', 0)}};
      },
      Reason::kDeltaInvalid, "must outrank");
  ExpectRefused(
      [](GraphDelta* d) {
        d->nodes = {Place(1, 11.0)};
        d->edges = {{NodeId('R', 0), relations::kContains, NodeId('p', 1)}};
      },
      Reason::kDeltaInvalid, "sticks out");
}

TEST(CheckDelta, RefusesAMovedNodeThatLeavesItsStoredFamily) {
  ExpectRefused([](GraphDelta* d) { d->nodes = {Place(0, 12.0)}; }, Reason::kDeltaInvalid,
                "R0 CONTAINS p0");
  ExpectRefused(
      [](GraphDelta* d) {
        Node room;
        room.id = NodeId('R', 0);
        room.layer = layers::kRooms;
        room.kind = kinds::kRoom;
        room.box_node = Box3d(Eigen::Vector3d(5, 5, 0), Eigen::Vector3d(10, 10, 3));
        d->nodes = {room};
      },
      Reason::kDeltaInvalid, "R0 CONTAINS p0");
  // Moving it out is fine when the edge ends in the same delta.
  EXPECT_TRUE(
      CheckDelta(With([](GraphDelta* d) {
                   d->nodes = {Place(0, 12.0)};
                   d->edge_removals = {{NodeId('R', 0), relations::kContains, NodeId('p', 0)}};
                 }),
                 SmallGraph())
          .ok());
}

TEST(CheckDelta, RefusesTrajectoriesThatDoNotGrow) {
  ExpectRefused(
      [](GraphDelta* d) {
        d->appends = {{NodeId('H', 0), {TimedPose{2000}, TimedPose{2000}}}};
      },
      Reason::kDeltaInvalid, "2000 comes after 2000");
  ExpectRefused(
      [](GraphDelta* d) {
        d->appends = {{NodeId('H', 0), {TimedPose{1000}}}};
      },
      Reason::kTrackConflict, "stored end 1000");
  ExpectRefused(
      [](GraphDelta* d) {
        d->appends = {{NodeId('p', 0), {TimedPose{1}}}};
      },
      Reason::kDeltaInvalid, "needs a human or robot");
  ExpectRefused(
      [](GraphDelta* d) {
        d->corrections = {{NodeId('H', 0), 100, 200, {TimedPose{200}}}};
      },
      Reason::kDeltaInvalid, "outside [100, 200)");
}

TEST(CheckDelta, RefusesStaysNowhereOrEmpty) {
  ExpectRefused(
      [](GraphDelta* d) {
        d->stays = {{NodeId('H', 0), NodeId(), NodeId(), 5}};
      },
      Reason::kDeltaInvalid, "nowhere");
  ExpectRefused(
      [](GraphDelta* d) {
        d->stays = {{NodeId('H', 0), NodeId('p', 0), NodeId(), kTimeMax - 1, kTimeMin}};
      },
      Reason::kDeltaInvalid, "is empty");
}

TEST(CheckDelta, RefusesComponentsThatAreNoNumbers) {
  const auto with_wall = [](double normal_x, double offset_m) {
    return [=](GraphDelta* d) {
      d->nodes = {Place(1, 1)};
      d->nodes[0].structure.emplace();
      d->nodes[0].structure->plane_normal_map = {normal_x, 0, 0};
      d->nodes[0].structure->plane_offset_m = offset_m;
    };
  };
  ExpectRefused(with_wall(std::nan(""), 0), Reason::kNumberNotFinite, "the plane of node p1");
  ExpectRefused(with_wall(1, INFINITY), Reason::kNumberNotFinite, "the plane of node p1");
  ExpectRefused(
      [](GraphDelta* d) {
        d->nodes = {Place(1, 1)};
        d->nodes[0].place.emplace();
        d->nodes[0].place->clearance_m = -1;
      },
      Reason::kDeltaInvalid, "clearance of node p1 is -1 m");
  const auto with_residual = [](double residual_m) {
    return [=](GraphDelta* d) {
      d->nodes = {Place(1, 1)};
      d->nodes[0].object.emplace();
      d->nodes[0].object->registration_residual_m = residual_m;
    };
  };
  ExpectRefused(with_residual(std::nan("")), Reason::kNumberNotFinite, "registration residual");
  ExpectRefused(with_residual(-0.1), Reason::kDeltaInvalid, "registration residual of node p1 is");
  ExpectRefused(
      [](GraphDelta* d) {
        d->nodes = {Place(1, 1)};
        d->nodes[0].agent.emplace();
        d->nodes[0].agent->gap_ns_max = -5;
      },
      Reason::kDeltaInvalid, "gap_ns_max of node p1 is -5");
  ExpectRefused(
      [](GraphDelta* d) {
        TimedPose pose{2000};
        Covariance6 covariance{};
        covariance[3] = NAN;
        pose.covariance = std::make_shared<const Covariance6>(covariance);
        d->appends = {{NodeId('H', 0), {pose}}};
      },
      Reason::kNumberNotFinite, "covariance of trajectory of H0 at 2000 ns");
  ExpectRefused(
      [](GraphDelta* d) {
        MeshBlock block;
        block.positions_map.resize(1, Eigen::Vector3f::Zero());
        block.normals_map.push_back({0, NAN, 1});
        d->mesh_blocks = {block};
      },
      Reason::kNumberNotFinite, "a normal of mesh block 0,0,0");
}

TEST(CheckDelta, RefusesMeshesAndAssetsThatContradictThemselves) {
  ExpectRefused(
      [](GraphDelta* d) {
        MeshBlock block;
        block.positions_map.resize(2, Eigen::Vector3f::Zero());
        block.faces.push_back({0, 1, 2});
        d->mesh_blocks = {block};
      },
      Reason::kDeltaInvalid, "a vertex that does not exist");
  ExpectRefused(
      [](GraphDelta* d) {
        d->assets = {{Sha256{}, "model/ply", "content"}};
      },
      Reason::kDeltaInvalid, "does not match its sha256");
}

TEST(CheckDelta, RefusesVerticesOutsideOfTheirBlock) {
  // Blocks are 2 m wide. The second and third corner of a face may lie elsewhere.
  MeshBlock block;
  block.index = {1, 0, -1};
  block.positions_map = {{2.0f, 0.0f, -2.0f}, {9.0f, 0.5f, -1.0f}, {4.0f, 1.0f, 5.0f}};
  block.faces = {{0, 1, 2}};
  const auto check = [&] {
    GraphDelta delta = Empty();
    delta.mesh_blocks = {block};
    return CheckDelta(delta, SmallGraph());
  };
  EXPECT_TRUE(check().ok()) << check();
  block.positions_map[0].x() = 2.0f - 5e-5f;
  EXPECT_TRUE(check().ok()) << check();
  block.positions_map[0].x() = 1.99f;
  EXPECT_EQ(ReasonOf(check()), Reason::kDeltaInvalid);
  EXPECT_NE(check().message().find("vertex 0 of mesh block 1,0,-1 at (1.99"), std::string::npos)
      << check();
  block.positions_map[0].x() = 2.5f;
  block.positions_map[1].x() = 5000.0f;
  EXPECT_NE(check().message().find("vertex 1 of mesh block"), std::string::npos) << check();
  // A vertex without faces belongs to its own block.
  block.positions_map[1].x() = 9.0f;
  block.faces.clear();
  EXPECT_NE(check().message().find("vertex 1 of mesh block"), std::string::npos) << check();
  // What forgets cuts blocks that were taken before this was checked.
  GraphDelta cut = Empty();
  cut.mesh_blocks = {block};
  cut.is_forgetting = true;
  EXPECT_TRUE(CheckDelta(cut, SmallGraph()).ok());
}

TEST(CheckDelta, RefusesFootprintsThatAreInvertedOrHaveNoArea) {
  const auto with_room = [](Polygon2d footprint, double z_min_m, double z_max_m) {
    return [=](GraphDelta* d) {
      d->nodes = {Place(1, 1)};
      d->nodes[0].region = RegionInfo{footprint, z_min_m, z_max_m, {}};
    };
  };
  const Polygon2d square = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  for (const auto& sound :
       {with_room(square, 0, 3), with_room({}, 0, 0), with_room({{0, 0}, {0, 4}, {4, 4}}, 1, 1)}) {
    EXPECT_TRUE(CheckDelta(With(sound), SmallGraph()).ok());
  }
  ExpectRefused(with_room(square, 3, 0), Reason::kDeltaInvalid, "footprint of node p1 is inverted");
  ExpectRefused(with_room({{0, 0}, {4, 0}}, 0, 3), Reason::kDeltaInvalid, "2 corners and no area");
  ExpectRefused(with_room({{1e6, 0}, {1e6, 1}, {1e6, 2}}, 0, 3), Reason::kDeltaInvalid, "no area");
  ExpectRefused(with_room(square, std::nan(""), 3), Reason::kNumberNotFinite, "height");
}

TEST(CheckDelta, RefusesTimesAtTheLimitsAndNegativeSizes) {
  const auto with = [](const std::function<void(Node*)>& change) {
    return [=](GraphDelta* d) {
      d->nodes = {Place(1, 1)};
      change(&d->nodes[0]);
    };
  };
  for (const TimeNs limit_ns : {kTimeMin, kTimeMax}) {
    ExpectRefused(with([&](Node* n) { n->first_observed_ns = limit_ns; }), Reason::kDeltaInvalid,
                  "first_observed_ns of node p1");
    ExpectRefused(with([&](Node* n) { n->last_observed_ns = limit_ns; }), Reason::kDeltaInvalid,
                  "last_observed_ns of node p1");
  }
  ExpectRefused(with([](Node* n) { n->observation_count = -1; }), Reason::kDeltaInvalid,
                "observation_count of node p1 is -1");
  ExpectRefused(with([](Node* n) {
                  n->object = ObjectInfo{.size = {1, -2, 1}};
                }),
                Reason::kDeltaInvalid, "an edge length of node p1 is -2");
  ExpectRefused(with([](Node* n) { n->place = PlaceInfo{.basis_point_count = -3}; }),
                Reason::kDeltaInvalid, "basis_point_count of node p1 is -3");
}

TEST(CheckDelta, RefusesTimesFarFromTheMap) {
  constexpr TimeNs kFarNs = 1000 + kObservedFarMaxNs;
  const auto observed = [](TimeNs time_ns) {
    return [=](GraphDelta* d) {
      d->nodes = {Place(1, 1)};
      d->nodes[0].last_observed_ns = time_ns;
    };
  };
  EXPECT_TRUE(CheckDelta(With(observed(kFarNs)), SmallGraph()).ok());
  EXPECT_TRUE(CheckDelta(With(observed(-kObservedFarMaxNs)), SmallGraph()).ok());
  for (const TimeNs time_ns : {kFarNs + 1, -kObservedFarMaxNs - 1, kTimeMax - 1, kTimeMin + 1}) {
    ExpectRefused(observed(time_ns), Reason::kTimeImplausible, "last_observed_ns of node p1");
  }
  ExpectRefused(
      [](GraphDelta* d) {
        d->appends = {{NodeId('H', 0), {TimedPose{2000}, TimedPose{kFarNs + 1}}}};
      },
      Reason::kTimeImplausible, "time of a pose of H0");
  ExpectRefused(
      [](GraphDelta* d) {
        d->stays = {{NodeId('H', 0), NodeId('p', 0), NodeId(), 5, kFarNs + 1}};
      },
      Reason::kTimeImplausible, "time of a stay of H0");
  // Records may tell when something came into the world.
  const auto valid_from = [](TimeNs from_ns) {
    return [=](GraphDelta* d) {
      d->nodes = {Place(1, 1)};
      d->nodes[0].valid.from_ns = from_ns;
    };
  };
  EXPECT_TRUE(CheckDelta(With(valid_from(-5 * kObservedFarMaxNs)), SmallGraph()).ok());
  ExpectRefused(valid_from(kTimeMin + 1), Reason::kTimeImplausible, "valid.from_ns of node p1");
  // Without poses a clock that is not UNIX may begin anywhere.
  SmallGraph empty;
  empty.span.reset();
  EXPECT_TRUE(CheckDelta(With(observed(kTimeMax - 1)), empty).ok());
}

// As if they had come one by one.
TEST(CheckDelta, RefusesAClockThatJumpsWithinTheFirstPoses) {
  SmallGraph empty;
  empty.span.reset();
  const auto poses = [](const std::vector<TimeNs>& times_ns) {
    return With([&](GraphDelta* d) {
      d->appends = {{NodeId('H', 0), {}}};
      for (const TimeNs time_ns : times_ns) d->appends[0].poses.push_back(TimedPose{time_ns});
    });
  };
  constexpr TimeNs kLateNs = 3 * kObservedFarMaxNs;
  const TimeNs second_ns = kLateNs + kObservedFarMaxNs;
  EXPECT_TRUE(CheckDelta(poses({kLateNs, kLateNs + 1, second_ns}), empty).ok());
  EXPECT_TRUE(CheckDelta(poses({kLateNs, second_ns, second_ns + kObservedFarMaxNs}), empty).ok());
  const absl::Status refused = CheckDelta(poses({kLateNs, kLateNs + 1, second_ns + 2}), empty);
  EXPECT_EQ(ReasonOf(refused), Reason::kTimeImplausible) << refused;
  EXPECT_TRUE(absl::StrContains(refused.message(), "time of a pose of H0")) << refused;
}

TEST(CheckDelta, RefusesARedefinedLayer) {
  ExpectRefused(
      [](GraphDelta* d) {
        d->layers = {{layers::kRooms, "rooms", 50}};
      },
      Reason::kDeltaInvalid, "cannot become");
}

}  // namespace
}  // namespace dsg
