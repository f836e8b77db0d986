// SPDX-License-Identifier: Apache-2.0
// The poses of one agent over an interval, one message at a time, so that a slow reader holds
// neither a thread nor more memory than one message.
#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agent_names.h"
#include "query/engine/engine.h"
#include "query/engine/read_view.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

constexpr int kPosesPerMessage = 1000;
constexpr TimeNs kPeriodNsMin = 1'000'000;

// The first instant from_ns + k * period at or after `at_ns`; kTimeMax if there is none.
// Differences of far-apart times do not fit in 63 bits, so this counts in 64 without a sign.
TimeNs NextOnGrid(TimeNs from_ns, TimeNs period_ns, TimeNs at_ns) {
  if (at_ns <= from_ns) return from_ns;
  const uint64_t period = static_cast<uint64_t>(period_ns);
  const uint64_t past = (static_cast<uint64_t>(at_ns) - static_cast<uint64_t>(from_ns)) % period;
  if (past == 0) return at_ns;
  const uint64_t wait = period - past;
  const uint64_t room = static_cast<uint64_t>(kTimeMax) - static_cast<uint64_t>(at_ns);
  return wait > room ? kTimeMax : at_ns + static_cast<TimeNs>(wait);
}

class Cursor final : public EngineCursor<v1::GetTrajectoryResponse> {
 public:
  Cursor(const ReadView& view, TrackInfo track, const v1::GetTrajectoryRequest& request)
      : view_(view),
        track_(std::move(track)),
        period_ns_(request.resample_period_ns()),
        grid_from_ns_(request.has_from_ns() ? request.from_ns() : track_.first_ns),
        next_ns_(grid_from_ns_),
        to_ns_(request.has_to_ns() ? request.to_ns() : kTimeMax),
        done_(track_.pose_count == 0) {
    if (period_ns_ > 0 && !done_) {
      next_ns_ = NextOnGrid(grid_from_ns_, period_ns_, std::max(next_ns_, track_.first_ns));
    }
  }

  bool done() const override { return done_; }

 private:
  absl::Status Fill(const CallContext& call, v1::GetTrajectoryResponse* reply) override {
    if (is_first_) {
      view_.FillHeader(reply->mutable_header());
      reply->set_agent_id(ToString(track_.agent));
      is_first_ = false;
    }
    if (done_) return absl::OkStatus();
    return period_ns_ > 0 ? Resample(call, reply) : ReadStored(call, reply);
  }

  absl::Status ReadStored(const CallContext& call, v1::GetTrajectoryResponse* reply) {
    bool is_full = false;
    const auto take = [&](const TimedPose& pose) {
      if (reply->poses_size() == kPosesPerMessage) {
        // One more than fits: it is where the next message begins.
        next_ns_ = pose.time_ns;
        is_full = true;
        return false;
      }
      ToProto(pose, reply->add_poses());
      return true;
    };
    DSG_RETURN_IF_ERROR(
        view_.snapshot().ReadPoses(track_.agent, next_ns_, to_ns_, call.stop(), take));
    done_ = !is_full;
    return absl::OkStatus();
  }

  bool IsPastEnd(TimeNs time_ns) const {
    return time_ns >= to_ns_ || time_ns > track_.last_ns || time_ns == kTimeMax;
  }

  absl::Status Resample(const CallContext& call, v1::GetTrajectoryResponse* reply) {
    while (!IsPastEnd(next_ns_) && reply->poses_size() < kPosesPerMessage) {
      DSG_RETURN_IF_ERROR(call.Check());
      DSG_ASSIGN_OR_RETURN(const LocatedPose located,
                           view_.snapshot().Locate(track_.agent, next_ns_));
      if (located.quality == PoseQuality::kInGap) {
        // Straight to the far side: a night without poses must not cost a step a millisecond.
        next_ns_ = NextOnGrid(grid_from_ns_, period_ns_, located.after_ns);
        continue;
      }
      ToProto({next_ns_, located.flags, located.map_T_agent, located.covariance},
              reply->add_poses());
      next_ns_ = NextOnGrid(grid_from_ns_, period_ns_, next_ns_ + 1);
    }
    done_ = IsPastEnd(next_ns_);
    return absl::OkStatus();
  }

  const ReadView view_;
  const TrackInfo track_;
  const TimeNs period_ns_;
  const TimeNs grid_from_ns_;
  // The first instant that no message has covered yet.
  TimeNs next_ns_;
  const TimeNs to_ns_;
  bool is_first_ = true;
  bool done_;
};

}  // namespace

CursorOr<v1::GetTrajectoryResponse> GetTrajectory(Engine* engine, const CallContext&,
                                                  const v1::GetTrajectoryRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const TimeNs period_ns = request.resample_period_ns();
  if (period_ns != 0 && period_ns < kPeriodNsMin) {
    return FieldError("resample_period_ns", absl::StrCat(period_ns),
                      "give at least 1000000 (1 ms), or 0 for the stored poses");
  }
  if (request.has_from_ns() && request.has_to_ns()) {
    DSG_RETURN_IF_ERROR(CheckTimeRange(request.from_ns(), request.to_ns()));
  }
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(view.snapshot(), request.agent()));
  DSG_ASSIGN_OR_RETURN(TrackInfo track, view.snapshot().GetTrack(agent));
  return std::make_unique<Cursor>(view, std::move(track), request);
}

}  // namespace dsg::query
