// SPDX-License-Identifier: Apache-2.0
// Random furnished maps in a real store, random patterns for them, and what a search should find by
// looking at everything.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "query/engine/search/pattern.h"
#include "query/engine/search/search_run.h"
#include "schema/base/random.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

inline constexpr char kHome[] = "home";

/// One revision, all of it.
struct Belief {
  std::vector<Node> nodes;
  std::vector<Edge> edges;
};

/// Two buildings with rooms, places, furniture and people; each delta changes some of it. Objects
/// have two parents now and then, and everything may have been valid for a while only.
class FurnishedMap {
 public:
  explicit FurnishedMap(uint64_t seed);

  /// Commits a random change; the first one furnishes.
  void Change();
  void Commit(GraphDelta delta);

  std::shared_ptr<const Snapshot> At(Revision revision) const;
  Revision head() const { return sequence_; }
  const std::string& folder() const { return folder_.path(); }
  Random& random() { return random_; }

 private:
  Node RandomNode(NodeId id);
  Edge RandomEdge();
  Interval RandomValidity();
  NodeId RandomId();

  TempFolder folder_;
  Random random_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<GraphWriter> writer_;
  std::shared_ptr<MapReader> reader_;
  int64_t sequence_ = 0;
  std::vector<NodeId> ids_;
};

Belief ReadAll(const Snapshot& snapshot);

/// A pattern of which most find something.
query::NodePattern RandomPattern(Random* random, int depth);

struct ScanQuestion {
  query::NodePattern pattern;
  std::optional<TimeNs> at_ns;
  std::optional<Eigen::Vector3d> near_map;
  double distance_m_max = 0.0;
  std::optional<Box3d> box_map;
};

/// The answer of somebody who looks at every node and every edge, and has never heard of indexes.
std::vector<query::HitKey> Scan(const Belief& belief, const ScanQuestion& question);

}  // namespace dsg::test
