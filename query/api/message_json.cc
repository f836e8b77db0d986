// SPDX-License-Identifier: Apache-2.0
#include "query/api/message_json.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/type.pb.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <map>
#include <memory>
#include <mutex>
#include <shared_mutex>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

namespace pb = google::protobuf;

constexpr char kUrlPrefix[] = "type.googleapis.com";

// Protobuf's own resolver makes the description of a type anew for every message that it writes or
// reads, which took several times as long as the writing.
class KeptTypes final : public pb::util::TypeResolver {
 public:
  pb::util::Status ResolveMessageType(const std::string& url, pb::Type* type) override {
    return Resolve(url, type, &messages_, &TypeResolver::ResolveMessageType);
  }
  pb::util::Status ResolveEnumType(const std::string& url, pb::Enum* type) override {
    return Resolve(url, type, &enums_, &TypeResolver::ResolveEnumType);
  }

 private:
  template <typename Type>
  pb::util::Status Resolve(const std::string& url, Type* type, std::map<std::string, Type>* kept,
                           pb::util::Status (TypeResolver::*make)(const std::string&, Type*)) {
    {
      std::shared_lock lock(mutex_);
      if (const auto found = kept->find(url); found != kept->end()) {
        *type = found->second;
        return {};
      }
    }
    pb::util::Status status = (maker_.get()->*make)(url, type);
    if (!status.ok()) return status;
    std::unique_lock lock(mutex_);
    kept->emplace(url, *type);
    return {};
  }

  const std::unique_ptr<TypeResolver> maker_{
      pb::util::NewTypeResolverForDescriptorPool(kUrlPrefix, pb::DescriptorPool::generated_pool())};
  std::shared_mutex mutex_;
  std::map<std::string, pb::Type> messages_;
  std::map<std::string, pb::Enum> enums_;
};

pb::util::TypeResolver* Types() {
  static pb::util::TypeResolver& types = *new KeptTypes();
  return &types;
}

std::string UrlOf(const pb::Descriptor& type) {
  return absl::StrCat(kUrlPrefix, "/", type.full_name());
}

// A string that takes no more than a number of bytes.
class BoundedOutput final : public pb::io::ZeroCopyOutputStream {
 public:
  BoundedOutput(std::string* text, size_t bytes_max) : text_(text), bytes_max_(bytes_max) {}

  bool Next(void** data, int* size) override {
    is_full_ = text_->size() >= bytes_max_;
    return !is_full_ && stream_.Next(data, size);
  }
  void BackUp(int count) override { stream_.BackUp(count); }
  int64_t ByteCount() const override { return stream_.ByteCount(); }
  bool is_full() const { return is_full_; }

 private:
  std::string* const text_;
  const size_t bytes_max_;
  pb::io::StringOutputStream stream_{text_};
  bool is_full_ = false;
};

// The same message gives the same bytes. Printing a message itself writes its maps in their order
// in memory, which differs for a message that came over the wire.
std::string SortedBytes(const pb::Message& message) {
  std::string bytes;
  pb::io::StringOutputStream stream(&bytes);
  pb::io::CodedOutputStream out(&stream);
  out.SetSerializationDeterministic(true);
  message.SerializePartialToCodedStream(&out);
  out.Trim();
  return bytes;
}

}  // namespace

absl::StatusOr<std::string> JsonOfMessage(const pb::Message& message, JsonLayout layout,
                                          size_t bytes_max) {
  pb::util::JsonPrintOptions options;
  options.add_whitespace = layout == JsonLayout::kIndented;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  const std::string bytes = SortedBytes(message);
  pb::io::ArrayInputStream in(bytes.data(), static_cast<int>(bytes.size()));
  std::string text;
  BoundedOutput out(&text, bytes_max);
  const pb::util::Status status =
      pb::util::BinaryToJsonStream(Types(), UrlOf(*message.GetDescriptor()), &in, &out, options);
  if (out.is_full()) {
    return MakeError(Reason::kLimitExceeded,
                     absl::StrCat("the reply takes more than ", bytes_max,
                                  " bytes as JSON; ask for less at a time, or for protobuf"),
                     {{"bytes_max", absl::StrCat(bytes_max)}});
  }
  if (!status.ok()) {
    return absl::InternalError(absl::StrCat("the reply ", message.GetTypeName(),
                                            " cannot be written as JSON: ", status.ToString()));
  }
  if (layout == JsonLayout::kOneLine) text += '\n';
  return text;
}

absl::StatusOr<std::string> BytesOfJson(std::string_view json, const pb::Descriptor& type) {
  pb::io::ArrayInputStream in(json.data(), static_cast<int>(json.size()));
  std::string bytes;
  pb::io::StringOutputStream out(&bytes);
  const pb::util::Status status =
      pb::util::JsonToBinaryStream(Types(), UrlOf(type), &in, &out, pb::util::JsonParseOptions());
  if (status.ok()) return bytes;
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the request is no ", type.full_name(),
                                " in JSON: ", std::string(status.message()),
                                "; proto/dsg/v1 has the fields of each request"),
                   {{"field", ""}});
}

}  // namespace dsg::query
