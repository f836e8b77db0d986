// SPDX-License-Identifier: Apache-2.0
// Answers GetTracks and GetTimeline: the tracks of many agents at once. Memory holds one message.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/scene.pb.h"
#include "query/engine/columns.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/engine/track_walk.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

constexpr TimeNs kThinPeriodNsMin = 1'000'000;
constexpr int kBinCountDefault = 200;
constexpr int kBinCountMax = 2000;

// The columns of one TrackPoses.
class PoseColumns {
 public:
  PoseColumns(bool is_single, bool with_orientations)
      : value_bytes_(is_single ? sizeof(float) : sizeof(double)),
        with_orientations_(with_orientations) {}

  // Poses that follow one another without a gap.
  void Add(absl::Span<const TimedPose> poses, bool is_after_gap) {
    const size_t begin = times_.size();
    if (is_after_gap) gaps_.push_back(static_cast<uint32_t>(begin));
    times_.resize(begin + poses.size());
    positions_.resize(3 * times_.size());
    TimeNs* time = &times_[begin];
    double* position = &positions_[3 * begin];
    for (const TimedPose& pose : poses) {
      *time++ = pose.time_ns;
      Eigen::Vector3d::Map(position) = pose.map_T_agent.position;
      position += 3;
      flags_.Add(static_cast<uint8_t>(pose.flags));
    }
    if (with_orientations_) AddOrientations(poses);
  }

  bool empty() const { return times_.empty(); }
  size_t size_bytes() const { return times_.size() * row_bytes(); }
  // How many more poses until the columns have so many bytes.
  size_t RowsUpTo(size_t bytes) const {
    return bytes <= size_bytes() ? 0 : (bytes - size_bytes() + row_bytes() - 1) / row_bytes();
  }

  // Empties the columns, and keeps their memory for the next message.
  void Send(v1::TrackPoses* out) {
    out->set_row_count(static_cast<int32_t>(times_.size()));
    out->set_value_bytes(static_cast<int32_t>(value_bytes_));
    out->mutable_times_ns()->assign(BytesOf(times_));
    out->mutable_gaps()->assign(BytesOf(gaps_));
    out->set_flags(flags_.Take());
    if (!has_orientation_) orientations_.clear();
    if (value_bytes_ == sizeof(float)) {
      SendSingle(out);
    } else {
      ToProto(Eigen::Vector3d::Zero(), out->mutable_origin_map());
      out->mutable_positions()->assign(BytesOf(positions_));
      out->mutable_orientations()->assign(BytesOf(orientations_));
    }
    times_.clear();
    positions_.clear();
    orientations_.clear();
    gaps_.clear();
    has_orientation_ = false;
  }

 private:
  size_t row_bytes() const {
    return sizeof(TimeNs) + (with_orientations_ ? size_t{7} : size_t{3}) * value_bytes_;
  }

  void AddOrientations(absl::Span<const TimedPose> poses) {
    const size_t begin = orientations_.size();
    orientations_.resize(begin + 4 * poses.size());
    double* orientation = &orientations_[begin];
    for (const TimedPose& pose : poses) {
      auto out = Eigen::Vector4d::Map(orientation);
      orientation += 4;
      if ((pose.flags & pose_flags::kNoOrientation) == 0) {
        out = pose.map_T_agent.orientation.coeffs();
        has_orientation_ = true;
      } else {
        out.setConstant(std::numeric_limits<double>::quiet_NaN());
      }
    }
  }

  void SendSingle(v1::TrackPoses* out) const {
    const Eigen::Vector3d origin_map = Eigen::Vector3d(positions_.data()).array().round();
    ToProto(origin_map, out->mutable_origin_map());
    std::vector<float> values(positions_.size());
    for (size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(positions_[i] - origin_map[static_cast<int>(i % 3)]);
    }
    out->mutable_positions()->assign(BytesOf(values));
    values.assign(orientations_.begin(), orientations_.end());
    out->mutable_orientations()->assign(BytesOf(values));
  }

  const size_t value_bytes_;
  const bool with_orientations_;
  bool has_orientation_ = false;
  std::vector<TimeNs> times_;
  // 3 numbers a row, and 4.
  std::vector<double> positions_;
  std::vector<double> orientations_;
  std::vector<uint32_t> gaps_;
  RareColumn<uint8_t> flags_{0};
};

// Leaves out stored poses that follow another one too soon, but for the ends of stretches.
class Thinner {
 public:
  explicit Thinner(TimeNs period_ns) : period_ns_(period_ns) {}

  void Take(const TimedPose& pose, bool is_after_gap, PoseColumns* columns) {
    if (is_after_gap) Finish(columns);
    if (last_ns_.has_value() && !is_after_gap && pose.time_ns - *last_ns_ < period_ns_) {
      waiting_ = pose;
      return;
    }
    columns->Add(absl::MakeConstSpan(&pose, 1), is_after_gap);
    last_ns_ = pose.time_ns;
    waiting_.reset();
  }
  // The last pose of a stretch.
  void Finish(PoseColumns* columns) {
    if (waiting_.has_value()) columns->Add(absl::MakeConstSpan(&*waiting_, 1), false);
    waiting_.reset();
  }

 private:
  TimeNs period_ns_;
  std::optional<TimeNs> last_ns_;
  std::optional<TimedPose> waiting_;
};

class TracksCursor final : public EngineCursor<v1::GetTracksResponse> {
 public:
  TracksCursor(const ReadView& view, std::vector<TrackInfo> tracks, const WalkRange& range,
               const v1::GetTracksRequest& request)
      : view_(view),
        tracks_(std::move(tracks)),
        range_(range),
        thin_period_ns_(request.thin_period_ns()),
        thinner_(thin_period_ns_),
        columns_(request.single_precision(), !request.without_orientations()) {}

  bool done() const override { return track_ == tracks_.size(); }

 private:
  absl::Status Fill(const CallContext& call, v1::GetTracksResponse* reply) override {
    if (is_first_) {
      view_.FillHeader(reply->mutable_header());
      for (const TrackInfo& track : tracks_) FillTrack(track, reply->add_tracks());
      is_first_ = false;
    }
    for (size_t bytes = 0; !done() && bytes < kPageBytesSoftMax;) {
      DSG_RETURN_IF_ERROR(call.Check());
      DSG_RETURN_IF_ERROR(ReadOn(call, kPageBytesSoftMax - bytes, &bytes, reply));
    }
    return absl::OkStatus();
  }

  static void FillTrack(const TrackInfo& track, v1::TrackHead* out) {
    out->set_agent_id(ToString(track.agent));
    out->set_agent_name(track.name);
    out->set_gap_ns_max(track.gap_ns_max);
    out->set_pose_count(track.pose_count);
    if (track.pose_count == 0) return;
    out->set_first_pose_ns(track.first_ns);
    out->set_last_pose_ns(track.last_ns);
  }

  // Poses of the track that is walked along, until it ends or there is no more room.
  absl::Status ReadOn(const CallContext& call, size_t room_bytes, size_t* bytes,
                      v1::GetTracksResponse* reply) {
    if (!walk_.has_value()) {
      walk_.emplace(tracks_[track_], range_);
      thinner_ = Thinner(thin_period_ns_);
    }
    DSG_RETURN_IF_ERROR(walk_->Read(view_.snapshot(), call.stop(),
                                    [&](absl::Span<const TimedPose> poses, bool is_after_gap) {
                                      return Take(poses, is_after_gap, room_bytes);
                                    }));
    if (walk_->done()) thinner_.Finish(&columns_);
    if (!columns_.empty()) {
      *bytes += columns_.size_bytes();
      v1::TrackPoses* out = reply->add_poses();
      out->set_track(static_cast<int32_t>(track_));
      columns_.Send(out);
    }
    if (walk_->done()) {
      walk_.reset();
      ++track_;
    }
    return absl::OkStatus();
  }

  // Takes as many as there is room for.
  size_t Take(absl::Span<const TimedPose> poses, bool is_after_gap, size_t room_bytes) {
    if (thin_period_ns_ == 0) {
      poses = poses.subspan(0, columns_.RowsUpTo(room_bytes));
      if (!poses.empty()) columns_.Add(poses, is_after_gap);
      return poses.size();
    }
    size_t taken_count = 0;
    for (; taken_count < poses.size() && columns_.size_bytes() < room_bytes; ++taken_count) {
      thinner_.Take(poses[taken_count], is_after_gap && taken_count == 0, &columns_);
    }
    return taken_count;
  }

  const ReadView view_;
  const std::vector<TrackInfo> tracks_;
  const WalkRange range_;
  const TimeNs thin_period_ns_;
  bool is_first_ = true;
  // The track that is walked along.
  size_t track_ = 0;
  std::optional<TrackWalk> walk_;
  Thinner thinner_;
  PoseColumns columns_;
};

absl::StatusOr<WalkRange> RangeOf(const v1::GetTracksRequest& request) {
  DSG_ASSIGN_OR_RETURN(const WalkRange range, WalkRangeOf(request));
  const TimeNs thin_ns = request.thin_period_ns();
  if (thin_ns != 0 && thin_ns < kThinPeriodNsMin) {
    return FieldError("thin_period_ns", absl::StrCat(thin_ns),
                      "give at least 1000000 (1 ms), or 0 for all poses");
  }
  if (thin_ns != 0 && range.period_ns != 0) {
    return FieldError("thin_period_ns", absl::StrCat(thin_ns),
                      "poses are either interpolated or thinned: leave out this one or "
                      "resample_period_ns");
  }
  return range;
}

// How many agents were observed in each of some bins.
class Bins {
 public:
  Bins(TimeNs from_ns, TimeNs to_ns, int count)
      : from_ns_(from_ns),
        width_ns_((static_cast<double>(to_ns) - static_cast<double>(from_ns)) / count),
        count_(count),
        agents_(static_cast<size_t>(count)),
        poses_(static_cast<size_t>(count)) {}

  // The poses of one track, one after the other, also those next to the first and the last bin.
  // `is_connected`: the agent was interpolated from the pose before.
  void Add(TimeNs time_ns, bool is_connected) {
    const int bin = BinOf(time_ns);
    if (bin >= 0 && bin < count_) ++poses_[static_cast<size_t>(bin)];
    const int first = is_connected ? last_bin_ + 1 : bin;
    for (int i = std::max(first, next_unseen_); i <= std::min(bin, count_ - 1); ++i) {
      ++agents_[static_cast<size_t>(i)];
      next_unseen_ = i + 1;
    }
    last_bin_ = bin;
  }
  void EndTrack() { next_unseen_ = 0; }

  void Fill(v1::GetTimelineResponse* reply) const {
    reply->mutable_agent_counts()->Add(agents_.begin(), agents_.end());
    reply->mutable_pose_counts()->Add(poses_.begin(), poses_.end());
  }

 private:
  // -1 before the first bin, and their count after the last.
  int BinOf(TimeNs time_ns) const {
    const double at = (static_cast<double>(time_ns) - static_cast<double>(from_ns_)) / width_ns_;
    return static_cast<int>(std::clamp(std::floor(at), -1.0, static_cast<double>(count_)));
  }

  const TimeNs from_ns_;
  const double width_ns_;
  const int count_;
  std::vector<int32_t> agents_;
  std::vector<int64_t> poses_;
  int last_bin_ = -1;
  // Of the track: the first bin that has not counted it.
  int next_unseen_ = 0;
};

// Also the poses that others inside of the interval are interpolated from.
WalkRange Around(const TrackInfo& track, TimeNs from_ns, TimeNs to_ns) {
  WalkRange range;
  range.from_ns = from_ns > kTimeMin + track.gap_ns_max ? from_ns - track.gap_ns_max : kTimeMin;
  range.to_ns = to_ns < kTimeMax - track.gap_ns_max ? to_ns + track.gap_ns_max : kTimeMax;
  return range;
}

}  // namespace

CursorOr<v1::GetTracksResponse> GetTracks(Engine* engine, const CallContext& call,
                                          const v1::GetTracksRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const WalkRange range, RangeOf(request));
  DSG_ASSIGN_OR_RETURN(std::vector<TrackInfo> tracks,
                       TracksOf(&engine->names, view.snapshot(), request.agents(), call.stop()));
  return std::make_unique<TracksCursor>(view, std::move(tracks), range, request);
}

absl::Status GetTimeline(Engine* engine, const CallContext& call,
                         const v1::GetTimelineRequest& request, v1::GetTimelineResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const int bin_count = request.bin_count() == 0 ? kBinCountDefault : request.bin_count();
  if (bin_count < 0 || bin_count > kBinCountMax) {
    return FieldError("bin_count", absl::StrCat(request.bin_count()),
                      "give 1 to 2000, or 0 for 200");
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, view.snapshot().Tracks(call.stop()));
  TimeNs from_ns = kTimeMax;
  TimeNs last_ns = kTimeMin;
  for (const TrackInfo& track : tracks) {
    if (track.pose_count == 0) continue;
    from_ns = std::min(from_ns, track.first_ns);
    last_ns = std::max(last_ns, track.last_ns);
  }
  view.FillHeader(reply->mutable_header());
  const bool is_empty = from_ns > last_ns;
  if (is_empty) from_ns = last_ns = 0;
  if (request.has_from_ns()) from_ns = request.from_ns();
  TimeNs to_ns = is_empty ? from_ns : last_ns + (last_ns < kTimeMax ? 1 : 0);
  if (request.has_to_ns()) to_ns = request.to_ns();
  if (!is_empty || request.has_to_ns()) DSG_RETURN_IF_ERROR(CheckTimeRange(from_ns, to_ns));
  reply->set_from_ns(from_ns);
  reply->set_to_ns(to_ns);
  Bins bins(from_ns, to_ns, bin_count);
  for (const TrackInfo& track : tracks) {
    TrackWalk walk(track, Around(track, from_ns, to_ns));
    bool has_begun = false;
    DSG_RETURN_IF_ERROR(walk.Read(view.snapshot(), call.stop(),
                                  [&](absl::Span<const TimedPose> poses, bool is_after_gap) {
                                    bool is_connected = has_begun && !is_after_gap;
                                    for (const TimedPose& pose : poses) {
                                      bins.Add(pose.time_ns, is_connected);
                                      is_connected = true;
                                    }
                                    has_begun = true;
                                    return poses.size();
                                  }));
    bins.EndTrack();
  }
  bins.Fill(reply);
  return absl::OkStatus();
}

}  // namespace dsg::query
