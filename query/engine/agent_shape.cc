// SPDX-License-Identifier: Apache-2.0
// Answers GetAgentShape: the body of one agent over an interval, one message at a time. Memory
// holds one message and the shapes that are decoded together.
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/agents.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/snapshot.h"

namespace dsg::query {
namespace {

struct Parts {
  bool coefficients = false;
  bool joints = false;
  bool vertices = false;
  bool topology = false;
};

absl::StatusOr<Parts> PartsOf(const v1::GetAgentShapeRequest& request) {
  if (request.parts().empty()) return Parts{true, true, true, true};
  Parts parts;
  for (const int part : request.parts()) {
    switch (part) {
      case v1::SHAPE_PART_COEFFICIENTS:
        parts.coefficients = true;
        break;
      case v1::SHAPE_PART_JOINTS:
        parts.joints = true;
        break;
      case v1::SHAPE_PART_VERTICES:
        parts.vertices = true;
        break;
      case v1::SHAPE_PART_TOPOLOGY:
        parts.topology = true;
        break;
      default:
        return FieldError("parts", absl::StrCat(part),
                          "name coefficients, joints, vertices or topology, or nothing for all");
    }
  }
  return parts;
}

std::string BytesOf(const Sha256& digest) {
  return std::string(reinterpret_cast<const char*>(digest.data()), digest.size());
}

class ShapeCursor final : public EngineCursor<v1::GetAgentShapeResponse> {
 public:
  ShapeCursor(const ReadView& view, NodeId agent, const Parts& parts, TimeNs from_ns, TimeNs to_ns)
      : view_(view), agent_(agent), parts_(parts), next_ns_(from_ns), to_ns_(to_ns) {}

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
      if (WantsTopology(shown)) next_topology_ = shown.topology;
      if (bytes >= kPageBytesSoftMax || next_topology_.has_value()) {
        // One more than fits: it is where the next message begins.
        next_ns_ = shown.shape.time_ns;
        is_full = true;
        return false;
      }
      v1::AgentShape* out = reply->add_shapes();
      Fill(shown, out);
      broken = FillPose(shown.shape.time_ns, out);
      bytes += out->ByteSizeLong();
      return broken.ok();
    };
    DSG_RETURN_IF_ERROR(
        view_.snapshot().ReadShapes(agent_, next_ns_, to_ns_, parts_.vertices, call.stop(), take));
    DSG_RETURN_IF_ERROR(broken);
    done_ = !is_full;
    return absl::OkStatus();
  }

  bool WantsTopology(const ShownShape& shown) const {
    return parts_.topology && shown.vertex_count > 0 && shown.topology.has_value() &&
           !sent_topologies_.contains(*shown.topology);
  }

  absl::Status SendTopology(v1::GetAgentShapeResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const Asset asset, view_.snapshot().ReadAsset(*next_topology_));
    if (asset.content.size() > kReplyBytesMax) {
      return MakeError(
          Reason::kLimitExceeded,
          absl::StrCat("topology ", ToHex(asset.sha256), " of agent ", ToString(agent_), " has ",
                       asset.content.size(), " bytes, more than the ", kReplyBytesMax,
                       " of one message; ask for the other parts only"),
          {{"agent", ToString(agent_)}, {"asset", ToHex(asset.sha256)}});
    }
    v1::Asset* out = reply->add_topologies();
    out->set_sha256(BytesOf(asset.sha256));
    out->set_media_type(asset.media_type);
    out->set_content(asset.content);
    sent_topologies_.insert(*next_topology_);
    next_topology_.reset();
    return absl::OkStatus();
  }

  void Fill(const ShownShape& shown, v1::AgentShape* out) const {
    v1::BodyShape* shape = out->mutable_shape();
    ToProto(shown.shape, shape);
    if (!parts_.coefficients) {
      shape->clear_pose_coefficients();
      shape->clear_shape_coefficients();
    }
    if (!parts_.joints) shape->clear_joints();
    out->set_vertex_count(static_cast<int32_t>(shown.vertex_count));
    if (shown.topology.has_value()) out->set_topology_sha256(BytesOf(*shown.topology));
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
  const Parts parts_;
  // The first instant that no message has covered yet.
  TimeNs next_ns_;
  const TimeNs to_ns_;
  std::optional<Sha256> next_topology_;
  std::set<Sha256> sent_topologies_;
  bool is_first_ = true;
  bool done_ = false;
};

}  // namespace

CursorOr<v1::GetAgentShapeResponse> GetAgentShape(Engine* engine, const CallContext&,
                                                  const v1::GetAgentShapeRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const Parts parts, PartsOf(request));
  const TimeNs from_ns = request.has_from_ns() ? request.from_ns() : kTimeMin;
  const TimeNs to_ns = request.has_to_ns() ? request.to_ns() : kTimeMax;
  DSG_RETURN_IF_ERROR(CheckTimeRange(from_ns, to_ns));
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(view.snapshot(), request.agent()));
  return std::make_unique<ShapeCursor>(view, agent, parts, from_ns, to_ns);
}

}  // namespace dsg::query
