// SPDX-License-Identifier: Apache-2.0
#include "query/view/place_graph.h"

#include <algorithm>
#include <tuple>

#include "query/view/stoppable_sort.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Places or links between two questions to the stop check.
constexpr int64_t kStopPeriod = 1024;

bool ById(const PlaceGraph::Place& a, const PlaceGraph::Place& b) { return a.id < b.id; }

NodeId RoomOf(const GraphView& view, NodeId place) {
  for (const NodeId ancestor : view.Ancestors(place)) {
    const ViewNode* node = view.FindNode(ancestor);
    if (node != nullptr && node->layer == layers::kRooms) return ancestor;
  }
  return NodeId();
}

// Places of one parent follow each other in most maps, so its room need not be looked up again.
class RoomFinder {
 public:
  explicit RoomFinder(const GraphView& view) : view_(view) {}

  NodeId Find(NodeId place) {
    const NodeId parent = view_.Parent(place);
    if (parent.empty()) return NodeId();
    if (parent != parent_) {
      parent_ = parent;
      const ViewNode* node = view_.FindNode(parent);
      const bool is_room = node != nullptr && node->layer == layers::kRooms;
      room_ = is_room ? parent : RoomOf(view_, parent);
    }
    return room_;
  }

 private:
  const GraphView& view_;
  NodeId parent_;
  NodeId room_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<const PlaceGraph>> PlaceGraph::Build(const GraphView& view,
                                                                    const StopCheck& stop) {
  std::vector<Place> places;
  StopCounter counter(stop, kStopPeriod);
  absl::Status status;
  const std::optional<Symbol> kind = view.symbols().Find(kinds::kPlace);
  if (kind.has_value()) {
    view.ForEachInLayer(layers::kPlaces, [&](const ViewNode& node) {
      if (node.kind == *kind) {
        places.push_back(
            {node.id, node.map_T_node.position, node.clearance_m, node.valid, NodeId()});
      }
      status = counter.Check();
      return status.ok();
    });
  }
  DSG_RETURN_IF_ERROR(status);
  DSG_RETURN_IF_ERROR(SortStoppably(ById, stop, &places));
  RoomFinder rooms(view);
  std::vector<Passage> passages;
  const std::optional<Symbol> relation = view.symbols().Find(relations::kTraversable);
  for (Place& place : places) {
    DSG_RETURN_IF_ERROR(counter.Check());
    place.room = rooms.Find(place.id);
    if (!relation.has_value()) continue;
    view.ForEachEdgeFrom(place.id, *relation, [&](const ViewEdge& edge) {
      passages.push_back({edge.source, edge.target, edge.weight, edge.valid});
      return true;
    });
  }
  return Make(std::move(places), passages, stop);
}

std::shared_ptr<const PlaceGraph> PlaceGraph::Make(std::vector<Place> places,
                                                   const std::vector<Passage>& passages) {
  return *Make(std::move(places), passages, StopCheck());
}

absl::StatusOr<std::shared_ptr<const PlaceGraph>> PlaceGraph::Make(
    std::vector<Place> places, const std::vector<Passage>& passages, const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(SortStoppably(ById, stop, &places));
  auto graph = std::make_shared<PlaceGraph>();
  const size_t count = places.size();
  graph->ids_.reserve(count);
  graph->positions_map_.reserve(count);
  graph->clearances_m_.reserve(count);
  graph->valid_.reserve(count);
  graph->rooms_.reserve(count);
  StopCounter counter(stop, kStopPeriod);
  for (const Place& place : places) {
    DSG_RETURN_IF_ERROR(counter.Check());
    graph->ids_.push_back(place.id);
    graph->positions_map_.push_back(place.position_map);
    graph->clearances_m_.push_back(place.clearance_m);
    graph->valid_.push_back(place.valid);
    graph->rooms_.push_back(place.room);
  }
  DSG_RETURN_IF_ERROR(graph->MakeLinks(passages, stop));
  return graph;
}

absl::Status PlaceGraph::MakeLinks(const std::vector<Passage>& passages, const StopCheck& stop) {
  struct Ends {
    PlaceIndex a = -1;
    PlaceIndex b = -1;
  };
  StopCounter counter(stop, kStopPeriod);
  std::vector<Ends> ends(passages.size());
  offsets_.assign(ids_.size() + 1, 0);
  for (size_t i = 0; i < passages.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const std::optional<PlaceIndex> a = Find(passages[i].source);
    const std::optional<PlaceIndex> b = Find(passages[i].target);
    if (!a.has_value() || !b.has_value() || *a == *b) continue;
    ends[i] = {*a, *b};
    ++offsets_[static_cast<size_t>(*a) + 1];
    ++offsets_[static_cast<size_t>(*b) + 1];
  }
  for (size_t i = 1; i < offsets_.size(); ++i) offsets_[i] += offsets_[i - 1];
  links_.resize(offsets_.back());
  std::vector<uint32_t> next(offsets_.begin(), offsets_.end() - 1);
  for (size_t i = 0; i < passages.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const auto [a, b] = ends[i];
    if (a < 0) continue;
    const double clearance_m =
        std::min({passages[i].weight_m, this->clearance_m(a), this->clearance_m(b)});
    const double length_m = (position_map(a) - position_map(b)).norm();
    links_[next[static_cast<size_t>(a)]++] = {b, static_cast<float>(clearance_m), length_m,
                                              passages[i].valid};
    links_[next[static_cast<size_t>(b)]++] = {a, static_cast<float>(clearance_m), length_m,
                                              passages[i].valid};
  }
  for (size_t place = 0; place < ids_.size(); ++place) {
    DSG_RETURN_IF_ERROR(counter.Check());
    SortLinksOf(place);
  }
  return absl::OkStatus();
}

void PlaceGraph::SortLinksOf(size_t place) {
  std::sort(links_.begin() + offsets_[place], links_.begin() + offsets_[place + 1],
            [](const Link& x, const Link& y) {
              return std::tie(x.to, x.valid.from_ns, x.valid.to_ns, x.clearance_m) <
                     std::tie(y.to, y.valid.from_ns, y.valid.to_ns, y.clearance_m);
            });
}

std::optional<PlaceIndex> PlaceGraph::Find(NodeId id) const {
  // Ids are dense in most maps: the guess is then right and saves the search.
  if (!ids_.empty() && id >= ids_.front()) {
    const uint64_t guess = id.value - ids_.front().value;
    if (guess < ids_.size() && ids_[guess] == id) return static_cast<PlaceIndex>(guess);
  }
  const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
  if (found == ids_.end() || *found != id) return std::nullopt;
  return static_cast<PlaceIndex>(found - ids_.begin());
}

absl::StatusOr<PlaceGraph::Annex*> PlaceGraph::annex(
    const StopCheck& stop,
    const std::function<absl::StatusOr<std::unique_ptr<Annex>>()>& make) const {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<Annex> made, annex_.Get(stop, make));
  return made.get();
}

size_t PlaceGraph::memory_bytes() const {
  const size_t a_place =
      sizeof(NodeId) * 2 + sizeof(Eigen::Vector3d) + sizeof(double) + sizeof(Interval);
  const size_t own = sizeof(PlaceGraph) + ids_.capacity() * a_place +
                     offsets_.capacity() * sizeof(uint32_t) + links_.capacity() * sizeof(Link);
  const Annex* const annex = annex_.MadeOrNull();
  return own + (annex == nullptr ? 0 : annex->memory_bytes());
}

}  // namespace dsg::query
