// SPDX-License-Identifier: Apache-2.0
#include "query/cli/json.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <string>

#include "absl/strings/str_cat.h"

namespace dsg::cli {
namespace {

namespace util = google::protobuf::util;

// MessageToJsonString would print maps in the order in which they lie in memory, which is another
// one for a reply that came over the wire.
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

absl::Status Write(const google::protobuf::Message& reply, bool on_one_line, std::ostream& out) {
  util::JsonPrintOptions options;
  options.add_whitespace = !on_one_line;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = SortedJson(reply, options, &text);
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
