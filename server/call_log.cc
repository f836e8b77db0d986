// SPDX-License-Identifier: Apache-2.0
#include "server/call_log.h"

#include <google/protobuf/message.h>

#include "absl/strings/str_cat.h"
#include "dsg/v1/errors.pb.h"
#include "schema/base/log.h"
#include "schema/base/status.h"
#include "server/status_mapping.h"

namespace dsg::server {

int64_t RowCountOf(const google::protobuf::Message& reply) {
  const google::protobuf::Descriptor& type = *reply.GetDescriptor();
  int64_t row_count = 0;
  bool is_list = false;
  for (int i = 0; i < type.field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = type.field(i);
    if (!field->is_repeated() || field->message_type() == nullptr || field->is_map()) continue;
    is_list = true;
    row_count += reply.GetReflection()->FieldSize(reply, field);
  }
  return is_list ? row_count : 1;
}

void CallLog::Write(const CallRecord& record) const {
  const bool is_debug = record.status.ok() && record.elapsed <= kSlowCall;
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(record.elapsed).count();
  const std::string_view message(record.status.message().data(), record.status.message().size());
  // Valid names have at most 64 characters; the caller may have sent any text.
  Log(is_debug ? LogLevel::kDebug : LogLevel::kInfo, "rpc",
      {{"method", std::string(record.method)},
       {"map", CutText(record.map, 64)},
       {"code", absl::StatusCodeToString(record.status.code())},
       {"reason", v1::Reason_Name(static_cast<v1::Reason>(ReasonOf(record.status)))},
       {"revision", absl::StrCat(record.revision)},
       {"rows", absl::StrCat(record.row_count)},
       {"us", absl::StrCat(us)},
       {"peer", record.peer},
       {"caller", record.caller},
       {"message", CutText(message, kMessageBytesMax)}});
}

}  // namespace dsg::server
