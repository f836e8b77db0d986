// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/bench/report.h"

namespace dsg::bench {
namespace {

constexpr char kMeasureFlag[] = "--measure-command";

// Starts a program whose standard output is `output`; -1 throws it away.
absl::StatusOr<pid_t> Spawn(const std::vector<std::string>& command, int output) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  if (output < 0) {
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  } else {
    posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  }
  pid_t pid = -1;
  const int code = posix_spawn(&pid, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (code == 0) return pid;
  return absl::InternalError(
      absl::StrCat("cannot start ", command[0], ": ", std::strerror(code), "; build it first"));
}

struct Started {
  pid_t pid;
  /// What it prints; ends with the program.
  FILE* output;
};

absl::StatusOr<Started> SpawnAndListen(const std::vector<std::string>& command) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return absl::InternalError("no pipe for a program's output");
  FILE* output = fdopen(ends[0], "r");
  const absl::StatusOr<pid_t> pid = Spawn(command, ends[1]);
  close(ends[1]);
  if (pid.ok()) return Started{*pid, output};
  fclose(output);
  return pid.status();
}

absl::Status CheckExit(const std::string& program, int state) {
  if (WIFEXITED(state) && WEXITSTATUS(state) == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(program, " ended with wait status ", state));
}

absl::StatusOr<Usage> Measure(const std::vector<std::string>& command) {
  Usage usage;
  absl::StatusOr<pid_t> pid = absl::InternalError("not started");
  int state = 0;
  rusage used{};
  usage.wall_ns = NanosecondsOf([&] {
    pid = Spawn(command, -1);
    if (pid.ok()) wait4(*pid, &state, 0, &used);
  });
  DSG_RETURN_IF_ERROR(pid.status());
  DSG_RETURN_IF_ERROR(CheckExit(command[0], state));
  usage.resident_bytes_max = int64_t{used.ru_maxrss} * 1024;
  for (const timeval& time : {used.ru_utime, used.ru_stime}) {
    usage.cpu_ns += int64_t{time.tv_sec} * 1'000'000'000 + int64_t{time.tv_usec} * 1'000;
  }
  return usage;
}

}  // namespace

absl::StatusOr<Usage> RunAndMeasure(const std::vector<std::string>& command) {
  std::vector<std::string> by_copy = {"/proc/self/exe", kMeasureFlag};
  by_copy.insert(by_copy.end(), command.begin(), command.end());
  DSG_ASSIGN_OR_RETURN(const Started copy, SpawnAndListen(by_copy));
  Usage usage;
  const int read = fscanf(copy.output, "%" SCNd64 " %" SCNd64 " %" SCNd64, &usage.wall_ns,
                          &usage.resident_bytes_max, &usage.cpu_ns);
  fclose(copy.output);
  int state = 0;
  waitpid(copy.pid, &state, 0);
  DSG_RETURN_IF_ERROR(CheckExit(command[0], state));
  if (read == 3) return usage;
  return absl::InternalError(absl::StrCat("no figures came back from running ", command[0]));
}

bool MeasureAsCopy(int argc, char** argv, int* exit_code) {
  if (argc < 3 || std::strcmp(argv[1], kMeasureFlag) != 0) return false;
  const absl::StatusOr<Usage> usage = Measure({argv + 2, argv + argc});
  if (usage.ok()) {
    std::printf("%" PRId64 " %" PRId64 " %" PRId64 "\n", usage->wall_ns, usage->resident_bytes_max,
                usage->cpu_ns);
  } else {
    std::fprintf(stderr, "%s\n", usage.status().ToString().c_str());
  }
  *exit_code = usage.ok() ? 0 : 2;
  return true;
}

absl::StatusOr<std::unique_ptr<ChildServer>> ChildServer::Start(
    const std::vector<std::string>& command) {
  DSG_ASSIGN_OR_RETURN(const Started started, SpawnAndListen(command));
  std::unique_ptr<ChildServer> server(new ChildServer(started.pid));
  int byte = fgetc(started.output);
  for (; byte != '\n' && byte != EOF; byte = fgetc(started.output)) {
    server->first_line_ += static_cast<char>(byte);
  }
  fclose(started.output);
  if (byte == '\n') return server;
  return absl::InternalError(absl::StrCat(command[0], " ended before it was ready"));
}

int64_t ChildServer::CpuNs() const {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

int64_t ChildServer::ResidentBytesMax() const {
  std::ifstream file(absl::StrCat("/proc/", pid_, "/status"));
  std::string word;
  while (file >> word) {
    int64_t kibibytes = 0;
    if (word == "VmHWM:" && file >> kibibytes) return kibibytes * 1024;
  }
  return 0;
}

ChildServer::~ChildServer() {
  kill(pid_, SIGTERM);
  waitpid(pid_, nullptr, 0);
}

}  // namespace dsg::bench
