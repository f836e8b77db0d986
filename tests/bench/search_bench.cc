// SPDX-License-Identifier: Apache-2.0
// Searches on W2 from the indexes of a view, each beside the scan that a user would write over the
// same view, with answers compared.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/engine/search/query_language.h"
#include "query/engine/search/search_run.h"
#include "query/engine/search/words.h"
#include "query/view/graph_view.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {
namespace {

using query::GraphView;
using query::HitKey;
using query::ViewNode;

constexpr char kMap[] = "w2";
constexpr int kQuestionCount = 200;
constexpr int kNearestCount = 10;
constexpr size_t kCommitSize = 100'000;

absl::StatusOr<std::shared_ptr<const Snapshot>> StoreW2(const std::string& folder,
                                                        const W2Size& size,
                                                        std::unique_ptr<GraphStore>* store) {
  StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(*store, GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kMap;
  DSG_RETURN_IF_ERROR((*store)->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(const auto writer, (*store)->OpenWriter(kMap));
  GraphDelta graph = W2Graph(size);
  NameW2Classes(&graph);
  graph.map = kMap;
  graph.session_id = "bench";
  graph.sequence = 1;
  for (GraphDelta& part : SplitDelta(std::move(graph), kCommitSize)) {
    DSG_RETURN_IF_ERROR(writer->Commit(std::move(part)).status());
  }
  DSG_ASSIGN_OR_RETURN(const auto map, (*store)->OpenMap(kMap));
  return map->Latest();
}

// The scan: every node, what fits kept in order.
std::vector<HitKey> Scan(const GraphView& view, size_t limit,
                         const std::function<std::optional<double>(const ViewNode&)>& distance_m) {
  std::vector<HitKey> found;
  view.ForEachNode(NodeId(), [&](const ViewNode& node) {
    if (const auto distance = distance_m(node)) found.push_back({*distance, node.id});
    return true;
  });
  const auto end = found.begin() + static_cast<std::ptrdiff_t>(std::min(limit, found.size()));
  std::partial_sort(found.begin(), end, found.end());
  found.erase(end, found.end());
  return found;
}

class Measurement {
 public:
  Measurement(const GraphView& view, const Snapshot& snapshot) : view_(view), snapshot_(snapshot) {}

  /// Times one search, from the pattern to the hits, and one scan; compares.
  absl::Status Ask(const query::NodePattern& pattern, query::SearchQuestion question,
                   const std::function<std::optional<double>(const ViewNode&)>& distance_m) {
    absl::StatusOr<query::SearchAnswer> answer = absl::InternalError("not asked");
    absl::Status status;
    ours.Add(NanosecondsOf([&] {
      absl::StatusOr<query::Pattern> resolved = ResolvePattern(pattern, view_, &snapshot_, {});
      status = resolved.status();
      if (!status.ok()) return;
      question.pattern = *resolved;
      answer = RunSearch(view_, question, {});
    }));
    DSG_RETURN_IF_ERROR(status);
    DSG_RETURN_IF_ERROR(answer.status());
    std::vector<HitKey> expected;
    scan.Add(NanosecondsOf(
        [&] { expected = Scan(view_, static_cast<size_t>(question.limit), distance_m); }));
    std::vector<HitKey> found;
    for (const query::Hit& hit : answer->hits) found.push_back(hit.key);
    hit_count += static_cast<int64_t>(found.size());
    if (found == expected) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat(FormatQuery(pattern), " finds ", found.size(),
                                            " nodes, the scan ", expected.size(),
                                            ", or others than it"));
  }

  Samples ours;
  Samples scan;
  int64_t hit_count = 0;

 private:
  const GraphView& view_;
  const Snapshot& snapshot_;
};

// What W2 itself must reach; larger graphs only show how things grow.
Target AtMost(const W2Size& size, double value) {
  return size.side_count == kW2SideCount ? Target{Target::Kind::kAtMost, value} : Target{};
}

Eigen::Vector3d RandomPoint(const W2Size& size, Random* random) {
  const double x = random->Uniform(0, size.side_m());
  const double y = random->Uniform(0, size.side_m());
  return {x, y, random->Uniform(0, 5)};
}

absl::Status MeasureNearest(const GraphView& view, const Snapshot& snapshot, const W2Size& size,
                            LayerId layer, const std::string& what, Report* report) {
  Random random(42, 11);
  // The most frequent class; where the layer has none, the layer.
  std::pair<query::Symbol, int64_t> most{0, 0};
  for (const auto& [symbol, count] : view.ClassesOf(layer)) {
    if (symbol != 0 && count > most.second) most = {symbol, count};
  }
  query::NodePattern pattern;
  if (most.first != 0) pattern.class_name = view.symbols().Text(most.first);
  for (const Layer& known : view.layers()) {
    if (known.id == layer) pattern.layer = known.name;
  }
  Measurement measured(view, snapshot);
  for (int i = 0; i < kQuestionCount; ++i) {
    query::SearchQuestion question;
    const Eigen::Vector3d point = RandomPoint(size, &random);
    question.near_map = point;
    question.limit = kNearestCount;
    DSG_RETURN_IF_ERROR(
        measured.Ask(pattern, question, [&](const ViewNode& node) -> std::optional<double> {
          if (node.layer != layer) return std::nullopt;
          if (most.first != 0 && node.class_name != most.first) return std::nullopt;
          return node.DistanceTo(point);
        }));
  }
  report->Line(absl::StrCat(what, " (", FormatQuery(pattern), ")"), "us",
               Microseconds(measured.ours), Rival{"scan of the view", Microseconds(measured.scan)},
               AtMost(size, 50.0));
  return absl::OkStatus();
}

absl::Status MeasureContents(const GraphView& view, const Snapshot& snapshot, const W2Size& size,
                             Report* report) {
  std::vector<NodeId> rooms;
  view.ForEachInLayer(layers::kRooms, [&](const ViewNode& room) {
    rooms.push_back(room.id);
    return true;
  });
  std::sort(rooms.begin(), rooms.end());
  Measurement measured(view, snapshot);
  for (int i = 0; i < kQuestionCount; ++i) {
    const NodeId room = rooms[static_cast<size_t>(i) % rooms.size()];
    DSG_ASSIGN_OR_RETURN(const query::NodePattern pattern,
                         query::ParseQuery("object inside " + ToString(room)));
    query::SearchQuestion question;
    question.limit = 1000;
    DSG_RETURN_IF_ERROR(
        measured.Ask(pattern, question, [&](const ViewNode& node) -> std::optional<double> {
          if (node.layer != layers::kObjects) return std::nullopt;
          const std::vector<NodeId> above = view.Ancestors(node.id);
          const bool is_inside = std::find(above.begin(), above.end(), room) != above.end();
          return is_inside ? std::optional<double>(0.0) : std::nullopt;
        }));
  }
  report->Line(absl::StrCat("objects inside a room (", measured.hit_count / kQuestionCount,
                            " of a room's thousand places)"),
               "ms", Milliseconds(measured.ours),
               Rival{"scan of the view", Milliseconds(measured.scan)}, AtMost(size, 1.0));
  return absl::OkStatus();
}

absl::Status MeasureNames(const GraphView& view, const Snapshot& snapshot, const W2Size& size,
                          Report* report) {
  Random random(42, 12);
  Measurement measured(view, snapshot);
  for (int i = 0; i < kQuestionCount; ++i) {
    query::NodePattern pattern;
    pattern.name = absl::StrCat("OBJECT_", random.Index(size.object_count()));
    query::SearchQuestion question;
    question.limit = kNearestCount;
    const query::NameMatcher matcher(pattern.name);
    DSG_RETURN_IF_ERROR(
        measured.Ask(pattern, question, [&](const ViewNode& node) -> std::optional<double> {
          if (node.name == 0 || !matcher.Matches(view.symbols().Text(node.name))) {
            return std::nullopt;
          }
          return 0.0;
        }));
  }
  report->Line("object of a name, letter case ignored", "us", Microseconds(measured.ours),
               Rival{"scan of the view", Microseconds(measured.scan)}, AtMost(size, 50.0));
  return absl::OkStatus();
}

absl::Status Run(const CommonOptions& common, const W2Size& size, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "search"));
  std::unique_ptr<GraphStore> store;
  DSG_ASSIGN_OR_RETURN(const auto snapshot, StoreW2(folder->path(), size, &store));
  ShowProgress("stored");
  DSG_ASSIGN_OR_RETURN(const auto view,
                       GraphView::Load(*snapshot, std::make_shared<query::SymbolTable>(), {}));
  ShowProgress("loaded");
  report->Note(absl::StrCat(view->node_count(), " nodes, ", view->edge_count(),
                            " edges; from the pattern to the ids of the hits"));
  DSG_RETURN_IF_ERROR(
      MeasureNearest(*view, *snapshot, size, layers::kObjects, "10 nearest objects", report));
  DSG_RETURN_IF_ERROR(
      MeasureNearest(*view, *snapshot, size, layers::kPlaces, "10 nearest places", report));
  DSG_RETURN_IF_ERROR(MeasureNames(*view, *snapshot, size, report));
  return MeasureContents(*view, *snapshot, size, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  CLI::App app("Searches on W2: 120,101 nodes and 418,099 edges.", "search_bench");
  int64_t node_count = dsg::bench::kW2NodeCount;
  app.add_option("--scale", node_count, "About so many nodes in place of W2's; without targets")
      ->check(CLI::Range(int64_t{1000}, int64_t{20'000'000}));
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(common, dsg::bench::W2Size::OfNodes(node_count), report);
      });
}
