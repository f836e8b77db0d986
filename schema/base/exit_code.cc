// SPDX-License-Identifier: Apache-2.0
#include "schema/base/exit_code.h"

#include <cstdio>

#include "schema/base/status.h"

namespace dsg {

ExitCode ExitCodeOf(const absl::Status& status) {
  const Reason reason = ReasonOf(status);
  if (reason == Reason::kFieldInvalid || reason == Reason::kMapNameInvalid) return kUsage;
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kDone;
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kDeadlineExceeded:
      return kUnavailable;
    case absl::StatusCode::kDataLoss:
      return kDataLoss;
    default:
      return kFailed;
  }
}

absl::Status FinishOutput() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return absl::OkStatus();
  return absl::UnavailableError("the output could not be written out in full");
}

}  // namespace dsg
