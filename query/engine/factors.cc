// SPDX-License-Identifier: Apache-2.0
// The pose-graph factors of an agent over an interval, one message at a time. The store is read by
// stretches of time that hold about one message, so that neither the memory nor the time between
// two checks of the call grows with the interval.
#include <algorithm>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

constexpr size_t kFactorsPerMessage = 1000;
constexpr TimeNs kFirstStretchNs = 10 * kNsPerSecond;
constexpr TimeNs kStretchNsMin = 1'000'000;
// Gaps of months are crossed in thousands of quick reads; what follows a gap is read no further.
constexpr TimeNs kStretchNsMax = 3600 * kNsPerSecond;

class FactorCursor final : public EngineCursor<v1::ListFactorsResponse> {
 public:
  FactorCursor(const ReadView& view, const TrackInfo& track, TimeNs from_ns, TimeNs to_ns)
      : view_(view), track_(track), read_to_ns_(from_ns), to_ns_(to_ns) {}

  bool done() const override { return next_ == read_.size() && read_to_ns_ >= to_ns_; }

 private:
  absl::Status Fill(const CallContext& call, v1::ListFactorsResponse* reply) override {
    if (is_first_) {
      view_.FillHeader(reply->mutable_header());
      reply->set_agent_id(ToString(track_.agent));
      is_first_ = false;
    }
    while (!done() && reply->factors_size() < static_cast<int>(kFactorsPerMessage)) {
      if (next_ == read_.size()) {
        DSG_RETURN_IF_ERROR(call.Check());
        DSG_RETURN_IF_ERROR(ReadStretch());
      } else {
        ToProto(read_[next_++], reply->add_factors());
      }
    }
    return absl::OkStatus();
  }

  // The factors that begin in the next stretch; the store also gives those that only reach into it.
  absl::Status ReadStretch() {
    const TimeNs from_ns = read_to_ns_;
    const TimeNs end_ns = StretchEnd();
    DSG_ASSIGN_OR_RETURN(read_, view_.snapshot().Factors(track_.agent, from_ns, end_ns));
    std::erase_if(read_, [&](const PoseFactor& factor) { return factor.from_ns < from_ns; });
    next_ = 0;
    read_to_ns_ = end_ns;
    if (read_.size() > kFactorsPerMessage) {
      stretch_ns_ = std::max(stretch_ns_ / 2, kStretchNsMin);
    } else if (read_.size() < kFactorsPerMessage / 2) {
      stretch_ns_ = std::min(stretch_ns_ * 2, kStretchNsMax);
    }
    return absl::OkStatus();
  }

  // Factors tie the poses of the track; before and after it there are few, if any.
  TimeNs StretchEnd() const {
    const bool has_track = track_.pose_count > 0;
    if (has_track && read_to_ns_ < track_.first_ns) return std::min(to_ns_, track_.first_ns);
    if (!has_track || read_to_ns_ > track_.last_ns) return to_ns_;
    return read_to_ns_ > to_ns_ - stretch_ns_ ? to_ns_ : read_to_ns_ + stretch_ns_;
  }

  const ReadView view_;
  const TrackInfo track_;
  // Factors before this instant have been read.
  TimeNs read_to_ns_;
  const TimeNs to_ns_;
  TimeNs stretch_ns_ = kFirstStretchNs;
  std::vector<PoseFactor> read_;
  size_t next_ = 0;
  bool is_first_ = true;
};

}  // namespace

CursorOr<v1::ListFactorsResponse> ListFactors(Engine* engine, const CallContext&,
                                              const v1::ListFactorsRequest& request) {
  const TimeNs from_ns = request.has_from_ns() ? request.from_ns() : kTimeMin;
  const TimeNs to_ns = request.has_to_ns() ? request.to_ns() : kTimeMax;
  DSG_RETURN_IF_ERROR(CheckTimeRange(from_ns, to_ns));
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(view.snapshot(), request.agent()));
  DSG_ASSIGN_OR_RETURN(const TrackInfo track, view.snapshot().GetTrack(agent));
  return std::make_unique<FactorCursor>(view, track, from_ns, to_ns);
}

}  // namespace dsg::query
