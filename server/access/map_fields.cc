// SPDX-License-Identifier: Apache-2.0
#include "server/access/map_fields.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <string>
#include <utility>

#include "dsg/v1/options.pb.h"

namespace dsg::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using query::Role;

Role RoleOf(v1::Role role) {
  switch (role) {
    case v1::ROLE_READER:
      return Role::kReader;
    case v1::ROLE_WRITER:
      return Role::kWriter;
    case v1::ROLE_MAINTAINER:
      return Role::kMaintainer;
    default:
      return Role::kAdmin;
  }
}

bool IsName(const FieldDescriptor* field) {
  return field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_STRING &&
         !field->is_repeated();
}

// The name of a map below a message field; null if it has none.
const FieldDescriptor* NameBelow(const FieldDescriptor& field) {
  const bool is_map = field.name() == "map";
  if (!is_map && field.name() != "delta") return nullptr;
  const FieldDescriptor* name = field.message_type()->FindFieldByName(is_map ? "name" : "map");
  return IsName(name) ? name : nullptr;
}

const std::string& TextAt(const Message& request, const std::vector<const FieldDescriptor*>& path,
                          std::string* scratch) {
  const Message* message = &request;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    message = &message->GetReflection()->GetMessage(*message, path[i]);
  }
  return message->GetReflection()->GetStringReference(*message, path.back(), scratch);
}

}  // namespace

MapFields::MapFields(const Descriptor& request, Role role) {
  for (int i = 0; i < request.field_count(); ++i) {
    const FieldDescriptor* field = request.field(i);
    const v1::Role there = field->options().GetExtension(v1::role_there);
    if (there != v1::ROLE_UNSPECIFIED) {
      fields_.push_back({{field}, RoleOf(there), /*is_other=*/true});
    } else if (IsName(field) && field->name() == "map") {
      fields_.push_back({{field}, role});
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && !field->is_repeated()) {
      if (const FieldDescriptor* name = NameBelow(*field)) fields_.push_back({{field, name}, role});
    }
  }
}

std::string MapFields::OtherOf(const Message& request) const {
  std::string scratch;
  for (const Field& field : fields_) {
    if (field.is_other) return TextAt(request, field.path, &scratch);
  }
  return {};
}

absl::Status MapFields::Check(const Caller& caller, const Message& request) const {
  std::string scratch;
  for (const Field& field : fields_) {
    absl::Status status = caller.Check(field.role, TextAt(request, field.path, &scratch));
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace dsg::server
