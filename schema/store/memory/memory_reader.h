// SPDX-License-Identifier: Apache-2.0
// A map in memory, open for reading.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "schema/store/graph_store.h"
#include "schema/store/memory/map_rows.h"

namespace dsg::memory {

class MemoryReader : public MapReader {
 public:
  explicit MemoryReader(std::shared_ptr<const MapRows> rows);

  const MapSpec& spec() const override { return rows_->spec; }
  const std::string& incarnation() const override { return rows_->incarnation; }
  bool IsCurrent() const override;
  absl::StatusOr<RevisionInfo> Head() override;
  absl::StatusOr<std::shared_ptr<const Snapshot>> Latest() override;
  absl::StatusOr<std::shared_ptr<const Snapshot>> At(Revision revision) override;
  absl::StatusOr<Revision> OldestRevision() override;
  absl::StatusOr<std::optional<PendingErasure>> GetPendingErasure() override;
  absl::StatusOr<std::vector<Tag>> Tags() override;
  absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before, int limit) override;
  absl::StatusOr<std::vector<NodeVersion>> NodeVersions(NodeId id, Revision before,
                                                        int limit) override;
  absl::StatusOr<Touched> TouchedBetween(Revision after, Revision until,
                                         const StopCheck& stop) override;
  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override;
  absl::StatusOr<VerifyReport> Verify(const StopCheck& stop,
                                      const std::function<void(double)>& progress) override;
  absl::Status CopyTo(const std::string& path, const StopCheck& stop,
                      const Progress& progress) override;
  absl::Status ReadRows(const RowSink& sink, const StopCheck& stop) override;

 private:
  const std::shared_ptr<const MapRows> rows_;
  /// Of the map when it was opened.
  int64_t generation_ = 0;
};

/// The snapshot of a revision that can be read. `generation` and `opening` are the reader's.
std::shared_ptr<const Snapshot> MakeSnapshot(std::shared_ptr<const MapRows> rows,
                                             RevisionRecord record, int64_t generation,
                                             uint64_t opening);

}  // namespace dsg::memory
