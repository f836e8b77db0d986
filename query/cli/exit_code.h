// SPDX-License-Identifier: Apache-2.0
// How the program ends: one number for scripts, one line for people.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace dsg::cli {

enum ExitCode : int {
  kFound = 0,
  /// There is no such map, node, agent, revision, file or time.
  kNotFound = 1,
  /// The question or the file must be changed.
  kUsage = 2,
  /// The server or store cannot answer now.
  kUnavailable = 3,
  /// Stored bytes are not what was written.
  kDataLoss = 4,
};

ExitCode ExitCodeOf(const absl::Status& status);

/// "dsg: message [REASON]" and a line end; the reason only if there is one.
std::string ErrorLine(const absl::Status& status);

}  // namespace dsg::cli
