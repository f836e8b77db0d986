// SPDX-License-Identifier: Apache-2.0
// A map of which only the log of revisions is there, with any stamps.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "schema/store/graph_store.h"

namespace dsg::test {

class RevisionLog final : public MapReader {
 public:
  /// When each revision was committed, from revision 1.
  std::vector<int64_t> stamps_ns;

  const MapSpec& spec() const override { return spec_; }
  const std::string& incarnation() const override { return spec_.name; }
  bool IsCurrent() const override { return true; }
  absl::StatusOr<RevisionInfo> Head() override { return InfoOf(std::ssize(stamps_ns)); }
  absl::StatusOr<std::shared_ptr<const Snapshot>> Latest() override { return NotThere(); }
  absl::StatusOr<std::shared_ptr<const Snapshot>> At(Revision) override { return NotThere(); }
  absl::StatusOr<Revision> OldestRevision() override { return Revision{1}; }
  absl::StatusOr<std::optional<PendingErasure>> GetPendingErasure() override {
    return std::optional<PendingErasure>();
  }
  absl::StatusOr<std::vector<Tag>> Tags() override { return std::vector<Tag>(); }
  absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before, int limit) override {
    std::vector<RevisionInfo> page;
    Revision revision = before == 0 ? std::ssize(stamps_ns) : before - 1;
    while (revision >= 1 && std::ssize(page) < limit) page.push_back(InfoOf(revision--));
    return page;
  }
  absl::StatusOr<std::vector<NodeVersion>> NodeVersions(NodeId, Revision, int) override {
    return NotThere();
  }
  absl::StatusOr<Touched> TouchedBetween(Revision, Revision, const StopCheck&) override {
    return NotThere();
  }
  absl::StatusOr<SessionState> GetSession(const std::string&) override { return NotThere(); }
  absl::StatusOr<VerifyReport> Verify(const StopCheck&,
                                      const std::function<void(double)>&) override {
    return NotThere();
  }
  absl::Status CopyTo(const std::string&, const StopCheck&, const Progress&) override {
    return NotThere();
  }
  absl::Status ReadRows(const RowSink&, const StopCheck&) override { return NotThere(); }

 private:
  static absl::Status NotThere() { return absl::UnimplementedError("a log of revisions only"); }

  RevisionInfo InfoOf(Revision revision) const {
    RevisionInfo info;
    info.revision = revision;
    info.committed_ns = stamps_ns[static_cast<size_t>(revision - 1)];
    return info;
  }

  const MapSpec spec_;
};

}  // namespace dsg::test
