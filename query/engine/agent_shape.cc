// SPDX-License-Identifier: Apache-2.0
// Answers GetAgentShape: the body of one agent over an interval, one message at a time. Memory
// holds one message and the shapes that are decoded together.
#include <optional>

#include "dsg/v1/query_service.pb.h"
#include "query/engine/agents.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/engine/shape_filler.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/snapshot.h"

namespace dsg::query {
namespace {

class ShapeCursor final : public EngineCursor<v1::GetAgentShapeResponse> {
 public:
  ShapeCursor(const ReadView& view, NodeId agent, const ShapeParts& parts, TimeNs from_ns,
              TimeNs to_ns)
      : view_(view), agent_(agent), filler_(view, parts), next_ns_(from_ns), to_ns_(to_ns) {}

  bool done() const override { return done_; }

 private:
  absl::Status Fill(const CallContext& call, v1::GetAgentShapeResponse* reply) override {
    if (is_first_) {
      view_.FillHeader(reply->mutable_header());
      reply->set_agent_id(ToString(agent_));
      is_first_ = false;
    }
    if (next_topology_.has_value()) return SendTopology(reply);
    DSG_RETURN_IF_ERROR(ReadShapes(call, reply));
    // A topology fills a message of its own; where nothing is in this one yet, it goes here.
    const bool may_join = reply->shapes().empty() && next_topology_.has_value();
    return may_join ? SendTopology(reply) : absl::OkStatus();
  }

  absl::Status ReadShapes(const CallContext& call, v1::GetAgentShapeResponse* reply) {
    bool is_full = false;
    size_t bytes = 0;
    absl::Status broken;
    const auto take = [&](const ShownShape& shown) {
      if (filler_.WantsTopology(shown)) next_topology_ = shown.topology;
      if (bytes >= kPageBytesSoftMax || next_topology_.has_value()) {
        // One more than fits: it is where the next message begins.
        next_ns_ = shown.shape.time_ns;
        is_full = true;
        return false;
      }
      v1::AgentShape* out = reply->add_shapes();
      filler_.Fill(shown, out);
      broken = FillPose(shown.shape.time_ns, out);
      bytes += out->ByteSizeLong();
      return broken.ok();
    };
    DSG_RETURN_IF_ERROR(view_.snapshot().ReadShapes(agent_, next_ns_, to_ns_,
                                                    filler_.with_vertices(), call.stop(), take));
    DSG_RETURN_IF_ERROR(broken);
    done_ = !is_full;
    return absl::OkStatus();
  }

  absl::Status SendTopology(v1::GetAgentShapeResponse* reply) {
    DSG_RETURN_IF_ERROR(filler_.AddTopology(agent_, *next_topology_, reply->add_topologies()));
    next_topology_.reset();
    return absl::OkStatus();
  }

  // Shapes and poses are stored apart: a shape may stand where the track has no pose.
  absl::Status FillPose(TimeNs time_ns, v1::AgentShape* out) const {
    const absl::StatusOr<LocatedPose> located = view_.snapshot().Locate(agent_, time_ns);
    if (!located.ok()) {
      const bool is_outside =
          absl::IsOutOfRange(located.status()) || absl::IsNotFound(located.status());
      return is_outside ? absl::OkStatus() : located.status();
    }
    out->set_quality(QualityToProto(located->quality));
    if (located->quality != PoseQuality::kInGap) {
      ToProto(located->map_T_agent, out->mutable_pose());
    }
    return absl::OkStatus();
  }

  const ReadView view_;
  const NodeId agent_;
  ShapeFiller filler_;
  // The first instant that no message has covered yet.
  TimeNs next_ns_;
  const TimeNs to_ns_;
  std::optional<Sha256> next_topology_;
  bool is_first_ = true;
  bool done_ = false;
};

}  // namespace

CursorOr<v1::GetAgentShapeResponse> GetAgentShape(Engine* engine, const CallContext&,
                                                  const v1::GetAgentShapeRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const ShapeParts parts, ShapeParts::Of(request.parts()));
  const TimeNs from_ns = request.has_from_ns() ? request.from_ns() : kTimeMin;
  const TimeNs to_ns = request.has_to_ns() ? request.to_ns() : kTimeMax;
  DSG_RETURN_IF_ERROR(CheckTimeRange(from_ns, to_ns));
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(view.snapshot(), request.agent()));
  return std::make_unique<ShapeCursor>(view, agent, parts, from_ns, to_ns);
}

}  // namespace dsg::query
