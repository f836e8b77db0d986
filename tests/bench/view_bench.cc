// SPDX-License-Identifier: Apache-2.0
// W2 as a graph in memory: opening, bytes, a changed revision, and the questions that indexes
// answer, each beside a plain scan of the same run.
#include <malloc.h>

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <unordered_map>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "query/view/indexed_view.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/child_process.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {
namespace {

using query::GraphView;
using query::IndexedView;
using query::SpaceFilter;
using query::SymbolTable;
using query::ViewNode;
using ViewPtr = std::shared_ptr<const GraphView>;

constexpr char kMap[] = "w2";
constexpr size_t kCommitSize = 100'000;
constexpr int kQuestionCount = 2'000;
constexpr int kOpenCount = 7;
constexpr int kRevisionCount = 30;
constexpr int kChangeCount = 500;
constexpr int kNeighbourCount = 10;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What W2 itself must reach; larger graphs only show how things grow.
Target AtMost(const W2Size& size, double value) {
  return size.side_count == kW2SideCount ? Target{Target::Kind::kAtMost, value} : Target{};
}

Eigen::Vector3d RandomPoint(const W2Size& size, Random* random) {
  const double x = random->Uniform(0, size.side_m());
  const double y = random->Uniform(0, size.side_m());
  return {x, y, random->Uniform(0, 5)};
}

absl::Status Commit(GraphDelta delta, const std::string& session, int64_t sequence,
                    GraphWriter* writer) {
  delta.map = kMap;
  delta.session_id = session;
  delta.sequence = sequence;
  for (GraphDelta& part : SplitDelta(std::move(delta), kCommitSize)) {
    DSG_RETURN_IF_ERROR(writer->Commit(std::move(part)).status());
  }
  return absl::OkStatus();
}

absl::Status MakeMap(GraphDelta graph, const std::string& folder) {
  StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kMap;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kMap));
  return Commit(std::move(graph), "graph", 1, writer.get());
}

size_t BytesInUse() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

absl::StatusOr<ViewPtr> MeasureOpening(const std::string& folder, const W2Size& size,
                                       Report* report) {
  // Seconds each at ten times the size.
  const int open_count = size.side_count == kW2SideCount ? kOpenCount : 3;
  Samples cold;
  Samples cold_cpu;
  Samples warm;
  Samples warm_cpu;
  ViewPtr view;
  size_t bytes = 0;
  for (int i = 0; i < 2 * open_count; ++i) {
    const bool is_cold = i < open_count;
    view.reset();
    if (is_cold) EvictFromPageCache(folder);
    absl::StatusOr<ViewPtr> loaded = absl::InternalError("not loaded");
    const size_t before = BytesInUse();
    const auto load = [&]() -> absl::Status {
      DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
      DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
      DSG_ASSIGN_OR_RETURN(const auto snapshot, map->Latest());
      loaded = GraphView::Load(*snapshot, std::make_shared<SymbolTable>(), {});
      return loaded.status();
    };
    absl::Status status;
    const int64_t cpu_before_ns = ThreadCpuNs();
    (is_cold ? cold : warm).Add(NanosecondsOf([&] { status = load(); }));
    (is_cold ? cold_cpu : warm_cpu).Add(ThreadCpuNs() - cpu_before_ns);
    DSG_RETURN_IF_ERROR(status);
    view = *std::move(loaded);
    bytes = BytesInUse() - before;
  }
  report->Line("view opened, files not in memory", "ms", Milliseconds(cold),
               Rival{"its processor time", Milliseconds(cold_cpu)}, AtMost(size, 1000.0));
  report->Line("view opened, files in memory", "ms", Milliseconds(warm),
               Rival{"its processor time", Milliseconds(warm_cpu)}, {});
  const auto nodes = static_cast<double>(view->node_count());
  const auto edges = static_cast<double>(view->edge_count());
  const size_t of_edges = static_cast<const IndexedView&>(*view).parts().edges().memory_bytes();
  const size_t of_nodes = view->memory_bytes() - of_edges + view->symbols().memory_bytes();
  report->Line("memory of a node, names included", "B", {static_cast<double>(of_nodes) / nodes, {}},
               {}, AtMost(size, 400.0));
  report->Line("memory of an edge", "B", {static_cast<double>(of_edges) / edges, {}}, {},
               AtMost(size, 60.0));
  report->Line("all of it, as counted", "MB", {static_cast<double>(of_nodes + of_edges) * 1e-6, {}},
               Rival{"as the allocator says", {static_cast<double>(bytes) * 1e-6, {}}}, {});
  return view;
}

// A revision of 500 objects that moved.
GraphDelta ChangedObjects(const GraphDelta& graph, int round, Random* random) {
  GraphDelta delta;
  std::vector<const Node*> objects;
  for (const Node& node : graph.nodes) {
    if (node.layer == layers::kObjects) objects.push_back(&node);
  }
  for (int i = 0; i < kChangeCount; ++i) {
    // One of each stretch of objects, so that each is another.
    const int stretch = static_cast<int>(objects.size()) / kChangeCount;
    const auto at = static_cast<size_t>(i * stretch + random->Index(stretch));
    Node node = *objects[at];
    // Smaller, so that it stays inside the box of its place.
    node.map_T_node.position += Eigen::Vector3d(0.1, -0.1, 0.0);
    node.box_node = Box3d(0.5 * node.box_node.min(), 0.5 * node.box_node.max());
    node.observation_count += round;
    delta.nodes.push_back(std::move(node));
  }
  return delta;
}

absl::StatusOr<ViewPtr> MeasureRevisions(const GraphDelta& graph, const std::string& folder,
                                         const W2Size& size, ViewPtr view, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kMap));
  Random random(42, 4);
  Samples forwards;
  Samples forwards_cpu;
  Samples backwards;
  size_t fresh_bytes = 0;
  for (int i = 0; i < kRevisionCount; ++i) {
    DSG_RETURN_IF_ERROR(Commit(ChangedObjects(graph, i, &random), "changes", i + 1, writer.get()));
    DSG_ASSIGN_OR_RETURN(const auto before, map->At(view->revision()));
    DSG_ASSIGN_OR_RETURN(const auto after, map->Latest());
    absl::StatusOr<ViewPtr> next = absl::InternalError("not derived");
    absl::StatusOr<ViewPtr> back = absl::InternalError("not derived");
    const int64_t cpu_before_ns = ThreadCpuNs();
    forwards.Add(NanosecondsOf([&] { next = GraphView::Derive(view, map.get(), *after, {}); }));
    forwards_cpu.Add(ThreadCpuNs() - cpu_before_ns);
    DSG_RETURN_IF_ERROR(next.status());
    backwards.Add(NanosecondsOf([&] { back = GraphView::Derive(*next, map.get(), *before, {}); }));
    DSG_RETURN_IF_ERROR(back.status());
    view = *std::move(next);
    fresh_bytes = static_cast<const IndexedView&>(*view).fresh_bytes();
  }
  report->Line("revision of 500 changes applied", "ms", Milliseconds(forwards),
               Rival{"its processor time", Milliseconds(forwards_cpu)}, AtMost(size, 5.0));
  report->Line("the same taken back", "ms", Milliseconds(backwards), {}, {});
  report->Line("what it holds of its own", "MB", {static_cast<double>(fresh_bytes) * 1e-6, {}}, {},
               {});
  return view;
}

struct Scanned {
  NodeId id;
  LayerId layer;
  query::Symbol class_name;
  Box3d box_map;
};

std::vector<Scanned> AllNodes(const GraphView& view) {
  std::vector<Scanned> nodes;
  view.ForEachNode(NodeId(), [&](const ViewNode& node) {
    if (node.layer != layers::kAgents) {
      nodes.push_back({node.id, node.layer, node.class_name, node.BoxMap()});
    }
    return true;
  });
  return nodes;
}

std::vector<NodeId> ScanNearest(const std::vector<Scanned>& nodes, const Eigen::Vector3d& point,
                                const SpaceFilter& filter, size_t count) {
  std::vector<std::pair<double, NodeId>> found;
  for (const Scanned& node : nodes) {
    if (node.layer != *filter.layer) continue;
    if (filter.class_name.has_value() && node.class_name != *filter.class_name) continue;
    found.emplace_back(DistanceToBox(point, node.box_map), node.id);
  }
  count = std::min(count, found.size());
  std::partial_sort(found.begin(), found.begin() + static_cast<ptrdiff_t>(count), found.end());
  std::vector<NodeId> ids;
  for (size_t i = 0; i < count; ++i) ids.push_back(found[i].second);
  return ids;
}

absl::Status MeasureNearest(const GraphView& view, const W2Size& size, const std::string& what,
                            bool of_class, size_t count, double target_us, Report* report) {
  const std::vector<Scanned> nodes = AllNodes(view);
  Random random(42, 5);
  Samples ours;
  Samples scan;
  for (int i = 0; i < kQuestionCount; ++i) {
    const Eigen::Vector3d point = RandomPoint(size, &random);
    SpaceFilter filter;
    filter.layer = of_class ? layers::kObjects : layers::kPlaces;
    if (of_class) filter.class_name = view.symbols().Find(absl::StrCat("class_", i % 20));
    std::vector<NodeId> found;
    std::vector<NodeId> expected;
    ours.Add(NanosecondsOf([&] {
      view.ForEachNearest(point, filter, kInfinity, [&](const ViewNode& node, double) {
        found.push_back(node.id);
        return found.size() < count;
      });
    }));
    // A tenth of the questions: the scan is slow, and as slow every time.
    if (i % 10 != 0) continue;
    scan.Add(NanosecondsOf([&] { expected = ScanNearest(nodes, point, filter, count); }));
    if (found != expected) return absl::DataLossError(absl::StrCat(what, " differs from the scan"));
  }
  report->Line(what, "us", Microseconds(ours), Rival{"scan", Microseconds(scan)},
               AtMost(size, target_us));
  return absl::OkStatus();
}

absl::Status MeasureRoom(const GraphView& view, const GraphDelta& graph, const W2Size& size,
                         Report* report) {
  Random random(42, 6);
  Samples ours;
  Samples scan;
  std::unordered_map<NodeId, const Node*> by_id;
  for (const Node& node : graph.nodes) by_id[node.id] = &node;
  const int room_count = size.rooms_per_side() * size.rooms_per_side();
  for (int i = 0; i < 200; ++i) {
    const NodeId room('R', static_cast<uint64_t>(random.Index(room_count)));
    double sum = 0.0;
    double expected = 0.0;
    ours.Add(NanosecondsOf([&] {
      view.ForEachEdgeFrom(room, *view.symbols().Find(relations::kContains),
                           [&](const query::ViewEdge& edge) {
                             sum += view.FindNode(edge.target)->map_T_node.position.x();
                             return true;
                           });
    }));
    // A tenth of the questions: the scan is slow, and as slow every time.
    if (i % 10 != 0) continue;
    expected = 0.0;
    scan.Add(NanosecondsOf([&] {
      for (const Edge& edge : graph.edges) {
        if (edge.source != room || edge.relation != relations::kContains) continue;
        expected += by_id[edge.target]->map_T_node.position.x();
      }
    }));
    if (std::abs(sum - expected) > 1e-6) return absl::DataLossError("a room holds something else");
  }
  report->Line("contents of a room, 1,000 places", "us", Microseconds(ours),
               Rival{"scan of all edges", Microseconds(scan)}, AtMost(size, 1000.0));
  return absl::OkStatus();
}

// What a new version and a question would cost with the R-tree that most programs would take: its
// versions share nothing, so each is a copy.
void MeasureCopiedRtree(const GraphView& view, const W2Size& size, Report* report) {
  using Point = boost::geometry::model::point<double, 3, boost::geometry::cs::cartesian>;
  using Value = std::pair<boost::geometry::model::box<Point>, NodeId>;
  using Tree = boost::geometry::index::rtree<Value, boost::geometry::index::rstar<16>>;
  std::vector<Value> values;
  std::vector<Value> places;
  for (const Scanned& node : AllNodes(view)) {
    const auto point = [](const Eigen::Vector3d& p) { return Point(p.x(), p.y(), p.z()); };
    values.push_back({{point(node.box_map.min()), point(node.box_map.max())}, node.id});
    if (node.layer == layers::kPlaces) places.push_back(values.back());
  }
  const Tree tree(values.begin(), values.end());
  const Tree place_tree(places.begin(), places.end());
  Samples copies;
  for (int i = 0; i < 10; ++i) {
    std::optional<Tree> copy;
    copies.Add(NanosecondsOf([&] { copy.emplace(tree); }));
  }
  Random random(42, 5);
  Samples questions;
  size_t found_count = 0;
  for (int i = 0; i < kQuestionCount; ++i) {
    const Eigen::Vector3d p = RandomPoint(size, &random);
    const Point point(p.x(), p.y(), p.z());
    std::vector<Value> found;
    questions.Add(NanosecondsOf([&] {
      place_tree.query(boost::geometry::index::nearest(point, 1), std::back_inserter(found));
    }));
    found_count += found.size();
  }
  report->Line("for comparison: a copy of a Boost R-tree", "ms", Milliseconds(copies), {}, {});
  report->Line(absl::StrCat("and its nearest place, ", found_count, " times"), "us",
               Microseconds(questions), {}, {});
}

absl::Status Run(const CommonOptions& common, const W2Size& size, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "view"));
  GraphDelta graph = W2Graph(size);
  NameW2Classes(&graph);
  DSG_RETURN_IF_ERROR(MakeMap(graph, folder->path()));
  ShowProgress("map made");
  report->Note(absl::StrCat(graph.nodes.size(), " nodes, ", graph.edges.size(), " edges"));
  DSG_ASSIGN_OR_RETURN(ViewPtr view, MeasureOpening(folder->path(), size, report));
  DSG_RETURN_IF_ERROR(MeasureNearest(*view, size, "nearest place", false, 1, 20.0, report));
  DSG_RETURN_IF_ERROR(
      MeasureNearest(*view, size, "10 nearest of a class", true, kNeighbourCount, 50.0, report));
  DSG_RETURN_IF_ERROR(MeasureRoom(*view, graph, size, report));
  MeasureCopiedRtree(*view, size, report);
  DSG_ASSIGN_OR_RETURN(view,
                       MeasureRevisions(graph, folder->path(), size, std::move(view), report));
  return MeasureNearest(*view, size, "nearest place, after these revisions", false, 1, 20.0,
                        report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  CLI::App app("W2 as a graph in memory.", "view_bench");
  int64_t node_count = dsg::bench::kW2NodeCount;
  app.add_option("--scale", node_count, "About so many nodes in place of W2's; without targets")
      ->check(CLI::Range(int64_t{1000}, int64_t{20'000'000}));
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(common, dsg::bench::W2Size::OfNodes(node_count), report);
      });
}
