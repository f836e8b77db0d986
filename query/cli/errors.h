// SPDX-License-Identifier: Apache-2.0
// Errors as people and scripts see them: in the words of the command line, and as exit codes.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace dsg::cli {

enum ExitCode : int {
  kFound = 0,
  /// There is no such map, node, agent, revision, file or time.
  kNotFound = 1,
  /// The question or the file must change.
  kUsage = 2,
  /// The server or store cannot answer now.
  kUnavailable = 3,
  /// Stored bytes are corrupt.
  kDataLoss = 4,
};

ExitCode ExitCodeOf(const absl::Status& status);

/// "dsg: message [REASON]" and a newline; the reason only if there is one.
std::string ErrorLine(const absl::Status& status);

/// The same error with options in place of the fields of requests. Errors about unknown names also
/// get the verb that lists the known ones. Code, reason and metadata stay, and so do messages that
/// name no field.
absl::Status InFlags(const absl::Status& status);

}  // namespace dsg::cli
