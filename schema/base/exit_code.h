// SPDX-License-Identifier: Apache-2.0
// Exit codes of the programs that read logs and maps: dsg-ingest, dsg-eval, dsg-optimize. dsg has
// finer ones, see query/cli/errors.h.
#pragma once

#include "absl/status/status.h"

namespace dsg {

enum ExitCode : int {
  kDone = 0,
  kFailed = 1,
  /// The command line must change.
  kUsage = 2,
  /// The server or store cannot answer now.
  kUnavailable = 3,
  /// Stored bytes are corrupt.
  kDataLoss = 4,
};

ExitCode ExitCodeOf(const absl::Status& status);

/// UNAVAILABLE if what was written to standard output did not arrive: a full disk must not look
/// like a complete answer. For the end of a program.
absl::Status FinishOutput();

}  // namespace dsg
