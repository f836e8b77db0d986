// SPDX-License-Identifier: Apache-2.0
// Answers WatchMap: the revisions of a map as they come, from where the caller left off. Holds no
// thread while nothing happens.
#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "query/engine/diff.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

using Clock = CallContext::Clock;

// A look at the head costs microseconds, and other processes that write cannot tell us: so we look
// this often, and news is at most this old.
constexpr std::chrono::milliseconds kPollPeriod{50};
constexpr TimeNs kIdlePeriodDefaultNs = 5 * kNsPerSecond;
constexpr TimeNs kIdlePeriodMinNs = kNsPerSecond / 10;
// Longer than a day is as good as never, and cannot overflow a clock.
constexpr TimeNs kIdlePeriodMaxNs = 86'400 * kNsPerSecond;
// Records of revisions read at a time by a watch that is behind.
constexpr int kBacklogSize = 64;

absl::Status ReplacedError(const std::string& map) {
  return MakeError(
      Reason::kMapReplaced,
      absl::StrCat(
          "map \"", map,
          "\" was removed, replaced or erased from while it was watched, so its revisions "
          "are others now; read the map again, then watch from the revision that was read"),
      {{"map", map}});
}

absl::Status CompactedError(const std::string& map, Revision after, Revision oldest,
                            Revision newest) {
  return MakeError(
      Reason::kRevisionCompacted,
      absl::StrCat("the changes after revision ", after, " of map \"", map,
                   "\" were compacted away; readable are ", oldest, " to ", newest,
                   ": read the map at revision ", newest, ", then watch after it"),
      {{"map", map}, {"oldest", absl::StrCat(oldest)}, {"newest", absl::StrCat(newest)}});
}

class Watch final : public EngineCursor<v1::WatchMapResponse> {
 public:
  Watch(std::shared_ptr<MapReader> map, Revision after, const v1::WatchMapRequest& request)
      : map_(std::move(map)),
        after_(after),
        with_changes_(request.changes()),
        view_(request.view()),
        idle_period_(
            std::min(request.idle_period_ns() > 0 ? request.idle_period_ns() : kIdlePeriodDefaultNs,
                     kIdlePeriodMaxNs)) {}

  std::chrono::nanoseconds Wait() override {
    const auto now = Clock::now();
    if (changes_ != nullptr) return {};
    // Before it is asked whether the map is the same: this look shows it.
    const absl::StatusOr<RevisionInfo> head = map_->Head();
    if (!map_->IsCurrent()) return {};
    if (!head.ok() || head->revision != after_ || now >= idle_until_) return {};
    return std::min<std::chrono::nanoseconds>(kPollPeriod, idle_until_ - now);
  }

  // Only its caller ends a watch.
  bool done() const override { return false; }

 private:
  absl::Status Fill(const CallContext& call, v1::WatchMapResponse* reply) override {
    const absl::StatusOr<RevisionInfo> looked = map_->Head();
    if (!map_->IsCurrent()) return ReplacedError(map_->spec().name);
    DSG_RETURN_IF_ERROR(looked.status());
    const RevisionInfo& head = *looked;
    if (changes_ == nullptr && head.revision > after_) {
      DSG_RETURN_IF_ERROR(TakeRevision(head.revision));
      if (with_changes_) {
        DSG_ASSIGN_OR_RETURN(
            changes_, Difference::Open(map_, after_, current_.revision, {"", view_}, call.stop()));
        position_.clear();
      } else {
        ToProto(current_, reply->mutable_revision());
        after_ = current_.revision;
        reply->set_complete(true);
      }
    }
    if (changes_ != nullptr) DSG_RETURN_IF_ERROR(AddChanges(call, reply));
    DSG_RETURN_IF_ERROR(FillHeader(head.revision, reply));
    idle_until_ = Clock::now() + idle_period_;
    return absl::OkStatus();
  }

  // Makes the revision after `after_` the current one.
  absl::Status TakeRevision(Revision head) {
    if (backlog_.empty()) {
      const auto count = static_cast<int>(std::min<Revision>(head - after_, kBacklogSize));
      // Newest first, which lets the next one be taken off the end.
      DSG_ASSIGN_OR_RETURN(backlog_, map_->ListRevisions(after_ + count + 1, count));
    }
    if (backlog_.empty() || backlog_.back().revision != after_ + 1) {
      DSG_ASSIGN_OR_RETURN(const Revision oldest, map_->OldestRevision());
      return CompactedError(map_->spec().name, after_, oldest, head);
    }
    current_ = std::move(backlog_.back());
    backlog_.pop_back();
    return absl::OkStatus();
  }

  absl::Status AddChanges(const CallContext& call, v1::WatchMapResponse* reply) {
    ToProto(current_, reply->mutable_revision());
    v1::DiffRevisionsResponse* changes = reply->mutable_changes();
    changes->set_from_revision(after_);
    changes->set_to_revision(current_.revision);
    DSG_ASSIGN_OR_RETURN(position_, changes_->AddPage(position_, kPageSizeMax, call, changes));
    if (!position_.empty()) return absl::OkStatus();
    reply->set_complete(true);
    changes_ = nullptr;
    after_ = current_.revision;
    return absl::OkStatus();
  }

  absl::Status FillHeader(Revision head, v1::WatchMapResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const Revision oldest, map_->OldestRevision());
    // How far the watch has come: not over a revision that is still being sent.
    reply->mutable_header()->set_read_revision(after_);
    reply->mutable_header()->set_head_revision(head);
    reply->mutable_header()->set_oldest_revision(oldest);
    reply->mutable_header()->set_incarnation(map_->incarnation());
    return absl::OkStatus();
  }

  const std::shared_ptr<MapReader> map_;
  // The last revision of which everything was told.
  Revision after_;
  const bool with_changes_;
  const int view_;
  const std::chrono::nanoseconds idle_period_;
  // The first message comes at once and says where the watch begins.
  Clock::time_point idle_until_ = Clock::time_point::min();
  std::vector<RevisionInfo> backlog_;
  RevisionInfo current_;
  // Of the current revision, while some are still to be told.
  std::unique_ptr<Difference> changes_;
  std::string position_;
};

absl::Status CheckWatchRequest(const v1::WatchMapRequest& request) {
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  if (request.after_revision() < 0) {
    return FieldError("after_revision", absl::StrCat(request.after_revision()),
                      "revisions count from 0, the empty map");
  }
  const TimeNs idle_ns = request.idle_period_ns();
  if (idle_ns == 0 || idle_ns >= kIdlePeriodMinNs) return absl::OkStatus();
  return FieldError("idle_period_ns", absl::StrCat(idle_ns),
                    "give at least 100000000 (100 ms), or 0 for 5 s");
}

}  // namespace

CursorOr<v1::WatchMapResponse> WatchMap(Engine* engine, const CallContext&,
                                        const v1::WatchMapRequest& request) {
  DSG_RETURN_IF_ERROR(CheckWatchRequest(request));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
  const Revision after = request.has_after_revision() ? request.after_revision() : head.revision;
  DSG_ASSIGN_OR_RETURN(const Revision oldest, map->OldestRevision());
  if (after < oldest) return CompactedError(request.map(), after, oldest, head.revision);
  DSG_RETURN_IF_ERROR(map->At(after).status());
  return std::make_unique<Watch>(std::move(map), after, request);
}

}  // namespace dsg::query
