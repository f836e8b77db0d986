// SPDX-License-Identifier: Apache-2.0
#include "tests/crash/process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <utility>

extern char** environ;

namespace dsg::test {

int64_t SteadyNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

Process Process::Run(const std::vector<std::string>& arguments, const std::string& log_path) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log_path.c_str(),
                                   O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t pid = 0;
  const int failed = posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) {
    std::fprintf(stderr, "cannot run %s\n", argv[0]);
    std::abort();
  }
  return Process(pid, -1);
}

Process Process::Fork(const std::function<void(const std::function<void(int64_t)>&)>& body) {
  int fds[2];
  if (pipe2(fds, O_CLOEXEC) != 0) std::abort();
  std::fflush(nullptr);
  const pid_t pid = fork();
  if (pid < 0) std::abort();
  if (pid > 0) {
    close(fds[1]);
    return Process(pid, fds[0]);
  }
  close(fds[0]);
  body([fd = fds[1]](int64_t revision) {
    const Acknowledgement done{revision, SteadyNs()};
    // Small writes to a pipe are whole or not at all.
    if (write(fd, &done, sizeof(done)) != sizeof(done)) _exit(1);
  });
  _exit(0);
}

Process::Process(Process&& other) noexcept
    : pid_(std::exchange(other.pid_, 0)),
      read_fd_(std::exchange(other.read_fd_, -1)),
      ended_(other.ended_),
      ending_(other.ending_) {}

Process::~Process() {
  if (pid_ > 0 && !ended_) {
    Kill();
    Wait();
  }
  if (read_fd_ >= 0) close(read_fd_);
}

void Process::Kill() {
  if (!ended_) kill(pid_, SIGKILL);
}

void Process::Terminate() {
  if (!ended_) kill(pid_, SIGTERM);
}

void Process::Settle(int status) {
  ended_ = true;
  ending_.killed = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
  ending_.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

bool Process::HasEnded() {
  int status = 0;
  if (!ended_ && waitpid(pid_, &status, WNOHANG) == pid_) Settle(status);
  return ended_;
}

Process::Ending Process::Wait() {
  int status = 0;
  if (!ended_ && waitpid(pid_, &status, 0) == pid_) Settle(status);
  return ending_;
}

std::optional<Acknowledgement> Process::NextAcknowledgement() {
  Acknowledgement next;
  if (read(read_fd_, &next, sizeof(next)) != sizeof(next)) return std::nullopt;
  return next;
}

}  // namespace dsg::test
