// SPDX-License-Identifier: Apache-2.0
#include "query/cli/values.h"

#include <cmath>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

absl::Status BadValue(Reason reason, const std::string& option, const std::string& text,
                      const std::string& what) {
  return MakeError(reason, absl::StrCat(option, " \"", text, "\": ", what),
                   {{"field", option}, {"value", text}});
}

absl::StatusOr<std::vector<double>> ParseNumbers(const std::string& option, const std::string& text,
                                                 size_t count, const std::string& form) {
  std::vector<double> numbers;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    double number = 0.0;
    if (!absl::SimpleAtod(part, &number)) {
      return BadValue(Reason::kFieldInvalid, option, text,
                      absl::StrCat("\"", part, "\" is not a number; write ", form));
    }
    if (!std::isfinite(number)) {
      return BadValue(Reason::kNumberNotFinite, option, text,
                      absl::StrCat("\"", part, "\" is not finite; write ", form));
    }
    numbers.push_back(number);
  }
  if (numbers.size() != count) {
    return BadValue(
        Reason::kFieldInvalid, option, text,
        absl::StrCat("has ", numbers.size(), " numbers instead of ", count, "; write ", form));
  }
  return numbers;
}

}  // namespace

absl::StatusOr<Eigen::Vector3d> ParsePoint(const std::string& option, const std::string& text) {
  DSG_ASSIGN_OR_RETURN(const std::vector<double> n, ParseNumbers(option, text, 3, "X,Y,Z"));
  return Eigen::Vector3d(n[0], n[1], n[2]);
}

absl::StatusOr<Box3d> ParseBox(const std::string& option, const std::string& text) {
  DSG_ASSIGN_OR_RETURN(const std::vector<double> n,
                       ParseNumbers(option, text, 6, "X0,Y0,Z0,X1,Y1,Z1"));
  const Box3d box(Eigen::Vector3d(n[0], n[1], n[2]), Eigen::Vector3d(n[3], n[4], n[5]));
  if (box.isEmpty()) {
    return BadValue(Reason::kBoxInverted, option, text,
                    "the first corner is above the second; write the lower corner first");
  }
  return box;
}

absl::StatusOr<TimeNs> ParseDuration(const std::string& option, const std::string& text) {
  const auto duration_ns = dsg::ParseTime(absl::StrCat("+", text), 0);
  if (!duration_ns.ok() || *duration_ns <= 0) {
    return BadValue(Reason::kFieldInvalid, option, text,
                    "is not a duration above zero; write 0.5s or 200ms");
  }
  return *duration_ns;
}

absl::StatusOr<TimeNs> ParseInstant(const std::string& option, const std::string& text,
                                    TimeNs epoch_ns) {
  const auto time_ns = dsg::ParseTime(text, epoch_ns);
  if (!time_ns.ok()) return Annotate(time_ns.status(), option);
  return *time_ns;
}

}  // namespace dsg::cli
