// SPDX-License-Identifier: Apache-2.0
// The program dsg: hands the process's arguments and environment to query/cli/run.h.
#include <google/protobuf/stubs/logging.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "query/cli/run.h"

namespace {

std::string FromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

int main(int argc, char** argv) {
  // A reader that has seen enough (`| head`) ends the program without a word, whatever was
  // inherited.
  std::signal(SIGPIPE, SIG_DFL);
  // Beyond the file-size limit of the shell a write fails with a message, instead of a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  // What is wrong with a word is told as our own error.
  google::protobuf::SetLogHandler(nullptr);
  const dsg::cli::Environment environment{.store = FromEnvironment("DSG_STORE"),
                                          .server = FromEnvironment("DSG_SERVER"),
                                          .map = FromEnvironment("DSG_MAP"),
                                          .version = DSG_VERSION};
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  return dsg::cli::Run(arguments, environment, std::cout, std::cerr);
}
