// SPDX-License-Identifier: Apache-2.0
#include "query/cli/json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/strings/str_cat.h"
#include "query/api/message_json.h"
#include "schema/base/status.h"

namespace dsg::cli {

using query::JsonLayout;
using query::JsonOfMessage;

absl::Status WriteJson(const google::protobuf::Message& reply, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(const std::string text, JsonOfMessage(reply, JsonLayout::kIndented));
  out << text;
  return absl::OkStatus();
}

absl::Status WriteJsonLine(const google::protobuf::Message& reply, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(const std::string text, JsonOfMessage(reply, JsonLayout::kOneLine));
  out << text;
  return absl::OkStatus();
}

absl::Status JsonListWriter::Add(const google::protobuf::Message& part) {
  DSG_ASSIGN_OR_RETURN(const std::string text, JsonOfMessage(part, JsonLayout::kIndented));
  // Newlines stand between fields only, and deeper fields are indented further.
  const std::string head = absl::StrCat("\n \"", list_, "\": [");
  const size_t begin = text.find(head) + head.size();
  const size_t end = text[begin] == ']' ? begin : text.find("\n ]", begin);
  if (!has_begun_) out_ << text.substr(0, begin);
  rest_ = text.substr(text.find(']', end));
  has_begun_ = true;
  if (end == begin) return absl::OkStatus();
  if (has_entries_) out_ << ",";
  out_.write(text.data() + begin, static_cast<std::streamsize>(end - begin));
  has_entries_ = true;
  return absl::OkStatus();
}

void JsonListWriter::End() {
  if (has_entries_) out_ << "\n ";
  out_ << rest_;
}

void TellWritten(const std::vector<Written>& files, Revision revision, bool as_json,
                 std::ostream& out) {
  // Numbers are strings, like the 64-bit integers of protobuf JSON.
  nlohmann::ordered_json json = {{"read_revision", std::to_string(revision)},
                                 {"files", nlohmann::ordered_json::array()}};
  for (const Written& file : files) {
    std::string text = absl::StrCat("wrote ", file.path, ": ");
    nlohmann::ordered_json one = {{"format", file.format}, {"path", file.path}};
    for (const auto& [what, count] : file.counts) {
      absl::StrAppend(&text, count, " ", what, ", ");
      std::string key = what;
      std::replace(key.begin(), key.end(), ' ', '_');
      one[key] = std::to_string(count);
    }
    one["byte_count"] = std::to_string(file.byte_count);
    json["files"].push_back(std::move(one));
    if (!as_json) out << text << file.byte_count << " bytes (revision " << revision << ")\n";
  }
  if (as_json) {
    out << json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
  }
}

}  // namespace dsg::cli
