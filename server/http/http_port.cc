// SPDX-License-Identifier: Apache-2.0
#include "server/http/http_port.h"

#include "server/http/session_internal.h"
// Before the rest of Asio.
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/log.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

namespace asio = boost::asio;
using Clock = SessionRuntime::Clock;

constexpr size_t kSessionMax = 256;
// How often the sessions are looked at.
constexpr std::chrono::milliseconds kLookPeriod{200};
// What the kernel keeps of an answer that is not read; it doubles the number.
constexpr int kSendBufferBytes = 128 << 10;
// For those that were told to end to send what they end with.
constexpr std::chrono::milliseconds kLastWordsMax{3000};

class RunningPort final : public HttpPort {
 public:
  RunningPort(const HttpOptions& options, std::chrono::milliseconds stall_max,
              const MethodTable* methods, CallRuntime* calls, ConnectionFront* front)
      : front_(front) {
    sessions_.methods = methods;
    sessions_.calls = calls;
    // Where callers have roles, these say who may write.
    sessions_.may_write = options.may_write || calls->access->asks_who();
    sessions_.stall_max = stall_max;
  }

  ~RunningPort() override {
    if (!thread_.joinable()) return;
    BeginShutdown(std::chrono::milliseconds(0));
    Join();
  }

  absl::Status Listen(const HttpOptions& options, bool allow_remote) {
    DSG_ASSIGN_OR_RETURN(const ListenAddress address,
                         ParseListenAddress(options.listen, allow_remote));
    if (address.is_unix()) {
      DSG_ASSIGN_OR_RETURN(claim_, UnixSocketClaim::Take(address.socket_path));
    }
    DSG_ASSIGN_OR_RETURN(acceptor_, Acceptor::Listen(address));
    std::string token;
    const bool asks_who = sessions_.calls->access->asks_who();
    if (!options.without_token && !address.is_unix() && !asks_who) {
      DSG_ASSIGN_OR_RETURN(token, MakeToken());
    }
    const ListenAddress& actual = acceptor_->address();
    url_ = actual.is_unix()
               ? actual.ToString()
               : absl::StrCat(front_->encrypts() ? "https://" : "http://", actual.ToString(), "/");
    if (!token.empty()) absl::StrAppend(&url_, "#token=", token);
    rules_.emplace(actual, options.hosts, std::move(token));
    sessions_.rules = &*rules_;
    return absl::OkStatus();
  }

  void Start() override {
    LookLater();
    thread_ = std::thread([this] { sessions_.io.run(); });
    acceptor_->Start([this](int fd, const std::string& peer) {
      front_->Pass(fd, acceptor_->address().is_unix(), ConnectionFront::Protocol::kHttp, peer,
                   [this, peer](int plain_fd, const Peer& identity) {
                     TakeLater(plain_fd, peer, identity);
                   });
    });
  }

  const std::string& url() const override { return url_; }

  void BeginShutdown(std::chrono::milliseconds grace) override {
    acceptor_->Stop();
    asio::post(sessions_.io, [this, grace] {
      if (sessions_.is_stopping) return;
      sessions_.is_stopping = true;
      ForEach(&Session::Stop);
      end_due_ = Clock::now() + grace;
      Look();
    });
  }

  void Join() override {
    if (thread_.joinable()) thread_.join();
  }

 private:
  // On any thread.
  void TakeLater(int fd, const std::string& peer, const Peer& identity) {
    auto connection = sessions_.calls->connections->Add(fd, peer, identity);
    if (connection == nullptr) {
      close(fd);
      return;
    }
    asio::post(sessions_.io,
               [this, fd, connection = std::move(connection)] { Take(fd, connection); });
  }

  void Take(int fd, std::shared_ptr<Connection> connection) {
    const bool is_full = sessions_.sessions.size() >= kSessionMax;
    if (is_full && !is_full_) {
      Log(LogLevel::kWarning, "refusing HTTP connections",
          {{"open", absl::StrCat(kSessionMax)}, {"peer", connection->peer}});
    }
    is_full_ = is_full;
    if (is_full || sessions_.is_stopping) {
      close(fd);
      return;
    }
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof(kSendBufferBytes));
    Session::Socket socket(sessions_.io);
    boost::system::error_code error;
    socket.assign(asio::generic::stream_protocol(AF_UNSPEC, 0), fd, error);
    if (error) {
      close(fd);
      return;
    }
    std::make_shared<Session>(&sessions_, std::move(socket), std::move(connection))->Start();
  }

  // Sessions may go meanwhile.
  template <typename Function, typename... Arguments>
  void ForEach(Function function, Arguments... arguments) {
    const std::vector<std::shared_ptr<Session>> sessions(sessions_.sessions.begin(),
                                                         sessions_.sessions.end());
    for (const auto& session : sessions) ((*session).*function)(arguments...);
  }

  void LookLater() {
    timer_.expires_after(kLookPeriod);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) Look();
    });
  }

  void Look() {
    const Clock::time_point now = Clock::now();
    ForEach(&Session::Look, now);
    if (sessions_.is_stopping) {
      if (now >= end_due_) ForEach(&Session::EndAnswer, ShuttingDownError());
      if (now >= end_due_ + kLastWordsMax) ForEach(&Session::Close);
      if (sessions_.sessions.empty()) {
        sessions_.work.reset();
        timer_.cancel();
        return;
      }
    }
    LookLater();
  }

  SessionRuntime sessions_;
  ConnectionFront* const front_;
  std::optional<AccessRules> rules_;
  std::string url_;
  std::unique_ptr<UnixSocketClaim> claim_;
  std::unique_ptr<Acceptor> acceptor_;
  asio::steady_timer timer_{sessions_.io};
  // The last connection was refused.
  bool is_full_ = false;
  // When the answers that are still being sent end; after is_stopping.
  Clock::time_point end_due_;
  std::thread thread_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<HttpPort>> HttpPort::Listen(
    const HttpOptions& options, bool allow_remote, std::chrono::milliseconds stall_max,
    const MethodTable* methods, CallRuntime* runtime, ConnectionFront* front) {
  auto port = std::make_unique<RunningPort>(options, stall_max, methods, runtime, front);
  DSG_RETURN_IF_ERROR(port->Listen(options, allow_remote));
  return std::unique_ptr<HttpPort>(std::move(port));
}

}  // namespace dsg::server
