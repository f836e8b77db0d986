// SPDX-License-Identifier: Apache-2.0
// Collision checks in process, each with a world of its own as a question makes it: spheres against
// the objects of W2, and against a mesh: that of a map that is given, or else the sides of the same
// boxes. Beside them, in the same run, FCL, and looking at every box and triangle.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "query/engine/collision/collision_world.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/collision_duel.h"
#include "tests/bench/collision_maps.h"
#include "tests/bench/fcl_rival.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"

namespace dsg::bench {
namespace {

using query::Body;
using query::CollisionCache;
using query::CollisionScope;
using query::CollisionWorld;
using query::Convex;
using query::GraphView;

constexpr int kQuestionCount = 2'000;
constexpr int kSlowQuestionCount = 100;
constexpr double kSameM = 1e-6;

struct Flags {
  std::string store;
  std::string map = "map";
};

absl::StatusOr<OpenMap> Open(GraphStore* store, const std::string& map) {
  DSG_ASSIGN_OR_RETURN(const auto reader, store->OpenMap(map));
  OpenMap open;
  DSG_ASSIGN_OR_RETURN(open.snapshot, reader->Latest());
  DSG_ASSIGN_OR_RETURN(
      open.view,
      GraphView::Load(*open.snapshot, std::make_shared<query::SymbolTable>(), StopCheck()));
  return open;
}

// What the rival looks at: everything that the scope holds.
absl::StatusOr<std::vector<Convex>> AllShapes(const OpenMap& open, bool mesh) {
  std::vector<Convex> shapes;
  open.view->ForEachInLayer(layers::kObjects, [&](const query::ViewNode& node) {
    if (!mesh) shapes.push_back(query::MakeBox(node.map_T_node, node.box_node));
    return true;
  });
  if (!mesh) return shapes;
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, open.snapshot->MeshBlocks());
  for (const BlockIndex& index : blocks) {
    DSG_ASSIGN_OR_RETURN(const MeshBlock block, open.snapshot->ReadMeshBlock(index));
    const query::MeshPiece piece = query::MakePiece(block);
    for (int i = 0; i < piece.tree.face_count(); ++i) shapes.push_back(piece.tree.Triangle(i));
  }
  return shapes;
}

double SlowClearance(const Eigen::Vector3d& center, const std::vector<Convex>& shapes,
                     double clearance_m_max) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const Convex& shape : shapes) {
    nearest_m = std::min(nearest_m, (query::NearestPoint(shape, center) - center).norm());
  }
  return std::min(std::max(0.0, nearest_m - kSphereRadiusM), clearance_m_max);
}

std::unique_ptr<FclRival> MakeRival(const OpenMap& open, const std::vector<Convex>& shapes,
                                    bool mesh) {
  if (mesh) {
    std::vector<Eigen::Vector3d> corners;
    for (const Convex& triangle : shapes) {
      corners.insert(corners.end(), triangle.corners.begin(), triangle.corners.begin() + 3);
    }
    return FclRival::OfTriangles(corners);
  }
  std::vector<PosedBox> boxes;
  open.view->ForEachInLayer(layers::kObjects, [&](const query::ViewNode& node) {
    boxes.push_back({node.map_T_node, node.box_node});
    return true;
  });
  return FclRival::OfBoxes(boxes);
}

std::vector<Eigen::Vector3d> Centers(const Box3d& box) {
  Random random(1, 0);
  std::vector<Eigen::Vector3d> centers;
  for (int i = 0; i < kQuestionCount; ++i) {
    centers.emplace_back(random.Uniform(box.min().x(), box.max().x()),
                         random.Uniform(box.min().y(), box.max().y()),
                         random.Uniform(box.min().z(), box.max().z()));
  }
  return centers;
}

// Ours must be what looking at all gives; FCL's may be off, which is noted.
absl::StatusOr<Samples> CompareAnswers(const std::string& what, const Asked& asked,
                                       const std::vector<Eigen::Vector3d>& centers,
                                       const std::vector<Convex>& shapes, double clearance_m_max,
                                       Report* report) {
  Samples slow;
  for (size_t i = 0; i < kSlowQuestionCount; ++i) {
    double clearance_m = 0.0;
    slow.Add(
        NanosecondsOf([&] { clearance_m = SlowClearance(centers[i], shapes, clearance_m_max); }));
    if (std::abs(clearance_m - asked.clearances_m[i]) > kSameM) {
      return absl::DataLossError(absl::StrCat(what, ": clearance ", asked.clearances_m[i],
                                              " m, looking at all gives ", clearance_m, " m"));
    }
  }
  double worst_m = 0.0;
  for (size_t i = 0; i < centers.size(); ++i) {
    worst_m = std::max(worst_m, std::abs(asked.clearances_m[i] - asked.fcl_clearances_m[i]));
  }
  report->Note(absl::StrCat(what, ": ", shapes.size(), " boxes or triangles, ", asked.hit_count,
                            " of ", centers.size(), " hit (FCL: ", asked.other_hit_count,
                            "), FCL's clearances differ by at most ", worst_m, " m"));
  return slow;
}

absl::Status CheckPoints(const std::string& what, const OpenMap& open, const Box3d& box,
                         const CollisionScope& scope, const Target& target, Report* report) {
  DSG_ASSIGN_OR_RETURN(const std::vector<Convex> shapes, AllShapes(open, scope.mesh));
  if (shapes.empty()) return absl::InvalidArgumentError(absl::StrCat(what, ": nothing is there"));
  std::unique_ptr<FclRival> rival;
  const int64_t build_ns = NanosecondsOf([&] { rival = MakeRival(open, shapes, scope.mesh); });
  Duel duel(open, scope, rival.get());
  const std::vector<Eigen::Vector3d> centers = Centers(box);
  const int64_t first_ns = NanosecondsOf([&] { duel.AskOurs(centers[0]).IgnoreError(); });
  DSG_ASSIGN_OR_RETURN(const Asked asked, duel.AskBoth(centers));
  DSG_ASSIGN_OR_RETURN(const Samples slow,
                       CompareAnswers(what, asked, centers, shapes, scope.clearance_m_max, report));
  report->Note(absl::StrCat(what, ": our first question ", first_ns / 1'000'000, " ms, FCL's tree ",
                            build_ns / 1'000'000, " ms, ", duel.cache().stats().bytes >> 20,
                            " MiB of our triangle trees"));
  report->Line(what, "us", Microseconds(asked.ours), Rival{"FCL distance", Microseconds(asked.fcl)},
               target);
  report->Line(what + ", hit or not", "us", Microseconds(asked.ours_touch),
               Rival{"FCL collide", Microseconds(asked.fcl_touch)}, {});
  report->Line(what, "us", Microseconds(asked.ours), Rival{"look at all", Microseconds(slow)}, {});
  return absl::OkStatus();
}

absl::Status CheckWays(const OpenMap& open, const CollisionScope& scope, Report* report) {
  CollisionCache cache;
  Random random(2, 0);
  Samples ours;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d from(random.Uniform(0, 49), random.Uniform(0, 49), 6.0);
    const Eigen::Vector3d to(random.Uniform(0, 49), random.Uniform(0, 49), 6.0);
    const Body body =
        query::SweptSphere(kSphereRadiusM, {from, from + (to - from).normalized() * 10.0});
    absl::Status status;
    ours.Add(NanosecondsOf([&] {
      CollisionWorld world = CollisionWorld::Create(open.view, open.snapshot, std::nullopt, &cache);
      status = world.Check(body, scope, StopCheck()).status();
    }));
    DSG_RETURN_IF_ERROR(status);
  }
  report->Line("sphere swept 10 m above the objects", "us", Microseconds(ours), std::nullopt, {});
  return absl::OkStatus();
}

absl::Status MeasureW2(const std::string& folder, Report* report) {
  DSG_RETURN_IF_ERROR(MakeCollisionMaps(folder));
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const OpenMap open, Open(store.get(), kW2Map));
  CollisionScope scope;
  scope.structures = scope.mesh = scope.agents = false;
  const Box3d box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(49.4, 49.4, 4.4));
  DSG_RETURN_IF_ERROR(CheckPoints("sphere among the objects of W2", open, box, scope,
                                  {Target::Kind::kAtMost, 10.0}, report));
  DSG_RETURN_IF_ERROR(CheckWays(open, scope, report));
  DSG_ASSIGN_OR_RETURN(const OpenMap mesh, Open(store.get(), kW2MeshMap));
  std::swap(scope.objects, scope.mesh);
  return CheckPoints("sphere among the sides of these as a mesh", mesh, box, scope, {}, report);
}

absl::Status MeasureMesh(const Flags& flags, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(flags.store, {}));
  DSG_ASSIGN_OR_RETURN(const OpenMap open, Open(store.get(), flags.map));
  Box3d box;
  open.view->ForEachInLayer(layers::kRooms, [&](const query::ViewNode& room) {
    box.extend(room.BoxMap());
    return true;
  });
  if (box.isEmpty()) return absl::InvalidArgumentError("the map has no rooms to ask about");
  CollisionScope scope;
  scope.objects = scope.structures = scope.agents = false;
  return CheckPoints(absl::StrCat("sphere in the mesh of ", flags.map), open, box, scope, {},
                     report);
}

absl::Status Run(const CommonOptions& options, const Flags& flags, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(options.folder, "collision"));
  DSG_RETURN_IF_ERROR(MeasureW2(folder->path(), report));
  return flags.store.empty() ? absl::OkStatus() : MeasureMesh(flags, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  CLI::App app("Collision checks beside FCL and looking at all.", "collision_bench");
  dsg::bench::Flags flags;
  app.add_option("--store", flags.store, "a store with a map that has a mesh");
  app.add_option("--map", flags.map, "its name");
  return dsg::bench::RunBenchmark(&app, argc, argv, [&](const auto& options, auto* report) {
    return dsg::bench::Run(options, flags, report);
  });
}
