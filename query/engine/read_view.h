// SPDX-License-Identifier: Apache-2.0
// What a ReadAt resolves to: a snapshot, and the revisions that the answer's header names.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "query/engine/map_table.h"
#include "query/view/graph_view.h"
#include "schema/store/snapshot.h"

namespace dsg::v1 {
class ReadAt;
class ResponseHeader;
}  // namespace dsg::v1

namespace dsg::query {

/// Errors: NOT_FOUND/TAG_UNKNOWN, which lists the tags that there are.
absl::StatusOr<Revision> RevisionOfTag(MapReader* map, const std::string& tag);

/// Threads: safe from many threads; holds no lock.
class ReadView {
 public:
  /// Errors: MAP_NAME_INVALID; MAP_UNKNOWN; REVISION_IN_FUTURE or REVISION_COMPACTED with `oldest`
  /// and `newest`; TAG_UNKNOWN; FIELD_INVALID for a negative revision.
  static absl::StatusOr<ReadView> Open(MapTable* maps, const std::string& map,
                                       const v1::ReadAt& read_at);

  /// The same of a map that is open, at exactly one revision.
  static absl::StatusOr<ReadView> OpenAt(MapTable* maps, std::shared_ptr<MapReader> map,
                                         Revision revision);

  MapReader& map() const { return *map_; }
  const Snapshot& snapshot() const { return *snapshot_; }
  const std::shared_ptr<const Snapshot>& shared_snapshot() const { return snapshot_; }
  Revision head_revision() const { return head_; }

  /// The graph of this revision in memory, read or derived if nobody has asked for it yet.
  /// Errors: as ViewCache::Get.
  absl::StatusOr<std::shared_ptr<const GraphView>> Graph(const StopCheck& stop) const;

  void FillHeader(v1::ResponseHeader* header) const;

 private:
  static absl::StatusOr<ReadView> Make(MapTable* maps, std::shared_ptr<MapReader> map,
                                       std::shared_ptr<const Snapshot> snapshot, Revision head);

  MapTable* maps_ = nullptr;
  std::shared_ptr<MapReader> map_;
  std::shared_ptr<const Snapshot> snapshot_;
  Revision head_ = 0;
  Revision oldest_ = 0;
};

}  // namespace dsg::query
