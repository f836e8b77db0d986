// SPDX-License-Identifier: Apache-2.0
#include <signal.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "schema/base/log.h"
#include "server/tls/tls_loop_internal.h"

namespace dsg::server {
namespace {

constexpr uint64_t kWakeupTag = 0;
// The tags of a connection's sockets are twice its id, and one more for the plain one.
uint64_t TcpTag(uint64_t id) { return 2 * id; }
uint64_t PlainTag(uint64_t id) { return 2 * id + 1; }

// A step of a handshake takes a millisecond or two; connections that copy wait for no more steps
// than these.
constexpr int kShakesAtATime = 4;
// How long a client may take to close once it has been told the end and nobody reads what it sends.
constexpr std::chrono::milliseconds kDrainTime{1'000};

// OpenSSL writes without MSG_NOSIGNAL, and no handler is to run on this thread.
void BlockSignals() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

}  // namespace

std::optional<int> LogLimit::Pass() {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) {
    ++left_out_count_;
    return std::nullopt;
  }
  next_ = now + std::chrono::seconds(1);
  return std::exchange(left_out_count_, 0);
}

TlsLoop::Entry::Entry(TlsArrival arrival)
    : connection(std::move(arrival.fd), std::move(arrival.context)),
      peer(std::move(arrival.peer)),
      take(std::move(arrival.take)) {}

TlsLoop::~TlsLoop() {
  BeginStop(Clock::now());
  Join();
}

absl::Status TlsLoop::Start() {
  epoll_fd_ = OwnedFd(epoll_create1(EPOLL_CLOEXEC));
  wakeup_fd_ = OwnedFd(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (epoll_fd_.get() < 0 || wakeup_fd_.get() < 0 || !Watch(wakeup_fd_.get(), kWakeupTag)) {
    return absl::UnavailableError(
        absl::StrCat("cannot start a thread for TLS: ", std::strerror(errno),
                     "; raise the limit of open files (ulimit -n)"));
  }
  chunk_.resize(kTlsChunkBytes);
  thread_ = std::thread([this] { Run(); });
  return absl::OkStatus();
}

bool TlsLoop::Add(TlsArrival arrival) {
  {
    const std::lock_guard lock(mutex_);
    if (stop_at_.has_value()) return false;
    inbox_.push_back(std::move(arrival));
  }
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(wakeup_fd_.get(), &one, sizeof(one));
  return true;
}

void TlsLoop::BeginStop(Clock::time_point deadline) {
  {
    const std::lock_guard lock(mutex_);
    if (!stop_at_.has_value()) stop_at_ = deadline;
  }
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(wakeup_fd_.get(), &one, sizeof(one));
}

void TlsLoop::Join() {
  if (thread_.joinable()) thread_.join();
}

void TlsLoop::Run() {
  BlockSignals();
  std::array<epoll_event, 256> events{};
  while (true) {
    const int count =
        epoll_wait(epoll_fd_.get(), events.data(), static_cast<int>(events.size()), WaitMs());
    for (int i = 0; i < count; ++i) Note(events[i].data.u64, events[i].events);
    if (TakeInbox()) break;
    ServeQueues();
    Expire();
  }
  while (!entries_.empty()) Close(entries_.begin()->first);
}

bool TlsLoop::TakeInbox() {
  std::vector<TlsArrival> arrivals;
  {
    const std::lock_guard lock(mutex_);
    arrivals.swap(inbox_);
    ends_at_ = stop_at_;
  }
  for (TlsArrival& arrival : arrivals) {
    const uint64_t id = ++last_id_;
    Entry* entry =
        entries_.emplace(id, std::make_unique<Entry>(std::move(arrival))).first->second.get();
    SetDeadline(id, entry, Clock::now() + shared_->options.handshake_time_max);
    if (Watch(entry->connection.tcp_fd(), TcpTag(id))) {
      Enqueue(id, entry);
    } else {
      Close(id);
    }
  }
  if (!ends_at_.has_value()) return false;
  if (!std::exchange(stops_, true)) {
    std::vector<uint64_t> ids;
    for (const auto& [id, entry] : entries_) {
      if (entry->is_shaking) ids.push_back(id);
    }
    for (const uint64_t id : ids) Close(id);
  }
  return entries_.empty() || Clock::now() >= *ends_at_;
}

int TlsLoop::WaitMs() const {
  if (!copying_.empty() || !shaking_.empty()) return 0;
  if (ends_at_.has_value() && entries_.empty()) return 0;
  std::optional<Clock::time_point> next = ends_at_;
  if (!deadlines_.empty() && (!next.has_value() || deadlines_.begin()->first < *next)) {
    next = deadlines_.begin()->first;
  }
  if (!next.has_value()) return -1;
  // Rounded up: what is due in less than a millisecond must not be polled for.
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(*next - Clock::now());
  return static_cast<int>(std::clamp<int64_t>(wait.count(), 0, 60'000));
}

void TlsLoop::Note(uint64_t tag, uint32_t events) {
  if (tag == kWakeupTag) {
    uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = read(wakeup_fd_.get(), &count, sizeof(count));
    return;
  }
  const uint64_t id = tag / 2;
  const auto found = entries_.find(id);
  if (found == entries_.end()) return;
  if (tag == TcpTag(id)) {
    found->second->connection.MarkTcp(events);
  } else {
    found->second->connection.MarkPlain(events);
  }
  Enqueue(id, found->second.get());
}

void TlsLoop::Enqueue(uint64_t id, Entry* entry) {
  if (std::exchange(entry->is_queued, true)) return;
  (entry->is_shaking ? shaking_ : copying_).push_back(id);
}

// A turn for each connection that copies, then some handshakes, so that neither a fast pair nor a
// flood of handshakes keeps others waiting.
void TlsLoop::ServeQueues() {
  for (size_t count = copying_.size(); count > 0; --count) {
    const uint64_t id = copying_.front();
    copying_.pop_front();
    Serve(id);
  }
  for (int i = 0; i < kShakesAtATime && !shaking_.empty(); ++i) {
    const uint64_t id = shaking_.front();
    shaking_.pop_front();
    Serve(id);
  }
}

void TlsLoop::Serve(uint64_t id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return;
  Entry* entry = found->second.get();
  entry->is_queued = false;
  if (entry->is_shaking) return Shake(id, entry);
  const TlsConnection::Turn turn = entry->connection.Copy(chunk_);
  if (turn == TlsConnection::Turn::kOver) return Close(id);
  if (turn == TlsConnection::Turn::kMore) Enqueue(id, entry);
  const TlsConnection::Closing closing = entry->connection.closing();
  if (closing == std::exchange(entry->closing, closing)) return;
  SetDeadline(
      id, entry,
      Clock::now() +
          (closing == TlsConnection::Closing::kDrains ? kDrainTime : shared_->options.linger));
}

void TlsLoop::Shake(uint64_t id, Entry* entry) {
  const TlsConnection::Turn turn = entry->connection.Shake();
  if (turn == TlsConnection::Turn::kWaits) return;
  if (turn == TlsConnection::Turn::kOver) {
    const std::string& why = entry->connection.why();
    const std::optional<int> left_out = why.empty() ? std::nullopt : shared_->failed.Pass();
    if (left_out.has_value()) {
      Log(LogLevel::kWarning, "TLS handshake failed",
          {{"peer", entry->peer}, {"why", why}, {"left_out", absl::StrCat(*left_out)}});
    }
    return Close(id);
  }
  OwnedFd theirs;
  if (!MakePlain(id, entry, &theirs)) return Close(id);
  entry->is_shaking = false;
  --shared_->handshake_count;
  SetDeadline(id, entry, std::nullopt);
  // The callback may hold much; it is freed when it has been called.
  const TlsTerminator::Take take = std::move(entry->take);
  take(theirs.Release(), entry->connection.ClientName());
  Enqueue(id, entry);
}

bool TlsLoop::MakePlain(uint64_t id, Entry* entry, OwnedFd* theirs) {
  int pair[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) == 0) {
    *theirs = OwnedFd(pair[1]);
    entry->connection.Join(OwnedFd(pair[0]));
    if (Watch(pair[0], PlainTag(id))) return true;
  }
  const std::string why = std::strerror(errno);
  if (const auto left_out = shared_->starved.Pass(); left_out.has_value()) {
    Log(LogLevel::kWarning, "no socket for a TLS connection",
        {{"peer", entry->peer}, {"why", why}, {"left_out", absl::StrCat(*left_out)}});
  }
  return false;
}

// Edges: a socket that stays ready while its other side is full must not wake the thread.
bool TlsLoop::Watch(int fd, uint64_t tag) {
  epoll_event event{};
  event.events = EPOLLIN | EPOLLOUT | EPOLLRDHUP | EPOLLET;
  event.data.u64 = tag;
  return epoll_ctl(epoll_fd_.get(), EPOLL_CTL_ADD, fd, &event) == 0;
}

void TlsLoop::SetDeadline(uint64_t id, Entry* entry, std::optional<Clock::time_point> deadline) {
  if (entry->deadline.has_value()) deadlines_.erase({*entry->deadline, id});
  entry->deadline = deadline;
  if (deadline.has_value()) deadlines_.emplace(*deadline, id);
}

void TlsLoop::Expire() {
  const Clock::time_point now = Clock::now();
  while (!deadlines_.empty() && deadlines_.begin()->first <= now) {
    const uint64_t id = deadlines_.begin()->second;
    const Entry& entry = *entries_.at(id);
    const std::optional<int> left_out = entry.is_shaking ? shared_->failed.Pass() : std::nullopt;
    if (left_out.has_value()) {
      Log(LogLevel::kWarning, "TLS handshake failed",
          {{"peer", entry.peer},
           {"why", "it took too long"},
           {"left_out", absl::StrCat(*left_out)}});
    }
    Close(id);
  }
}

void TlsLoop::Close(uint64_t id) {
  const auto found = entries_.find(id);
  SetDeadline(id, found->second.get(), std::nullopt);
  const bool was_shaking = found->second->is_shaking;
  entries_.erase(found);
  // After its descriptors are closed: who sees the count may count them.
  if (was_shaking) --shared_->handshake_count;
  --shared_->open_count;
}

}  // namespace dsg::server
