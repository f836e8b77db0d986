// SPDX-License-Identifier: Apache-2.0
#include "schema/base/status.h"

#include <algorithm>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"

namespace dsg {
namespace {

// Payload: lines "reason\n", then "key\tvalue\n". Keys are our own and contain neither tab nor
// newline; in values both are replaced, since values may come from a caller.
constexpr char kPayloadUrl[] = "dsg/error";

std::string Clean(std::string value) {
  for (char& c : value) {
    if (c == '\n' || c == '\t') c = ' ';
  }
  return value;
}

absl::string_view View(std::string_view text) { return {text.data(), text.size()}; }

}  // namespace

absl::StatusCode CodeOf(Reason reason) {
  const int number = static_cast<int>(reason);
  if (number == 0) return absl::StatusCode::kUnknown;
  if (number < 20) return absl::StatusCode::kInvalidArgument;
  if (number < 40) return absl::StatusCode::kNotFound;
  if (number < 60) return absl::StatusCode::kOutOfRange;
  if (number < 80) return absl::StatusCode::kAlreadyExists;
  if (number < 100) return absl::StatusCode::kFailedPrecondition;
  if (number < 120) return absl::StatusCode::kAborted;
  if (number < 140) return absl::StatusCode::kUnavailable;
  if (number < 160) return absl::StatusCode::kResourceExhausted;
  return absl::StatusCode::kDataLoss;
}

absl::Status MakeError(Reason reason, std::string_view message, ErrorMetadata metadata) {
  absl::Status status(CodeOf(reason), View(message));
  std::string payload = absl::StrCat(static_cast<int>(reason), "\n");
  for (auto& [key, value] : metadata) {
    absl::StrAppend(&payload, key, "\t", Clean(std::move(value)), "\n");
  }
  status.SetPayload(kPayloadUrl, absl::Cord(payload));
  return status;
}

Reason ReasonOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kPayloadUrl);
  if (!payload.has_value()) return Reason::kUnspecified;
  return static_cast<Reason>(std::atoi(std::string(*payload).c_str()));
}

ErrorMetadata MetadataOf(const absl::Status& status) {
  ErrorMetadata metadata;
  const auto payload = status.GetPayload(kPayloadUrl);
  if (!payload.has_value()) return metadata;
  const std::string text(*payload);
  size_t begin = text.find('\n') + 1;
  while (begin < text.size()) {
    const size_t end = text.find('\n', begin);
    const size_t tab = text.find('\t', begin);
    metadata[text.substr(begin, tab - begin)] = text.substr(tab + 1, end - tab - 1);
    begin = end + 1;
  }
  return metadata;
}

absl::Status Annotate(const absl::Status& status, std::string_view context) {
  if (status.ok()) return status;
  absl::Status annotated(status.code(), absl::StrCat(View(context), ": ", status.message()));
  status.ForEachPayload([&](absl::string_view url, const absl::Cord& payload) {
    annotated.SetPayload(url, payload);
  });
  return annotated;
}

}  // namespace dsg
