// SPDX-License-Identifier: Apache-2.0
#include "query/cli/exit_code.h"

#include "absl/strings/str_cat.h"
#include "dsg/v1/errors.pb.h"
#include "query/cli/table.h"
#include "schema/base/status.h"

namespace dsg::cli {

ExitCode ExitCodeOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kFound;
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kOutOfRange:
      return kNotFound;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kUnimplemented:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
      return kUsage;
    case absl::StatusCode::kDataLoss:
      return kDataLoss;
    default:
      return kUnavailable;
  }
}

std::string ErrorLine(const absl::Status& status) {
  const Reason reason = ReasonOf(status);
  const std::string message = Printable(std::string(status.message()));
  if (reason == Reason::kUnspecified) return absl::StrCat("dsg: ", message, "\n");
  return absl::StrCat("dsg: ", message, " [", v1::Reason_Name(static_cast<v1::Reason>(reason)),
                      "]\n");
}

}  // namespace dsg::cli
