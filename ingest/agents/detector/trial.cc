// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/trial.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "absl/strings/str_cat.h"

namespace dsg::ingest {
namespace {

// More than any detector of people needs.
constexpr rlim_t kBytesMax = rlim_t{8} << 30;
constexpr int kFailed = 1;

[[noreturn]] void Run(const std::function<void()>& work) {
  // What a dying library says helps nobody.
  const int nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDERR_FILENO);
  dup2(nowhere, STDOUT_FILENO);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const rlimit memory{kBytesMax, kBytesMax};
  setrlimit(RLIMIT_AS, &memory);
#endif
  int result = 0;
  try {
    work();
  } catch (...) {
    result = kFailed;
  }
  _exit(result);
}

}  // namespace

absl::Status TryApart(const std::function<void()>& work, double seconds_max) {
  const pid_t child = fork();
  if (child < 0) return absl::InternalError(absl::StrCat("fork: ", std::strerror(errno)));
  if (child == 0) Run(work);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds_max);
  int state = 0;
  while (waitpid(child, &state, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > end) {
      kill(child, SIGKILL);
      waitpid(child, &state, 0);
      return absl::InternalError(absl::StrCat("it ran for more than ", seconds_max, " s"));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  if (WIFSIGNALED(state)) {
    return absl::InternalError(
        absl::StrCat("it crashed: ", std::string(strsignal(WTERMSIG(state)))));
  }
  if (WEXITSTATUS(state) != 0) return absl::InternalError("it gave up, or needs too much memory");
  return absl::OkStatus();
}

}  // namespace dsg::ingest
