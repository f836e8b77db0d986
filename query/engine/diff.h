// SPDX-License-Identifier: Apache-2.0
// The changes between two snapshots of a map as pages, for DiffRevisions and WatchMap. Reads only
// what some revision between the two touched; a node that came and went is no change.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "query/api/call_context.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/graph_store.h"
#include "schema/store/snapshot.h"

namespace dsg::v1 {
class DiffRevisionsResponse;
}  // namespace dsg::v1

namespace dsg::query {

/// Equal to the last bit; the revision does not count.
bool SameContent(const Node& a, const Node& b);
bool SameContent(const Edge& a, const Edge& b);
bool SameContent(const MeshBlock& a, const MeshBlock& b);
/// Equal to the last bit, but that q and -q are one rotation: which of them is stored depends on
/// the poses before it.
bool IsSamePose(const TimedPose& a, const TimedPose& b);

/// What a difference shows.
struct DifferenceOptions {
  /// Name of a layer; empty = all.
  std::string layer;
  /// A number of v1.NodeView.
  int view = 0;
};

/// Threads: one at a time.
class Difference {
 public:
  /// From `before` to `after`, in whichever order they were committed.
  /// Errors: REVISION_IN_FUTURE, REVISION_COMPACTED, LAYER_UNKNOWN in the later one.
  static absl::StatusOr<std::unique_ptr<Difference>> Open(std::shared_ptr<MapReader> map,
                                                          Revision before, Revision after,
                                                          const DifferenceOptions& options,
                                                          const StopCheck& stop);

  /// Adds the changes after `position` (empty: from the first), at most `size` of them and about a
  /// mebibyte. Returns where to go on, empty when no change is left.
  /// Errors: PAGE_TOKEN_MISMATCH for a position that is none; as Snapshot.
  absl::StatusOr<std::string> AddPage(std::string_view position, int size, const CallContext& call,
                                      v1::DiffRevisionsResponse* reply) const;

 private:
  Difference() = default;

  std::shared_ptr<const Snapshot> before_;
  std::shared_ptr<const Snapshot> after_;
  Touched touched_;
  LayerTable layers_;
  std::optional<LayerId> layer_;
  int view_ = 0;
};

}  // namespace dsg::query
