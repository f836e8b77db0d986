// SPDX-License-Identifier: Apache-2.0
#include "query/cli/values.h"

#include <cmath>
#include <filesystem>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

absl::Status BadValue(Reason reason, const std::string& option, const std::string& text,
                      const std::string& what) {
  return MakeError(reason, absl::StrCat(option, " \"", text, "\": ", what),
                   {{"field", option}, {"value", text}});
}

// True if a number is so small that it may mean seconds: less than a second in nanoseconds or, on a
// map with a present-day epoch, less than three years after 1970.
bool MayBeSeconds(TimeNs number, const MapSpec& map) {
  constexpr TimeNs kThreeYears = 100'000'000 * kNsPerSecond;
  const auto is_within = [](TimeNs time_ns, TimeNs limit) {
    return -limit < time_ns && time_ns < limit;
  };
  if (number == 0 && map.epoch_ns == 0) return false;
  return is_within(number, is_within(map.epoch_ns, kThreeYears) ? kNsPerSecond : kThreeYears);
}

// Of what is no instant, and may be meant as a time from the epoch of the map: "30", "1m10s".
absl::Status SayFromEpoch(const std::string& option, const std::string& text, const MapSpec& map) {
  const bool is_signed = absl::StartsWith(text, "+") || absl::StartsWith(text, "-");
  const bool has_unit = absl::ascii_isalpha(static_cast<unsigned char>(text.back()));
  TimeNs number = 0;
  std::string forms =
      absl::StrCat(is_signed ? "" : "+", text, has_unit ? "" : "s", " (from the map's epoch)");
  if (!is_signed && absl::SimpleAtoi(text, &number)) {
    absl::StrAppend(&forms, ", ", text, "ns (on the map's clock)");
  }
  if (map.clock == Clock::kUnix) {
    absl::StrAppend(&forms, ", or a date like ", FormatRfc3339(map.epoch_ns));
  }
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(option, ": ", text, has_unit ? " has no sign" : " has no unit",
                                ": write ", forms),
                   {{"field", option}, {"value", text}});
}

// Any number of them.
absl::StatusOr<std::vector<double>> SplitNumbers(const std::string& option, const std::string& text,
                                                 const std::string& form) {
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
  return numbers;
}

absl::StatusOr<std::vector<double>> ParseNumbers(const std::string& option, const std::string& text,
                                                 size_t count, const std::string& form) {
  DSG_ASSIGN_OR_RETURN(std::vector<double> numbers, SplitNumbers(option, text, form));
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
    return BadValue(
        Reason::kBoxInverted, option, text,
        "the first corner has a larger coordinate than the second; write the lower corner first");
  }
  return box;
}

absl::StatusOr<std::array<double, 2>> ParsePair(const std::string& option, const std::string& text,
                                                const std::string& form) {
  DSG_ASSIGN_OR_RETURN(const std::vector<double> n, ParseNumbers(option, text, 2, form));
  return std::array<double, 2>{n[0], n[1]};
}

absl::StatusOr<Pose3d> ParsePose(const std::string& option, const std::string& text) {
  constexpr char kForm[] = "X,Y,Z or X,Y,Z,QX,QY,QZ,QW";
  constexpr double kLengthMin = 1e-6;
  DSG_ASSIGN_OR_RETURN(const std::vector<double> n, SplitNumbers(option, text, kForm));
  if (n.size() != 3 && n.size() != 7) {
    return BadValue(Reason::kFieldInvalid, option, text,
                    absl::StrCat("has ", n.size(), " numbers; write ", kForm));
  }
  Pose3d pose;
  pose.position = Eigen::Vector3d(n[0], n[1], n[2]);
  if (n.size() == 3) return pose;
  const Eigen::Quaterniond orientation(n[6], n[3], n[4], n[5]);
  if (!(orientation.norm() > kLengthMin)) {
    return BadValue(Reason::kFieldInvalid, option, text,
                    "the quaternion has length zero; write 0,0,0,1 for no rotation");
  }
  pose.orientation = orientation.normalized();
  return pose;
}

absl::StatusOr<TimeNs> ParseDuration(const std::string& option, const std::string& text) {
  const auto duration_ns = dsg::ParseTime(absl::StrCat("+", text), 0);
  if (!duration_ns.ok() || *duration_ns <= 0) {
    return BadValue(Reason::kFieldInvalid, option, text,
                    "is not a positive duration; write 0.5s, 200ms or 1m10s");
  }
  return *duration_ns;
}

absl::StatusOr<TimeNs> ParseInstant(const std::string& option, const std::string& text,
                                    const MapSpec& map) {
  const bool is_signed = absl::StartsWith(text, "+") || absl::StartsWith(text, "-");
  absl::string_view digits = text;
  TimeNs number = 0;
  if (!is_signed && absl::ConsumeSuffix(&digits, "ns") && absl::SimpleAtoi(digits, &number)) {
    return number;
  }
  const bool is_number = text[0] != '+' && absl::SimpleAtoi(text, &number);
  const auto time_ns = dsg::ParseTime(text, map.epoch_ns);
  if (!time_ns.ok()) {
    const bool lacks_sign = !is_signed && dsg::ParseTime(absl::StrCat("+", text), 0).ok();
    return lacks_sign ? SayFromEpoch(option, text, map) : Annotate(time_ns.status(), option);
  }
  if (is_number && MayBeSeconds(number, map)) return SayFromEpoch(option, text, map);
  if (!is_number && !is_signed && map.clock != Clock::kUnix) {
    return BadValue(
        Reason::kFieldInvalid, option, text,
        absl::StrCat("the map's clock is ",
                     map.clock == Clock::kPtpTai ? "TAI, some seconds ahead of UTC"
                                                 : "that of its log, which has no dates",
                     "; write \"+12.5s\", from the epoch of the map"));
  }
  return *time_ns;
}

absl::Status MakeFolder(const std::string& option, const std::string& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (!failure && std::filesystem::is_directory(folder, failure)) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(option, " ", folder, ": cannot create the folder (",
                                failure ? failure.message() : "a file of that name is there",
                                "); name another folder"),
                   {{"field", option}, {"value", folder}});
}

}  // namespace dsg::cli
