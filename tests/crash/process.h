// SPDX-License-Identifier: Apache-2.0
// Processes that a test starts, watches, kills by their id and buries. Never touches any other.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace dsg::test {

/// Nanoseconds of the clock that all processes of this machine share.
int64_t SteadyNs();

/// What a process that commits tells the test right after each acknowledgement.
struct Acknowledgement {
  int64_t revision = 0;
  int64_t steady_ns = 0;
};

/// A child process, killed and waited for when destroyed.
class Process {
 public:
  /// Runs a program; what it writes goes to `log_path`.
  static Process Run(const std::vector<std::string>& arguments, const std::string& log_path);
  /// Runs `body` in a forked child, which then ends with code 0. `body` gets what it reports
  /// acknowledgements through. Nothing of SQLite or gRPC may be open in this process.
  static Process Fork(const std::function<void(const std::function<void(int64_t)>&)>& body);

  Process(Process&& other) noexcept;
  Process& operator=(Process&&) = delete;
  ~Process();

  /// SIGKILL.
  void Kill();
  /// SIGTERM.
  void Terminate();
  /// True once it has ended; never waits.
  bool HasEnded();
  struct Ending {
    bool killed = false;
    int exit_code = -1;
  };
  Ending Wait();
  /// The next acknowledgement of a forked child, waiting for it; nullopt when the child has ended
  /// and all of them have been read.
  std::optional<Acknowledgement> NextAcknowledgement();

 private:
  Process(pid_t pid, int read_fd) : pid_(pid), read_fd_(read_fd) {}
  void Settle(int status);

  pid_t pid_;
  int read_fd_;
  bool ended_ = false;
  Ending ending_;
};

}  // namespace dsg::test
