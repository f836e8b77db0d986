// SPDX-License-Identifier: Apache-2.0
#include "server/http/session_internal.h"
// Before the rest of Asio.
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/http/error.hpp>

#include "absl/strings/str_cat.h"
#include "server/call_deadline.h"
#include "server/http/answer_head.h"
#include "server/http/web_files.h"

namespace dsg::server {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;
using std::chrono::seconds;

constexpr seconds kIdleMax{30};
constexpr seconds kHeadMax{5};
constexpr seconds kLingerMax{1};
constexpr uint32_t kHeadBytesMax = 16 << 10;
// What a client may send ahead while its call runs, and what is read of a request that is refused.
constexpr size_t kAheadBytesMax = size_t{64} << 10;
constexpr size_t kLingerBytesMax = size_t{1} << 20;
constexpr int kOpenStreamMax = 64;
// A client that takes less than that in the time it has takes nothing.
constexpr size_t kProgressBytes = size_t{64} << 10;

std::string_view ViewOf(boost::beast::string_view text) { return {text.data(), text.size()}; }

template <typename Message>
RequestHead HeadOf(const Message& message) {
  RequestHead head;
  head.method = ViewOf(message.method_string());
  head.target = ViewOf(message.target());
  for (const auto& field : message) {
    head.fields.emplace_back(ViewOf(field.name_string()), ViewOf(field.value()));
  }
  return head;
}

Refusal Malformed(const std::string& message) {
  return {400, absl::InvalidArgumentError(message), ""};
}

Refusal TooLong(int http_status, const std::string& message) {
  return {http_status, absl::ResourceExhaustedError(message), ""};
}

}  // namespace

Session::Session(SessionRuntime* runtime, Socket socket, std::shared_ptr<Connection> connection)
    : runtime_(runtime), connection_(std::move(connection)), socket_(std::move(socket)) {}

void Session::Start() {
  runtime_->sessions.insert(shared_from_this());
  NextRequest();
}

void Session::Look(Clock::time_point now) {
  if (now < due_) return;
  if (phase_ == Phase::kRequest && (has_head_ || !unparsed_.empty())) {
    Refuse({408, absl::DeadlineExceededError("the request did not come whole in time"), ""});
  } else {
    Close();
  }
}

void Session::Stop() {
  keeps_connection_ = false;
  if (phase_ == Phase::kRequest) Close();
}

void Session::EndAnswer(const absl::Status& why) {
  if (phase_ != Phase::kAnswer) return;
  // What is half sent cannot be taken back, and such a reader takes nothing.
  if (call_ == nullptr || (sending_.has_value() && absl::IsResourceExhausted(why))) return Close();
  // Others are told why, behind what is leaving; they may take no more of that either.
  last_due_ = std::min(last_due_, Clock::now() + 2 * runtime_->stall_max);
  if (sending_.has_value()) GiveTime();
  call_->served()->Cancel();
}

void Session::Close() {
  if (phase_ == Phase::kClosed) return;
  phase_ = Phase::kClosed;
  arrival_ = nullptr;
  error_code ignored;
  socket_.close(ignored);
  // A call ends by itself, and FinishAnswer then removes this.
  if (call_ != nullptr) {
    call_->served()->Cancel();
  } else {
    Remove();
  }
}

void Session::Remove() {
  runtime_->sessions.erase(shared_from_this());
  if (runtime_->is_stopping && runtime_->sessions.empty()) runtime_->work.reset();
}

void Session::Write(AnswerBytes bytes, bool is_last) {
  asio::post(runtime_->io, [self = shared_from_this(), bytes = std::move(bytes),
                            is_last]() mutable { self->SendBytes(std::move(bytes), is_last); });
}

void Session::End(uint64_t number, const absl::Status& why) {
  asio::post(runtime_->io, [self = shared_from_this(), number, why] {
    if (self->call_number_ != number) return;
    if (self->phase_ == Phase::kRequest) {
      self->Refuse({429,
                    OverloadedError("the server receives too many requests at once, and this is "
                                    "the oldest of the connection with the most"),
                    ""});
    } else {
      self->EndAnswer(why);
    }
  });
}

// Reading

void Session::NextRequest() {
  phase_ = Phase::kRequest;
  has_head_ = false;
  ++call_number_;
  parser_.emplace();
  parser_->header_limit(kHeadBytesMax);
  // The plan of a call lowers it.
  parser_->body_limit(kMessageBytesMaxOnWire + kEnvelopeBytes);
  due_ = Clock::now() + kIdleMax;
  last_due_ = Clock::time_point::max();
  if (unparsed_.empty()) {
    ReadMore();
  } else {
    Parse();
  }
}

void Session::ReadMore() {
  if (is_reading_ || has_left_ || unparsed_.size() > kAheadBytesMax) return;
  is_reading_ = true;
  socket_.async_read_some(asio::buffer(read_),
                          [self = shared_from_this()](error_code error, size_t byte_count) {
                            self->OnRead(!error, byte_count);
                          });
}

void Session::OnRead(bool ok, size_t byte_count) {
  is_reading_ = false;
  if (phase_ == Phase::kClosed) return;
  if (phase_ != Phase::kLinger) unparsed_.append(read_.data(), byte_count);
  if (phase_ == Phase::kAnswer) {
    has_left_ = !ok;
    if (has_left_ && call_ != nullptr) call_->served()->Cancel();
    ReadMore();
  } else if (!ok) {
    Close();
  } else if (phase_ == Phase::kLinger) {
    // Beyond that the client has to wait, until Look closes the connection.
    lingered_bytes_ += byte_count;
    if (lingered_bytes_ < kLingerBytesMax) ReadMore();
  } else {
    Parse();
  }
}

void Session::Parse() {
  while (true) {
    const bool had_head = has_head_;
    error_code error;
    const asio::const_buffer unparsed(unparsed_.data(), unparsed_.size());
    unparsed_.erase(0, parser_->put(unparsed, error));
    if (error && error != http::error::need_more) return RefuseUnparsed(error);
    has_head_ = parser_->is_header_done();
    if (has_head_ && !had_head && !TakeHead()) return;
    if (parser_->is_done()) return TakeRequest();
    // The body follows the head only when asked for.
    if (has_head_ && !had_head && !unparsed_.empty()) continue;
    break;
  }
  if (has_head_) {
    AwaitBody();
  } else if (!unparsed_.empty()) {
    // From the first byte on.
    due_ = std::min(due_, Clock::now() + kHeadMax);
  }
  ReadMore();
  // A line of a chunk that has no end.
  if (!is_reading_) Refuse(Malformed("the body has a line without an end"));
}

bool Session::TakeHead() {
  parser_->eager(true);
  const bool has_old_version = parser_->get().version() < 11;
  keeps_connection_ = parser_->keep_alive() && !runtime_->is_stopping;
  if (const auto refusal = PlanOf(HeadOf(parser_->get())); refusal.has_value()) {
    Refuse(*refusal);
    return false;
  }
  // Such a client sees the end of a stream by that of the connection.
  if (has_old_version && plan_.type.is_stream) keeps_connection_ = false;
  return true;
}

std::optional<Refusal> Session::PlanOf(const RequestHead& head) {
  plan_ = CallPlan();
  if (auto refusal = runtime_->rules->Check(head)) return refusal;
  const uint64_t body_bytes = parser_->content_length().value_or(0);
  if (head.is_file()) {
    if (body_bytes == 0 && !parser_->chunked()) return std::nullopt;
    return Malformed("the request is a GET with a body; send none");
  }
  auto planned = PlanCall(*runtime_->methods, head, runtime_->may_write);
  if (auto* const refusal = std::get_if<Refusal>(&planned)) return std::move(*refusal);
  plan_ = std::get<CallPlan>(planned);
  auto caller =
      runtime_->calls->access->Identify(connection_->identity, head.Find("authorization"));
  if (!caller.ok()) {
    TellRefused(*plan_.method, caller.status());
    return Refusal{401, caller.status(), "WWW-Authenticate: Bearer\r\n"};
  }
  plan_.caller = *std::move(caller);
  if (body_bytes > plan_.body_bytes_max) {
    return TooLong(413, absl::StrCat("the body has ", body_bytes, " bytes, and at most ",
                                     plan_.body_bytes_max, " are taken; ask for less"));
  }
  parser_->body_limit(plan_.body_bytes_max);
  return std::nullopt;
}

void Session::TellRefused(const Method& method, const absl::Status& why) const {
  runtime_->calls->audit->End({&method.info, "", connection_->peer}, why, 0);
  runtime_->calls->log.Write({method.info.name, "", why, 0, 0, {}, connection_->peer, ""});
}

void Session::AwaitBody() {
  if (arrival_ != nullptr) return;
  due_ = BoundDeadline(plan_.deadline);
  arrival_ = runtime_->calls->arrivals->Enter(
      [self = weak_from_this(), number = call_number_](const absl::Status& why) {
        if (const auto session = self.lock()) session->End(number, why);
      },
      connection_.get());
}

void Session::TakeRequest() {
  arrival_ = nullptr;
  phase_ = Phase::kAnswer;
  due_ = Clock::time_point::max();
  if (plan_.method == nullptr) {
    SendFile();
  } else {
    BeginCall();
  }
  // Notices that the client leaves.
  ReadMore();
}

void Session::BeginCall() {
  if (plan_.type.is_stream && runtime_->open_stream_count >= kOpenStreamMax) {
    Refuse({429,
            OverloadedError(absl::StrCat("the HTTP port has ", kOpenStreamMax,
                                         " streams open, as many as it takes at a time")),
            ""});
    return;
  }
  HttpCall::Place place;
  place.outlet = shared_from_this();
  place.connection = connection_;
  place.number = call_number_;
  place.may_chunk = parser_->get().version() >= 11;
  place.keeps_connection = keeps_connection_;
  call_ = std::make_unique<HttpCall>(plan_, std::move(parser_->get().body()), std::move(place));
  if (call_->is_stream()) ++runtime_->open_stream_count;
  parser_.reset();
  if (call_->served()->Admit(plan_.caller)) call_->served()->Begin();
}

void Session::SendFile() {
  const RequestHead head = HeadOf(parser_->get());
  const WebFile* const file = FindWebFile(head.target);
  if (file == nullptr) {
    Refuse({404,
            absl::NotFoundError("no file has this path; calls are POST, and / is the first page"),
            ""});
    return;
  }
  const bool is_known = head.Find("if-none-match").value_or("") == file->etag;
  // The bytes belong to this build: a browser keeps them, and asks whether they changed.
  const std::string fields =
      absl::StrCat("Cache-Control: no-cache\r\nETag: ", std::string(file->etag), "\r\n");
  AnswerHead answer;
  answer.status = is_known ? 304 : 200;
  answer.fields = fields;
  answer.keeps_connection = keeps_connection_;
  if (!is_known) {
    answer.content_type = file->type;
    answer.body_bytes = file->bytes.size();
  }
  const bool has_body = !is_known && head.method == "GET";
  SendBytes({TextOf(answer), std::string(has_body ? file->bytes : ""), ""}, /*is_last=*/true);
}

// The rest of the request is not read, so the connection takes no other one.
void Session::Refuse(const Refusal& refusal) {
  arrival_ = nullptr;
  phase_ = Phase::kAnswer;
  keeps_connection_ = false;
  std::string body = ErrorJson(refusal.error);
  const std::string fields =
      absl::StrCat("Cache-Control: no-store\r\n", std::string(refusal.fields));
  AnswerHead answer;
  answer.status = refusal.http_status;
  answer.content_type = "application/json";
  answer.body_bytes = body.size();
  answer.keeps_connection = false;
  answer.fields = fields;
  const bool is_head = has_head_ && parser_->get().method() == http::verb::head;
  if (is_head) body.clear();
  SendBytes({TextOf(answer), std::move(body), ""}, /*is_last=*/true);
}

void Session::RefuseUnparsed(const error_code& error) {
  if (error == http::error::header_limit) {
    Refuse(TooLong(431, absl::StrCat("the head of the request has more than ", kHeadBytesMax,
                                     " bytes; send fewer or shorter fields")));
  } else if (error == http::error::body_limit) {
    Refuse(TooLong(413, "the body is longer than is taken; ask for less at a time"));
  } else {
    Refuse(Malformed(
        absl::StrCat("the request is no HTTP/1.1: ", error.message(), "; use an HTTP client")));
  }
}

// Answering

void Session::SendBytes(AnswerBytes bytes, bool is_last) {
  if (phase_ == Phase::kClosed) return DropPart(is_last);
  Part part{std::move(bytes), is_last};
  if (sending_.has_value()) {
    waiting_ = std::move(part);
  } else {
    SendPart(std::move(part));
  }
}

void Session::SendPart(Part part) {
  sending_ = std::move(part);
  const AnswerBytes& bytes = sending_->bytes;
  const std::array<asio::const_buffer, 3> buffers{
      asio::buffer(bytes.head), asio::buffer(bytes.message), asio::buffer(bytes.tail)};
  unsent_ = decltype(unsent_)(buffers);
  taken_bytes_ = 0;
  // Whoever streams has a guard until then; see StreamCall.
  if (sending_->is_last || due_ != Clock::time_point::max()) GiveTime();
  SendMore();
  // The next part is made while this one leaves.
  if (!sending_->is_last) call_->served()->OnSent(/*ok=*/true);
}

void Session::SendMore() {
  socket_.async_write_some(unsent_,
                           [self = shared_from_this()](error_code error, size_t byte_count) {
                             self->OnTaken(!error, byte_count);
                           });
}

void Session::OnTaken(bool ok, size_t byte_count) {
  unsent_.consume(byte_count);
  if (!ok || boost::beast::buffer_bytes(unsent_) == 0) return OnSent(ok);
  taken_bytes_ += byte_count;
  if (taken_bytes_ >= kProgressBytes) {
    taken_bytes_ = 0;
    if (due_ != Clock::time_point::max()) GiveTime();
    if (call_ != nullptr) call_->served()->OnProgress();
  }
  SendMore();
}

void Session::GiveTime() { due_ = std::min(Clock::now() + runtime_->stall_max, last_due_); }

void Session::OnSent(bool ok) {
  const bool was_last = sending_->is_last;
  sending_.reset();
  if (!ok) Close();
  if (was_last) return FinishAnswer();
  if (!waiting_.has_value()) return;
  Part next = std::move(*waiting_);
  waiting_.reset();
  if (phase_ == Phase::kClosed) {
    DropPart(next.is_last);
  } else {
    SendPart(std::move(next));
  }
}

void Session::DropPart(bool is_last) {
  if (is_last) {
    FinishAnswer();
  } else {
    call_->served()->OnSent(/*ok=*/false);
  }
}

void Session::FinishAnswer() {
  const bool was_call = call_ != nullptr;
  if (was_call && call_->is_stream()) --runtime_->open_stream_count;
  call_ = nullptr;
  if (phase_ == Phase::kClosed) {
    if (was_call) Remove();
  } else if (has_left_) {
    Close();
  } else if (keeps_connection_) {
    NextRequest();
  } else {
    Linger();
  }
}

void Session::Linger() {
  phase_ = Phase::kLinger;
  due_ = Clock::now() + kLingerMax;
  error_code ignored;
  socket_.shutdown(asio::socket_base::shutdown_send, ignored);
  std::string().swap(unparsed_);
  ReadMore();
}

}  // namespace dsg::server
