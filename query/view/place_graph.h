// SPDX-License-Identifier: Apache-2.0
// Places and the links between them as flat arrays, for walks that visit thousands of them. Robots
// and goals are those of planning and prediction.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "query/view/graph_view.h"
#include "schema/base/cache.h"

namespace dsg::query {

/// Index of a place in a PlaceGraph.
using PlaceIndex = int32_t;

/// Threads: immutable.
class PlaceGraph {
 public:
  struct Place {
    NodeId id;
    Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
    double clearance_m = 0.0;
    Interval valid;
    /// As room() below.
    NodeId room;
  };
  /// An edge; it counts in both directions.
  struct Passage {
    NodeId source;
    NodeId target;
    double weight_m = 0.0;
    Interval valid;
  };

  /// All nodes of the places' layer with kind place, all TRAVERSABLE edges between them.
  /// Errors: what `stop` returned.
  static absl::StatusOr<std::shared_ptr<const PlaceGraph>> Build(const GraphView& view,
                                                                 const StopCheck& stop);
  /// The same of plain lists, in any order. Passages to oneself or to an unknown place are left
  /// out. Requires: no two places share an id.
  static absl::StatusOr<std::shared_ptr<const PlaceGraph>> Make(
      std::vector<Place> places, const std::vector<Passage>& passages, const StopCheck& stop);
  /// The same without an end before it is done.
  static std::shared_ptr<const PlaceGraph> Make(std::vector<Place> places,
                                                const std::vector<Passage>& passages);

  struct Link {
    PlaceIndex to = 0;
    /// The smaller of the link's weight and the clearance of both places, metres.
    float clearance_m = 0.0F;
    /// Distance between the places, metres.
    double length_m = 0.0;
    Interval valid;
  };

  int32_t size() const { return static_cast<int32_t>(ids_.size()); }
  NodeId id(PlaceIndex place) const { return ids_[static_cast<size_t>(place)]; }
  const Eigen::Vector3d& position_map(PlaceIndex place) const {
    return positions_map_[static_cast<size_t>(place)];
  }
  double clearance_m(PlaceIndex place) const { return clearances_m_[static_cast<size_t>(place)]; }
  const Interval& valid(PlaceIndex place) const { return valid_[static_cast<size_t>(place)]; }
  /// The first ancestor in the rooms' layer; empty if there is none.
  NodeId room(PlaceIndex place) const { return rooms_[static_cast<size_t>(place)]; }
  /// Both directions, ascending by place.
  const Link* links_begin(PlaceIndex place) const {
    return links_.data() + offsets_[static_cast<size_t>(place)];
  }
  const Link* links_end(PlaceIndex place) const {
    return links_.data() + offsets_[static_cast<size_t>(place) + 1];
  }
  /// nullopt if the node is no place.
  std::optional<PlaceIndex> Find(NodeId id) const;

  /// What has been derived from the graph and lives as long as it does.
  class Annex {
   public:
    virtual ~Annex() = default;
    virtual size_t memory_bytes() const = 0;
  };
  /// What the first `make` that succeeds makes. One user only: planning.
  /// Errors: what `stop` or `make` returned.
  absl::StatusOr<Annex*> annex(
      const StopCheck& stop,
      const std::function<absl::StatusOr<std::unique_ptr<Annex>>()>& make) const;

  /// Grows while questions fill the annex.
  size_t memory_bytes() const;

 private:
  absl::Status MakeLinks(const std::vector<Passage>& passages, const StopCheck& stop);
  void SortLinksOf(size_t place);

  // Ascending.
  std::vector<NodeId> ids_;
  std::vector<Eigen::Vector3d> positions_map_;
  std::vector<double> clearances_m_;
  std::vector<Interval> valid_;
  std::vector<NodeId> rooms_;
  std::vector<uint32_t> offsets_;
  std::vector<Link> links_;

  mutable MakeOnce<Annex> annex_;
};

}  // namespace dsg::query
