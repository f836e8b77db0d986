// SPDX-License-Identifier: Apache-2.0
#include "query/cli/errors.h"

#include <array>
#include <string>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/errors.pb.h"
#include "query/cli/table.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

using FieldFlag = std::pair<absl::string_view, absl::string_view>;

// Fields at the beginning of a message; the first match counts, so longer names come first.
constexpr std::array<FieldFlag, 29> kFirstWords = {{
    {"bodies[0].sphere.", "--sphere: "},
    {"bodies[0].cuboid.", "--box: "},
    {"bodies[0].capsule.", "--capsule: "},
    {"bodies[0].mesh.", "--mesh: "},
    {"bodies[0].poses", "--pose"},
    {"scope.ignored", "--ignore"},
    {"filter.at_ns", "--at"},
    {"from.node", "FROM"},
    {"from.position", "FROM"},
    {"from.nearest", "FROM"},
    {"to.node", "TO"},
    {"to.position", "TO"},
    {"to.nearest", "TO"},
    {"blocked", "--avoid"},
    {"other_agent", "OTHER"},
    {"agent", "AGENT"},
    {"object", "--object"},
    {"node_id", "--room"},
    {"node", "--node"},
    {"relations", "--relation"},
    {"relation", "--relation"},
    {"position", "POSITION"},
    {"near", "--near"},
    {"layer", "--layer"},
    {"root", "ID"},
    {"id", "ID"},
    {"k", "-k"},
    {"source", "--source"},
    {"target", "--target"},
}};

// Fields anywhere in a message, and calls that it tells to make: none of them is an English word.
constexpr std::array<FieldFlag, 17> kAnywhere = {{
    {"from_ns", "--from"},
    {"to_ns", "--to"},
    {"at_ns", "--at"},
    {"horizon_ns", "--horizon"},
    {"period_ns", "--every"},
    {"resample_period_ns", "--every"},
    {"duration_ns_min", "--for"},
    {"sight_gap_ns_max", "--sight-gap"},
    {"distance_m", "--within"},
    {"max_distance_m", "--max-distance"},
    {"robot_radius_m", "--radius"},
    {"margin_m", "--margin"},
    {"clearance_m_max", "--reach"},
    {"path_count_max", "--paths"},
    {"depth_max", "--depth"},
    {"line_of_sight", "--line-of-sight"},
    {"GetAgentShape", "dsg shape"},
}};

bool IsWordAt(const std::string& text, size_t at) {
  return at < text.size() && (absl::ascii_isalnum(static_cast<unsigned char>(text[at])) ||
                              text[at] == '_' || text[at] == '.' || text[at] == '"');
}

void ReplaceFirst(std::string* message) {
  for (const auto& [field, flag] : kFirstWords) {
    if (!absl::StartsWith(*message, field)) continue;
    if (field.back() != '.' && IsWordAt(*message, field.size())) continue;
    message->replace(0, field.size(), std::string(flag));
    return;
  }
}

void ReplaceAnywhere(std::string* message) {
  for (const auto& [field, flag] : kAnywhere) {
    for (size_t at = message->find(std::string(field)); at != std::string::npos;
         at = message->find(std::string(field), at + 1)) {
      const bool is_whole =
          (at == 0 || !IsWordAt(*message, at - 1)) && !IsWordAt(*message, at + field.size());
      if (is_whole) message->replace(at, field.size(), std::string(flag));
    }
  }
}

void AddHint(Reason reason, const ErrorMetadata& metadata, std::string* message) {
  if (absl::StrContains(*message, "dsg ")) return;
  if (reason == Reason::kNodeUnknown) {
    absl::StrAppend(message, "; `dsg ls` and `dsg find` list the nodes");
  } else if (reason == Reason::kMapUnknown && metadata.contains("map")) {
    absl::StrAppend(message, "; `dsg maps` lists the maps");
  } else if (reason == Reason::kRevisionCompacted) {
    absl::StrAppend(message, "; `dsg log` lists the revisions, and when each was committed");
  }
}

}  // namespace

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
  const std::string message = PrintableMessage(std::string(status.message()));
  if (reason == Reason::kUnspecified) return absl::StrCat("dsg: ", message, "\n");
  return absl::StrCat("dsg: ", message, " [", v1::Reason_Name(static_cast<v1::Reason>(reason)),
                      "]\n");
}

absl::Status InFlags(const absl::Status& status) {
  const Reason reason = ReasonOf(status);
  if (status.ok() || reason == Reason::kUnspecified) return status;
  const ErrorMetadata metadata = MetadataOf(status);
  std::string message(status.message());
  if (metadata.contains("field")) {
    ReplaceFirst(&message);
    ReplaceAnywhere(&message);
  }
  AddHint(reason, metadata, &message);
  return MakeError(reason, message, metadata);
}

}  // namespace dsg::cli
