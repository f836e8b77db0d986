// SPDX-License-Identifier: Apache-2.0
// One HTTP connection: reads requests, one after another, and sends their answers. All but Outlet
// runs on the thread of the port.
#pragma once

// Asio 1.18 uses std::exchange without it.
#include <utility>
// In this order.
#include <array>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/beast/core/buffers_suffix.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "server/http/access_rules.h"
#include "server/http/http_call.h"

namespace dsg::server {

class Session;

/// What the sessions of a port share. Used on the port's thread only.
struct SessionRuntime {
  using Clock = std::chrono::steady_clock;

  boost::asio::io_context io{1};
  // Keeps the thread of `io` from ending while there is a session, or the port is open.
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work =
      boost::asio::make_work_guard(io);
  const MethodTable* methods = nullptr;
  CallRuntime* calls = nullptr;
  const AccessRules* rules = nullptr;
  bool may_write = false;
  Clock::duration stall_max{};
  bool is_stopping = false;
  int open_stream_count = 0;
  std::set<std::shared_ptr<Session>> sessions;
};

class Session final : public Outlet, public std::enable_shared_from_this<Session> {
 public:
  using Clock = SessionRuntime::Clock;
  using Socket = boost::asio::generic::stream_protocol::socket;

  Session(SessionRuntime* runtime, Socket socket, std::shared_ptr<Connection> connection);

  void Start();
  /// Closes the connection if its time is over.
  void Look(Clock::time_point now);
  /// Takes no more requests: closes the connection, when its answer has been sent.
  void Stop();
  /// Ends the call that is being answered. `why`: RESOURCE_EXHAUSTED if its reader takes nothing.
  void EndAnswer(const absl::Status& why);
  /// Closes the connection now.
  void Close();

  // From any thread.
  void Write(AnswerBytes bytes, bool is_last) override;
  void End(uint64_t number, const absl::Status& why) override;

 private:
  enum class Phase {
    /// Waits for a request, or has part of one.
    kRequest,
    /// A call is running, or an answer is being sent.
    kAnswer,
    /// All has been sent; waits for the client to close the connection, since closing it at once
    /// may take away from the client what it has not read yet.
    kLinger,
    kClosed,
  };
  using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;
  struct Part {
    AnswerBytes bytes;
    bool is_last = false;
  };

  void NextRequest();
  void ReadMore();
  void OnRead(bool ok, size_t byte_count);
  // Gives what has come to the parser.
  void Parse();
  // False if the request is refused.
  bool TakeHead();
  // A call without a caller stands in both logs, as over gRPC.
  void TellRefused(const Method& method, const absl::Status& why) const;
  std::optional<Refusal> PlanOf(const RequestHead& head);
  // Waits for the rest of a body.
  void AwaitBody();
  void TakeRequest();
  void BeginCall();
  void SendFile();
  void Refuse(const Refusal& refusal);
  void RefuseUnparsed(const boost::system::error_code& error);

  // Sends a part of the answer as soon as the one before has left.
  void SendBytes(AnswerBytes bytes, bool is_last);
  void SendPart(Part part);
  void SendMore();
  void OnTaken(bool ok, size_t byte_count);
  void OnSent(bool ok);
  // Of a part of which the client takes nothing.
  void GiveTime();
  // A part that is not sent, since the connection is closed.
  void DropPart(bool is_last);
  void FinishAnswer();
  void Linger();
  void Remove();

  SessionRuntime* const runtime_;
  const std::shared_ptr<Connection> connection_;
  Socket socket_;
  Phase phase_ = Phase::kRequest;
  // When Look closes the connection.
  Clock::time_point due_ = Clock::time_point::max();
  // How long what has been made of an answer that was ended may take, however slowly it is taken.
  Clock::time_point last_due_ = Clock::time_point::max();

  // Reading. While a call runs, one read stays pending: it tells that the client has left.
  std::array<char, size_t{16} << 10> read_;
  bool is_reading_ = false;
  // What has been read and not parsed.
  std::string unparsed_;
  std::optional<Parser> parser_;
  bool has_head_ = false;
  bool has_left_ = false;
  size_t lingered_bytes_ = 0;
  std::unique_ptr<Arrivals::Place> arrival_;

  // The request.
  CallPlan plan_;
  bool keeps_connection_ = true;

  // Answering.
  uint64_t call_number_ = 0;
  std::unique_ptr<HttpCall> call_;
  // The part that is leaving, and the next one, of which there is none while it is still made.
  std::optional<Part> sending_;
  // What has not left of it, and what has since the client got time.
  boost::beast::buffers_suffix<std::array<boost::asio::const_buffer, 3>> unsent_;
  size_t taken_bytes_ = 0;
  std::optional<Part> waiting_;
};

}  // namespace dsg::server
