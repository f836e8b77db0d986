// SPDX-License-Identifier: Apache-2.0
// Programs started by a benchmark: run to the end and measured, or served from until ended.
// Refuses to touch any process that it did not start.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::bench {

/// What a program used from its start to its end.
struct Usage {
  int64_t wall_ns = 0;
  /// The most memory that was resident at once.
  int64_t resident_bytes_max = 0;
  /// Of user and system together.
  int64_t cpu_ns = 0;
};

/// Runs a program without input or output and waits for it.
///
/// The kernel books the resident memory of the process that starts a program on the program, so a
/// fresh and small copy of this benchmark is put in between (see MeasureAsCopy).
/// Errors: INTERNAL when it does not start or does not exit with 0.
absl::StatusOr<Usage> RunAndMeasure(const std::vector<std::string>& command);

/// The work of the small copy, for RunBenchmark only: nothing to do unless the first argument is
/// the one that RunAndMeasure gives; else runs the rest as a command, sets the exit code and
/// returns true.
bool MeasureAsCopy(int argc, char** argv, int* exit_code);

/// A server as a child process.
class ChildServer {
 public:
  /// Starts `command` and waits for its first line on standard output, which says it is ready.
  ///
  /// Errors: INTERNAL when it does not start or ends before.
  static absl::StatusOr<std::unique_ptr<ChildServer>> Start(
      const std::vector<std::string>& command);
  /// SIGTERM, and waits.
  ~ChildServer();
  ChildServer(const ChildServer&) = delete;
  ChildServer& operator=(const ChildServer&) = delete;

  const std::string& first_line() const { return first_line_; }
  /// Processor time that all its threads have used.
  int64_t CpuNs() const;
  /// The most memory that was resident at once; 0 once it has ended.
  int64_t ResidentBytesMax() const;

 private:
  explicit ChildServer(pid_t pid) : pid_(pid) {}
  const pid_t pid_;
  std::string first_line_;
};

}  // namespace dsg::bench
