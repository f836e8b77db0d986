// SPDX-License-Identifier: Apache-2.0
#include "query/cli/json.h"

#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>

#include <string>

#include "absl/strings/str_cat.h"

namespace dsg::cli {
namespace {

absl::Status Write(const google::protobuf::Message& reply, bool on_one_line, std::ostream& out) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = !on_one_line;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(reply, &text, options);
  if (!status.ok()) {
    return absl::InternalError(absl::StrCat("the reply ", reply.GetTypeName(),
                                            " cannot be written as JSON: ", status.ToString()));
  }
  out << text;
  if (on_one_line) out << "\n";
  return absl::OkStatus();
}

}  // namespace

absl::Status WriteJson(const google::protobuf::Message& reply, std::ostream& out) {
  return Write(reply, /*on_one_line=*/false, out);
}

absl::Status WriteJsonLine(const google::protobuf::Message& reply, std::ostream& out) {
  return Write(reply, /*on_one_line=*/true, out);
}

}  // namespace dsg::cli
