// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_server.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::bench {
namespace {

// "dsg-server: listening on ADDRESS, store FOLDER, 2 maps".
absl::StatusOr<std::string> AddressIn(const std::string& line) {
  const std::string before = "listening on ";
  const size_t found = line.find(before);
  const size_t end = line.find(", store");
  if (found == std::string::npos || end == std::string::npos) {
    return absl::InternalError(absl::StrCat("dsg-server said \"", line, "\", but no address"));
  }
  const size_t begin = found + before.size();
  return line.substr(begin, end - begin);
}

}  // namespace

absl::StatusOr<WireServer> StartWireServer(const WirePlace& place,
                                           const std::vector<std::string>& options,
                                           const std::string& program) {
  std::vector<std::string> command = {
      program.empty() ? absl::StrCat(DSG_BINARY_DIR, "/dsg-server") : program,
      "--store",
      place.store,
      "--listen",
      place.listen,
      "--log-level",
      "error"};
  command.insert(command.end(), options.begin(), options.end());
  WireServer server;
  DSG_ASSIGN_OR_RETURN(server.process, ChildServer::Start(command));
  DSG_ASSIGN_OR_RETURN(server.address, AddressIn(server.process->first_line()));
  return server;
}

}  // namespace dsg::bench
