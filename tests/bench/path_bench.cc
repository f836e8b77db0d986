// SPDX-License-Identifier: Apache-2.0
// Paths across W2: A* over all places, rooms first with landmarks, and Dijkstra without any guide
// on the same questions in the same run. Checks every length against Dijkstra's.
#include <algorithm>
#include <cmath>
#include <memory>
#include <queue>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "query/engine/planning/planner.h"
#include "query/engine/planning/planning_annex.h"
#include "query/view/place_graph.h"
#include "schema/base/check.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {
namespace {

using query::Anchor;
using query::Limits;
using query::PlaceGraph;
using query::PlaceIndex;

constexpr int kQuestionCount = 300;
// Dijkstra takes a second there.
constexpr int kQuestionCountOfLarger = 30;
// Across: at least half of the building's diagonal, by its side.
constexpr double kFarPerSide = 0.7;
constexpr double kRadiusM = 0.3;
constexpr double kStretchMax = 1.05;
constexpr double kFlatMsMax = 20.0;
constexpr double kFasterMin = 5.0;
constexpr char kMap[] = "w2";
constexpr size_t kCommitSize = 100'000;

// W2 from a store, as a service would have it.
absl::StatusOr<std::shared_ptr<const query::GraphView>> OpenW2(const std::string& folder,
                                                               const W2Size& size) {
  StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kMap;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kMap));
  GraphDelta delta = W2Graph(size);
  delta.map = kMap;
  delta.session_id = "path_bench";
  delta.sequence = 1;
  for (GraphDelta& part : SplitDelta(std::move(delta), kCommitSize)) {
    DSG_RETURN_IF_ERROR(writer->Commit(std::move(part)).status());
  }
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
  DSG_ASSIGN_OR_RETURN(const auto snapshot, map->Latest());
  return query::GraphView::Load(*snapshot, std::make_shared<query::SymbolTable>(), {});
}

// The rival: what one writes without thinking of goals. Metres, infinite if there is no way.
double Dijkstra(const PlaceGraph& graph, const Limits& limits, PlaceIndex from, PlaceIndex to) {
  using Entry = std::pair<double, PlaceIndex>;
  std::vector<double> way_m(static_cast<size_t>(graph.size()), HUGE_VAL);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  if (limits.Admits(graph, from) && limits.Admits(graph, to)) queue.push({0.0, from});
  while (!queue.empty()) {
    const auto [here_m, place] = queue.top();
    queue.pop();
    if (here_m >= way_m[static_cast<size_t>(place)]) continue;
    way_m[static_cast<size_t>(place)] = here_m;
    if (place == to) return here_m;
    for (const auto* link = graph.links_begin(place); link != graph.links_end(place); ++link) {
      if (!limits.Admits(*link) || !limits.Admits(graph, link->to)) continue;
      queue.push({here_m + link->length_m, link->to});
    }
  }
  return HUGE_VAL;
}

struct Totals {
  Samples flat;
  Samples hierarchical;
  Samples dijkstra;
  std::vector<double> stretch;
  int64_t flat_expanded_count = 0;
  int64_t hierarchical_expanded_count = 0;
};

absl::Status AskOne(const PlaceGraph& graph, const Limits& limits, PlaceIndex from, PlaceIndex to,
                    Totals* totals) {
  const std::vector<Anchor> start = {{from, 0.0, {}}};
  const std::vector<Anchor> goal = {{to, 0.0, {}}};
  absl::StatusOr<query::PlanResult> flat;
  absl::StatusOr<query::PlanResult> hierarchical;
  double shortest_m = 0.0;
  totals->flat.Add(NanosecondsOf([&] { flat = PlanFlat(graph, limits, start, goal, {}); }));
  totals->hierarchical.Add(
      NanosecondsOf([&] { hierarchical = PlanHierarchical(graph, limits, start, goal, {}); }));
  totals->dijkstra.Add(NanosecondsOf([&] { shortest_m = Dijkstra(graph, limits, from, to); }));
  DSG_RETURN_IF_ERROR(flat.status());
  DSG_RETURN_IF_ERROR(hierarchical.status());
  totals->flat_expanded_count += flat->expanded_count;
  totals->hierarchical_expanded_count += hierarchical->expanded_count;
  const bool found = std::isfinite(shortest_m);
  if (flat->route.has_value() != found || hierarchical->route.has_value() != found) {
    return absl::DataLossError("one found a way and another did not");
  }
  if (!found) return absl::OkStatus();
  if (std::abs(flat->route->way_m - shortest_m) > 1e-6) {
    return absl::DataLossError("A* did not find the shortest way");
  }
  totals->stretch.push_back(hierarchical->route->way_m / shortest_m);
  return absl::OkStatus();
}

double Percentile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(fraction * static_cast<double>(values.size() - 1))];
}

absl::Status AskFarPairs(const PlaceGraph& graph, const W2Size& size, const Limits& limits,
                         const std::string& what, bool has_targets, Report* report) {
  const auto target = [has_targets](Target::Kind kind, double value) {
    return has_targets ? Target{kind, value} : Target{};
  };
  Random random(20240611, 1);
  const double far_m = kFarPerSide * size.side_m();
  const int question_count =
      size.side_count > kW2SideCount ? kQuestionCountOfLarger : kQuestionCount;
  Totals totals;
  for (int i = 0; i < question_count;) {
    const PlaceIndex from = random.Index(graph.size());
    const PlaceIndex to = random.Index(graph.size());
    if ((graph.position_map(from) - graph.position_map(to)).norm() < far_m) continue;
    DSG_RETURN_IF_ERROR(AskOne(graph, limits, from, to, &totals));
    ++i;
  }
  const Rival dijkstra{"Dijkstra", Milliseconds(totals.dijkstra)};
  report->Line(absl::StrCat(what, ", flat"), "ms", Milliseconds(totals.flat), dijkstra,
               target(Target::Kind::kAtMost, kFlatMsMax));
  report->Line(absl::StrCat(what, ", hierarchical"), "ms", Milliseconds(totals.hierarchical),
               Rival{"flat", Milliseconds(totals.flat)},
               target(Target::Kind::kFasterAtLeast, kFasterMin));
  report->Line(absl::StrCat(what, ", hierarchical length over shortest, p99"), "",
               {Percentile(totals.stretch, 0.99), {}}, {}, {Target::Kind::kAtMost, kStretchMax});
  report->Note(absl::StrCat(
      what, ": ", totals.stretch.size(), " of ", question_count, " have a way; length median ",
      Percentile(totals.stretch, 0.5), ", longest ", Percentile(totals.stretch, 1.0),
      "; places looked at ", totals.flat_expanded_count / question_count, " flat, ",
      totals.hierarchical_expanded_count / question_count, " hierarchical on average"));
  return absl::OkStatus();
}

// Every third row of places is closed but for one gap at alternating ends, so that nothing known
// from afar tells the way.
std::vector<uint8_t> Meander(const PlaceGraph& graph, const W2Size& size) {
  std::vector<uint8_t> blocked;
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    const int column = place % size.side_count;
    const int row = place / size.side_count % size.side_count;
    const bool is_gap = row / 10 % 2 == 0 ? column < 3 : column >= size.side_count - 3;
    blocked.push_back(row % 10 == 5 && !is_gap ? 1 : 0);
  }
  return blocked;
}

// A diagonal of rooms: nine of W2's hundred.
std::vector<uint8_t> DiagonalRooms(const PlaceGraph& graph, const W2Size& size) {
  const auto step = static_cast<uint64_t>(size.rooms_per_side() + 1);
  std::vector<uint8_t> blocked;
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    blocked.push_back(graph.room(place).index() % step == 5 ? 1 : 0);
  }
  return blocked;
}

absl::Status Run(const CommonOptions& common, const W2Size& size, Report* report) {
  const bool has_targets = size.side_count == kW2SideCount;
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "paths"));
  DSG_ASSIGN_OR_RETURN(const auto view, OpenW2(folder->path(), size));
  std::shared_ptr<const PlaceGraph> graph;
  Samples making;
  for (int i = 0; i < 7; ++i) {
    making.Add(NanosecondsOf([&] { graph = *PlaceGraph::Build(*view, {}); }));
  }
  report->Line(absl::StrCat("arrays of ", graph->size(), " places from the view"), "ms",
               Milliseconds(making), {},
               has_targets ? Target{Target::Kind::kAtMost, 50.0} : Target{});
  const size_t plain_bytes = graph->memory_bytes();
  Limits limits;
  limits.radius_m = kRadiusM;
  Samples first;
  Samples landmarks;
  first.Add(NanosecondsOf([&] { DSG_CHECK(query::PlanningAnnex::Of(*graph, {}).ok()); }));
  absl::Status built;
  landmarks.Add(NanosecondsOf([&] {
    built = (*query::PlanningAnnex::Of(*graph, {}))->landmarks().Get(*graph, limits, {}).status();
  }));
  DSG_RETURN_IF_ERROR(built);
  report->Line("rooms and cells, once a graph", "ms", Milliseconds(first), {}, {});
  report->Line("landmarks, once a graph and class of radius", "ms", Milliseconds(landmarks), {},
               {});
  report->Note(absl::StrCat("memory: places and links ", plain_bytes / 1'000'000,
                            " MB, with rooms, ", "cells and one set of landmarks ",
                            graph->memory_bytes() / 1'000'000, " MB"));
  DSG_RETURN_IF_ERROR(
      AskFarPairs(*graph, size, limits, "across the building", has_targets, report));
  limits.blocked = DiagonalRooms(*graph, size);
  DSG_RETURN_IF_ERROR(
      AskFarPairs(*graph, size, limits, "a diagonal of rooms blocked", has_targets, report));
  limits.blocked = Meander(*graph, size);
  return AskFarPairs(*graph, size, limits, "blocked to a meander", false, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  CLI::App app("Paths across W2's building.", "path_bench");
  int64_t node_count = dsg::bench::kW2NodeCount;
  app.add_option("--scale", node_count, "About so many nodes in place of W2's; without targets")
      ->check(CLI::Range(int64_t{1000}, int64_t{20'000'000}));
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(common, dsg::bench::W2Size::OfNodes(node_count), report);
      });
}
