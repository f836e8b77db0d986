// SPDX-License-Identifier: Apache-2.0
// One map that a year is written to, with or without a policy of forgetting.
// Refuses to know what happens in a day.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "query/service/service_core.h"
#include "schema/model/graph_delta.h"
#include "schema/retention/policy.h"
#include "schema/store/graph_store.h"

namespace dsg::test {

/// Threads: one caller at a time.
class YearStore {
 public:
  static constexpr char kMap[] = "home";

  /// Makes the map in `folder`. `policies` empty: nothing is ever forgotten.
  YearStore(const std::string& folder, std::vector<PrunePolicy> policies);

  absl::Status Commit(GraphDelta delta);
  /// Applies the policies at the end of a day. Policies of history count in days of the simulated
  /// world: a year is over in minutes, and the wall clock knows nothing of it.
  absl::Status Forget(int day);
  /// A copy of the store as it is now, to be opened beside it. `folder` exists and is empty.
  absl::Status CopyTo(const std::string& folder) const;
  /// Of the database and its log.
  int64_t FileBytes() const;
  /// Poses that the newest revision knows.
  absl::StatusOr<int64_t> PoseCount() const;
  absl::StatusOr<VerifyReport> Verify() const;
  query::ServiceCore* core() { return core_.get(); }

 private:
  std::vector<PrunePolicy> PoliciesOf(int day) const;

  const std::string folder_;
  const std::vector<PrunePolicy> policies_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<MapWriter> writer_;
  std::shared_ptr<MapReader> reader_;
  std::unique_ptr<query::ServiceCore> core_;
  /// The last revision of each day.
  std::vector<Revision> day_ends_;
};

}  // namespace dsg::test
