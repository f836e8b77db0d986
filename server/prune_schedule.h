// SPDX-License-Identifier: Apache-2.0
// Applies a file of policies to every map of a server, again and again.
// Refuses to hurry: one map at a time, a pause after each batch, so that commits and questions go
// first.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "query/service/service_core.h"
#include "schema/retention/policy_file.h"

namespace dsg::server {

struct PruneScheduleOptions {
  /// From the start to the first run.
  std::chrono::nanoseconds first_after{std::chrono::minutes(1)};
  /// Between two messages of a prune.
  std::chrono::nanoseconds pause{std::chrono::milliseconds(50)};
};

/// What a schedule waits with, so that tests can move time.
class ScheduleClock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  virtual ~ScheduleClock() = default;
  virtual TimePoint Now() = 0;
  /// Waits until `until` or Interrupt; false once interrupted.
  virtual bool WaitUntil(TimePoint until) = 0;
  /// Ends all waits, for ever. Threads: from any.
  virtual void Interrupt() = 0;
};

std::unique_ptr<ScheduleClock> MakeScheduleClock();

/// Runs the policies at start + first_after, and then every `file.every_ns` after the begin of the
/// run before (at once if that took longer). A policy that cannot be applied to a map does not keep
/// the others from it, nor the other maps; the log says so once, and again when the reason changes.
/// Where the policies together would take more than `file.share_max` of a map (half of it unless
/// the file says otherwise), a clock may be
/// wrong: nothing of that map goes, also not by one policy after the other, and each run logs the
/// error.
///
/// Threads: Run blocks its thread until Stop, which any thread may call.
class PruneSchedule {
 public:
  /// `core` must outlive this.
  PruneSchedule(query::ServiceCore* core, PolicyFile file, const PruneScheduleOptions& options,
                std::unique_ptr<ScheduleClock> clock);
  ~PruneSchedule();

  void Run();
  void Stop();

 private:
  void RunOnce();
  void RunMap(const std::string& map);
  absl::Status PruneMap(const std::string& map, const std::vector<PrunePolicy>& policies);
  /// Warns of a failure that is not the one of the run before.
  void Report(const std::string& map, const PrunePolicy& policy, const absl::Status& status);

  query::ServiceCore* const core_;
  const PolicyFile file_;
  const PruneScheduleOptions options_;
  const std::unique_ptr<ScheduleClock> clock_;
  query::CallContext call_;
  /// By map and policy: how the run before ended.
  std::map<std::pair<std::string, std::string>, absl::Status> told_;
};

}  // namespace dsg::server
