// SPDX-License-Identifier: Apache-2.0
#include "server/tls/tls_terminator.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/log.h"
#include "schema/base/status.h"
#include "server/tls/tls_loop_internal.h"

namespace dsg::server {

absl::StatusOr<std::unique_ptr<TlsTerminator>> TlsTerminator::Start(
    const TlsTerminatorOptions& options) {
  std::unique_ptr<TlsTerminator> made(new TlsTerminator(options));
  for (int i = 0; i < std::max(1, options.thread_count); ++i) {
    made->loops_.push_back(std::make_unique<TlsLoop>(made->shared_.get()));
    DSG_RETURN_IF_ERROR(made->loops_.back()->Start());
  }
  return made;
}

TlsTerminator::TlsTerminator(const TlsTerminatorOptions& options)
    : shared_(std::make_unique<TlsShared>(options)) {}

TlsTerminator::~TlsTerminator() { Stop(); }

void TlsTerminator::Accept(int fd, std::shared_ptr<const TlsContext> context, std::string peer,
                           Take take) {
  TlsArrival arrival{OwnedFd(fd), std::move(context), std::move(peer), std::move(take)};
  const TlsTerminatorOptions& options = shared_->options;
  // Counted here and not when the loop gets it: a flood must not fill the inbox.
  const bool is_crowded = ++shared_->open_count > options.connection_max;
  const bool is_rushed = ++shared_->handshake_count > options.handshake_max;
  if (is_crowded || is_rushed) {
    arrival.fd.Reset();
    if (const auto left_out = shared_->crowded.Pass(); left_out.has_value()) {
      Log(LogLevel::kWarning, "connection closed: too many",
          {{"peer", arrival.peer},
           {"of", is_crowded ? "connections" : "handshakes"},
           {"left_out", absl::StrCat(*left_out)}});
    }
  } else {
    const unsigned at = shared_->next_loop++ % static_cast<unsigned>(loops_.size());
    if (loops_[at]->Add(std::move(arrival))) return;
  }
  // Its descriptor is closed by now: who sees the count may count descriptors.
  --shared_->handshake_count;
  --shared_->open_count;
}

void TlsTerminator::Stop(std::chrono::milliseconds grace) {
  const auto deadline = TlsLoop::Clock::now() + grace;
  for (const auto& loop : loops_) loop->BeginStop(deadline);
  for (const auto& loop : loops_) loop->Join();
}

int TlsTerminator::open_count() const { return shared_->open_count; }

int TlsTerminator::handshake_count() const { return shared_->handshake_count; }

}  // namespace dsg::server
