// SPDX-License-Identifier: Apache-2.0
// The verb watch: revisions as they come.
#include <chrono>
#include <optional>
#include <thread>

#include "dsg/v1/map_service.pb.h"
#include "query/cli/interrupt.h"
#include "query/cli/json.h"
#include "query/cli/render_changes.h"
#include "query/cli/tag_names.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

using Clock = query::CallContext::Clock;

// Prints what comes and remembers how far it has come.
class Printer {
 public:
  Printer(const Session& session, const WatchVerb& verb, std::optional<int64_t> after,
          std::ostream& out)
      : session_(session), verb_(verb), out_(out), after_(after) {}

  /// False when no more is wanted.
  bool Take(const v1::WatchMapResponse& message) {
    after_ = message.header().read_revision();
    if (!message.has_revision()) return static_cast<bool>(out_);
    status_ = Print(message);
    out_.flush();
    if (message.complete()) ++count_;
    return status_.ok() && out_ && !IsDone();
  }

  bool IsDone() const { return verb_.count > 0 && count_ >= verb_.count; }
  std::optional<int64_t> after() const { return after_; }
  const absl::Status& status() const { return status_; }

 private:
  absl::Status Print(const v1::WatchMapResponse& message) {
    if (session_.common().json) return WriteJsonLine(message, out_);
    // Parts of one revision have one heading.
    if (message.revision().revision() != shown_) out_ << RenderRevision(message.revision());
    shown_ = message.revision().revision();
    if (message.has_changes()) out_ << RenderChanges(message.changes(), session_.times());
    return absl::OkStatus();
  }

  const Session& session_;
  const WatchVerb& verb_;
  std::ostream& out_;
  std::optional<int64_t> after_;
  int64_t count_ = 0;
  int64_t shown_ = -1;
  absl::Status status_;
};

// Waits for a server that went away, and tells people about it.
class Patience {
 public:
  explicit Patience(std::ostream* notes) : notes_(*notes) {}

  void Heard(int64_t revision) {
    if (is_lost_) {
      notes_ << "dsg: the server is back; watching on after revision " << revision_ << "\n"
             << std::flush;
    }
    is_lost_ = false;
    has_heard_ = true;
    revision_ = revision;
  }

  /// False if it is not to be asked again: nothing was ever heard, or not for too long.
  bool Wait(const query::CallContext& call) {
    if (!has_heard_) return false;
    const auto now = Clock::now();
    if (!is_lost_) {
      notes_ << "dsg: the server went away after revision " << revision_
             << "; asking for a minute whether it is back\n"
             << std::flush;
      is_lost_ = true;
      lost_at_ = now;
    }
    if (now - lost_at_ > kPatience) return false;
    // The client itself pauses between its tries; this is for what refuses at once.
    std::this_thread::sleep_for(kPause);
    return !call.cancelled();
  }

 private:
  static constexpr std::chrono::seconds kPatience{60};
  static constexpr std::chrono::milliseconds kPause{200};

  std::ostream& notes_;
  // The last one that was told.
  int64_t revision_ = 0;
  bool has_heard_ = false;
  bool is_lost_ = false;
  Clock::time_point lost_at_;
};

v1::WatchMapRequest RequestFor(const Session& session, const WatchVerb& verb,
                               const Printer& printer) {
  v1::WatchMapRequest request;
  request.set_map(session.map().name);
  if (printer.after().has_value()) request.set_after_revision(*printer.after());
  request.set_changes(verb.changes);
  request.set_view(v1::NODE_VIEW_FULL);
  return request;
}

}  // namespace

absl::Status RunWatch(Session* session, const WatchVerb& verb, std::ostream& out,
                      std::ostream& notes) {
  // A call without a deadline would be given one by the client.
  constexpr std::chrono::hours kForEver{24 * 365};
  const double timeout_s = session->common().timeout_s;
  const auto length =
      timeout_s > 0.0
          ? std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s))
          : std::chrono::duration_cast<Clock::duration>(kForEver);
  query::CallContext call(Clock::now() + length);
  const InterruptGuard guard(&call);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> after, NumberOf(verb.after, session));
  Printer printer(*session, verb, after, out);
  Patience patience(&notes);
  const auto take = [&](const v1::WatchMapResponse& message) {
    const bool goes_on = printer.Take(message);
    patience.Heard(*printer.after());
    return goes_on;
  };
  while (true) {
    const absl::Status status = query::ReadStream(
        call, session->api().WatchMap(call, RequestFor(*session, verb, printer)), take);
    DSG_RETURN_IF_ERROR(printer.status());
    if (printer.IsDone() || call.cancelled()) return absl::OkStatus();
    // A server that was restarted is asked to go on from where the watch was. While it shuts down
    // it may cancel what it has just taken; and it gives up readers that were held up.
    const bool was_given_up =
        absl::IsResourceExhausted(status) && ReasonOf(status) == Reason::kUnspecified;
    const bool is_away = absl::IsUnavailable(status) || absl::IsCancelled(status) || was_given_up;
    if (!is_away || !patience.Wait(call)) return status;
  }
}

}  // namespace dsg::cli
