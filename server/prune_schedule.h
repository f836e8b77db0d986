// SPDX-License-Identifier: Apache-2.0
// Applies a file of prune policies to every map of a server on a schedule. It prunes one map at a
// time and pauses after each batch, so that commits and questions have priority.
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

/// The clock of a schedule; tests replace it to control time.
class ScheduleClock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  virtual ~ScheduleClock() = default;
  virtual TimePoint Now() = 0;
  /// Waits until `until` or Interrupt; false once interrupted.
  virtual bool WaitUntil(TimePoint until) = 0;
  /// Ends all present and future waits. Threads: safe from any thread.
  virtual void Interrupt() = 0;
};

std::unique_ptr<ScheduleClock> MakeScheduleClock();

/// Runs the policies at start + first_after and then every `file.every_ns`, measured between the
/// begins of runs; a run that takes longer is followed by the next at once. A policy that cannot be
/// applied to a map stops neither the other policies nor the other maps; the log reports it once,
/// and again when the reason changes. If the policies together would erase more than
/// `file.share_max` of a map (default one half), a clock may be wrong: the run erases nothing of
/// that map, does not try the policies one by one, and logs the error each time.
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
  /// Logs a failure unless the run before failed for the same reason.
  void Report(const std::string& map, const PrunePolicy& policy, const absl::Status& status);

  query::ServiceCore* const core_;
  const PolicyFile file_;
  const PruneScheduleOptions options_;
  const std::unique_ptr<ScheduleClock> clock_;
  query::CallContext call_;
  /// Result of the run before, by map and policy.
  std::map<std::pair<std::string, std::string>, absl::Status> told_;
};

}  // namespace dsg::server
