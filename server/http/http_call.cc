// SPDX-License-Identifier: Apache-2.0
#include "server/http/http_call.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "query/api/message_json.h"
#include "schema/base/status.h"
#include "server/http/answer_head.h"

namespace dsg::server {
namespace {

// Of a message of the answer. An empty part of a message has two bytes, and hundreds as JSON.
constexpr size_t kJsonBytesMax = size_t{64} << 20;

}  // namespace

HttpCall::HttpCall(const CallPlan& plan, std::string body, Place place)
    : runtime_(plan.method->runtime),
      type_(plan.type),
      place_(std::move(place)),
      body_(std::move(body)),
      call_(plan.method->make(plan.method, this, place_.connection, plan.deadline)) {}

// The binary form is shorter; while it is made, each open part of the message takes some 16 bytes.
size_t HttpCall::decode_bytes() const { return type_.is_json ? 8 * body_.size() : 0; }

absl::Status HttpCall::Decode(const google::protobuf::Descriptor& type) {
  std::string_view message = body_;
  if (type_.is_stream) {
    DSG_ASSIGN_OR_RETURN(message, OpenEnvelope(body_));
  }
  if (type_.is_json) {
    DSG_ASSIGN_OR_RETURN(body_, query::BytesOfJson(message, type));
  } else if (type_.is_stream) {
    body_.erase(0, kEnvelopeBytes);
  }
  return absl::OkStatus();
}

std::unique_ptr<google::protobuf::io::ZeroCopyInputStream> HttpCall::OpenRequest() {
  return std::make_unique<google::protobuf::io::ArrayInputStream>(body_.data(),
                                                                  static_cast<int>(body_.size()));
}

absl::Status HttpCall::Pack(const google::protobuf::Message& message) {
  packed_.clear();
  DSG_RETURN_IF_ERROR(CheckMessageBytes(message.ByteSizeLong()));
  if (!type_.is_json) {
    packed_ = message.SerializeAsString();
    return absl::OkStatus();
  }
  const auto layout = type_.is_stream ? query::JsonLayout::kOneLine : query::JsonLayout::kIndented;
  DSG_ASSIGN_OR_RETURN(packed_, query::JsonOfMessage(message, layout, kJsonBytesMax));
  return absl::OkStatus();
}

void HttpCall::Drop() {
  std::string().swap(body_);
  std::string().swap(packed_);
}

void HttpCall::Send() { place_.outlet->Write(TakeChunk(), /*is_last=*/false); }

void HttpCall::SendLast(const absl::Status& status) {
  AnswerBytes bytes;
  if (type_.is_stream) {
    bytes = TakeChunk();
    AppendEnd(status, &bytes.tail);
  } else {
    bytes.head = TakeHead(200);
    bytes.message = std::move(packed_);
  }
  place_.outlet->Write(std::move(bytes), /*is_last=*/true);
}

void HttpCall::Finish(const absl::Status& status) {
  // What the server ends when it stops looks cancelled from inside.
  const bool is_stopped = absl::IsCancelled(status) && runtime_->stopping;
  const absl::Status told = is_stopped ? ShuttingDownError() : status;
  packed_.clear();
  AnswerBytes bytes;
  if (type_.is_stream) {
    bytes.head = TakeHead(200);
    AppendEnd(told, &bytes.tail);
  } else {
    packed_ = ErrorJson(told);
    bytes.head = TakeHead(HttpStatusOf(told.code()));
    bytes.message = std::move(packed_);
  }
  place_.outlet->Write(std::move(bytes), /*is_last=*/true);
}

EndCall HttpCall::ender() {
  return [outlet = place_.outlet, number = place_.number](const absl::Status& why) {
    outlet->End(number, why);
  };
}

std::string HttpCall::TakeHead(int status) {
  if (std::exchange(is_head_sent_, true)) return "";
  AnswerHead head;
  head.status = status;
  head.keeps_connection = place_.keeps_connection;
  if (type_.is_stream) {
    head.content_type = NameOf(type_);
    head.is_chunked = place_.may_chunk;
  } else {
    head.content_type = status == 200 ? NameOf(type_) : "application/json";
    head.body_bytes = packed_.size();
  }
  return TextOf(head);
}

AnswerBytes HttpCall::TakeChunk() {
  AnswerBytes bytes{.head = TakeHead(200), .message = std::move(packed_), .tail = ""};
  const std::string envelope = EnvelopeOf(bytes.message.size());
  if (place_.may_chunk) {
    absl::StrAppend(&bytes.head, absl::Hex(envelope.size() + bytes.message.size()), "\r\n");
    bytes.tail = "\r\n";
  }
  bytes.head += envelope;
  return bytes;
}

void HttpCall::AppendEnd(const absl::Status& status, std::string* bytes) const {
  const std::string end = EndOfStream(status);
  if (place_.may_chunk) {
    absl::StrAppend(bytes, absl::Hex(end.size()), "\r\n", end, "\r\n0\r\n\r\n");
  } else {
    *bytes += end;
  }
}

}  // namespace dsg::server
