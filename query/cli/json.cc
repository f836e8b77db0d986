// SPDX-License-Identifier: Apache-2.0
#include "query/cli/json.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

namespace util = google::protobuf::util;

// MessageToJsonString prints maps in their order in memory, which differs for a reply that came
// over the wire.
util::Status SortedJson(const google::protobuf::Message& reply,
                        const util::JsonPrintOptions& options, std::string* text) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    out.SetSerializationDeterministic(true);
    reply.SerializePartialToCodedStream(&out);
  }
  constexpr char kPrefix[] = "type.googleapis.com";
  static util::TypeResolver& resolver = *util::NewTypeResolverForDescriptorPool(
      kPrefix, google::protobuf::DescriptorPool::generated_pool());
  return util::BinaryToJsonString(&resolver, absl::StrCat(kPrefix, "/", reply.GetTypeName()), bytes,
                                  text, options);
}

absl::StatusOr<std::string> ToText(const google::protobuf::Message& reply, bool on_one_line) {
  util::JsonPrintOptions options;
  options.add_whitespace = !on_one_line;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = SortedJson(reply, options, &text);
  if (status.ok()) return text;
  return absl::InternalError(absl::StrCat("the reply ", reply.GetTypeName(),
                                          " cannot be written as JSON: ", status.ToString()));
}

}  // namespace

absl::Status WriteJson(const google::protobuf::Message& reply, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(const std::string text, ToText(reply, /*on_one_line=*/false));
  out << text;
  return absl::OkStatus();
}

absl::Status WriteJsonLine(const google::protobuf::Message& reply, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(const std::string text, ToText(reply, /*on_one_line=*/true));
  out << text << "\n";
  return absl::OkStatus();
}

absl::Status JsonListWriter::Add(const google::protobuf::Message& part) {
  DSG_ASSIGN_OR_RETURN(const std::string text, ToText(part, /*on_one_line=*/false));
  // Newlines stand between fields only, and deeper fields are indented further.
  const std::string head = absl::StrCat("\n \"", list_, "\": [");
  const size_t begin = text.find(head) + head.size();
  const size_t end = text[begin] == ']' ? begin : text.find("\n ]", begin);
  if (!has_begun_) {
    out_ << text.substr(0, begin);
    rest_ = text.substr(text.find(']', end));
  }
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
