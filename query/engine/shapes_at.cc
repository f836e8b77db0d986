// SPDX-License-Identifier: Apache-2.0
// Answers BatchGetShapes: the bodies of many agents at one instant. Memory holds one message and
// the shapes that are decoded together.
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "query/engine/agents.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/engine/shape_filler.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

TimeNs Distance(TimeNs a, TimeNs b) { return a < b ? b - a : a - b; }

// When the stored shape that is nearest to `at_ns` is; nullopt if none is within the gap limit.
absl::StatusOr<std::optional<TimeNs>> NearestShape(const Snapshot& snapshot, const TrackInfo& track,
                                                   TimeNs at_ns, const StopCheck& stop) {
  std::optional<TimeNs> nearest;
  DSG_RETURN_IF_ERROR(snapshot.ReadShapes(
      track.agent, at_ns - track.gap_ns_max, at_ns + track.gap_ns_max + 1,
      /*with_vertices=*/false, stop, [&](const ShownShape& shown) {
        const TimeNs time_ns = shown.shape.time_ns;
        const bool is_nearer =
            !nearest.has_value() || Distance(time_ns, at_ns) < Distance(*nearest, at_ns);
        if (is_nearer) nearest = time_ns;
        // They ascend: what follows is further away.
        return is_nearer;
      }));
  return nearest;
}

class ShapesCursor final : public EngineCursor<v1::BatchGetShapesResponse> {
 public:
  ShapesCursor(const ReadView& view, std::vector<TrackInfo> tracks, const ShapeParts& parts,
               TimeNs at_ns)
      : view_(view), tracks_(std::move(tracks)), at_ns_(at_ns), filler_(view, parts) {}

  bool done() const override { return next_ == tracks_.size(); }

 private:
  absl::Status Fill(const CallContext& call, v1::BatchGetShapesResponse* reply) override {
    if (is_first_) view_.FillHeader(reply->mutable_header());
    is_first_ = false;
    for (size_t bytes = 0; !done() && bytes < kPageBytesSoftMax;) {
      DSG_RETURN_IF_ERROR(call.Check());
      // A topology fills a message of its own; where nothing is in this one yet, it goes here.
      std::optional<Sha256> topology;
      DSG_RETURN_IF_ERROR(AddOne(call, &topology, &bytes, reply));
      if (!topology.has_value()) continue;
      if (!reply->shapes().empty()) break;
      return filler_.AddTopology(tracks_[next_].agent, *topology, reply->add_topologies());
    }
    return absl::OkStatus();
  }

  // The shape of the next agent; only `topology` is set if that must be sent before it.
  absl::Status AddOne(const CallContext& call, std::optional<Sha256>* topology, size_t* bytes,
                      v1::BatchGetShapesResponse* reply) {
    const TrackInfo& track = tracks_[next_];
    DSG_ASSIGN_OR_RETURN(const auto located, LocateAt(view_.snapshot(), track.agent, at_ns_));
    if (!located.has_value() || located->quality == PoseQuality::kInGap) {
      ++next_;
      return absl::OkStatus();
    }
    DSG_ASSIGN_OR_RETURN(const auto time_ns,
                         NearestShape(view_.snapshot(), track, at_ns_, call.stop()));
    if (time_ns.has_value()) {
      DSG_RETURN_IF_ERROR(view_.snapshot().ReadShapes(
          track.agent, *time_ns, *time_ns + 1, filler_.with_vertices(), call.stop(),
          [&](const ShownShape& shown) {
            if (filler_.WantsTopology(shown)) {
              *topology = shown.topology;
              return false;
            }
            v1::ShapeOfAgent* out = reply->add_shapes();
            out->set_agent_id(ToString(track.agent));
            filler_.Fill(shown, out->mutable_shape());
            ToProto(located->map_T_agent, out->mutable_shape()->mutable_pose());
            out->mutable_shape()->set_quality(QualityToProto(located->quality));
            *bytes += out->ByteSizeLong();
            return false;
          }));
    }
    if (!topology->has_value()) ++next_;
    return absl::OkStatus();
  }

  const ReadView view_;
  const std::vector<TrackInfo> tracks_;
  const TimeNs at_ns_;
  ShapeFiller filler_;
  size_t next_ = 0;
  bool is_first_ = true;
};

}  // namespace

CursorOr<v1::BatchGetShapesResponse> BatchGetShapes(Engine* engine, const CallContext& call,
                                                    const v1::BatchGetShapesRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, InstantOf(request));
  DSG_ASSIGN_OR_RETURN(const ShapeParts parts, ShapeParts::Of(request.parts()));
  DSG_ASSIGN_OR_RETURN(std::vector<TrackInfo> tracks,
                       TracksOf(&engine->names, view.snapshot(), request.agents(), call.stop()));
  return std::make_unique<ShapesCursor>(view, std::move(tracks), parts, at_ns);
}

}  // namespace dsg::query
