// SPDX-License-Identifier: Apache-2.0
#include "query/cli/read_bodies.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/table.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/topology.h"

namespace dsg::cli {
namespace {

template <class Numbers>
std::vector<Eigen::Vector3f> PointsOf(const Numbers& numbers, const Pose3d& map_T_agent) {
  std::vector<Eigen::Vector3f> points_map;
  points_map.reserve(static_cast<size_t>(numbers.size()) / 3);
  for (int i = 0; i + 2 < numbers.size(); i += 3) {
    const Eigen::Vector3f point_agent(numbers[i], numbers[i + 1], numbers[i + 2]);
    points_map.push_back((map_T_agent * point_agent.cast<double>()).cast<float>());
  }
  return points_map;
}

class BodyReader {
 public:
  BodyReader(BodySource* source, const TakeBody& take) : source_(*source), take_(take) {}

  /// False when no more is needed; status() then says whether that is an error.
  bool Take(const v1::GetAgentShapeResponse& message) {
    if (message.has_header()) source_.revision = message.header().read_revision();
    if (!message.agent_id().empty()) source_.agent_id = message.agent_id();
    for (const v1::Asset& asset : message.topologies()) {
      status_ = TakeTopology(asset);
      if (!status_.ok()) return false;
    }
    for (const v1::AgentShape& shape : message.shapes()) {
      // A body without a pose has no place in the map.
      if (!shape.has_pose()) continue;
      absl::StatusOr<Body> body = BodyOf(shape);
      status_ = body.status();
      if (!status_.ok() || !take_(source_, *std::move(body))) return false;
    }
    return true;
  }

  const absl::Status& status() const { return status_; }

 private:
  absl::Status TakeTopology(const v1::Asset& asset) {
    Topology topology;
    if (!DecodeTopology(asset.content(), &topology)) {
      return absl::DataLossError(absl::StrCat("the topology of agent ", source_.agent_id,
                                              " has media type ", Printable(asset.media_type()),
                                              " instead of ", std::string(kTopologyMediaType),
                                              "; commit one of that type"));
    }
    faces_[asset.sha256()] = {topology.vertex_count,
                              std::make_shared<const BodyFaces>(std::move(topology.faces))};
    return absl::OkStatus();
  }

  absl::StatusOr<Body> BodyOf(const v1::AgentShape& shape) const {
    Body body;
    body.time_ns = shape.shape().time_ns();
    body.map_T_agent = FromProto(shape.pose());
    body.points_map = PointsOf(shape.shape().vertices(), body.map_T_agent);
    body.joints_map = PointsOf(shape.shape().joints(), body.map_T_agent);
    const auto faces = faces_.find(shape.topology_sha256());
    if (faces == faces_.end() || body.points_map.empty()) return body;
    const auto& [vertex_count, list] = faces->second;
    if (vertex_count > body.points_map.size()) {
      return absl::DataLossError(absl::StrCat("the body of agent ", source_.agent_id, " at ",
                                              body.time_ns, " ns has ", body.points_map.size(),
                                              " vertices, its topology is of ", vertex_count,
                                              "; verify the map with dsg verify"));
    }
    body.faces = list;
    return body;
  }

  BodySource& source_;
  const TakeBody& take_;
  absl::Status status_;
  /// By the topology's hash: how many vertices they are of, and the faces.
  std::map<std::string, std::pair<uint32_t, std::shared_ptr<const BodyFaces>>> faces_;
};

}  // namespace

absl::Status ReadBodies(const Session& session, const v1::GetAgentShapeRequest& request,
                        BodySource* source, const TakeBody& take) {
  BodySource unasked;
  BodyReader reader(source != nullptr ? source : &unasked, take);
  DSG_RETURN_IF_ERROR(
      session.Read(&query::Api::GetAgentShape, request,
                   [&](const v1::GetAgentShapeResponse& message) { return reader.Take(message); }));
  return reader.status();
}

TimeNs BodyReachNs(const Session& session) { return session.map().gap_ns_max / 2; }

absl::StatusOr<std::optional<Body>> ReadBodyAt(const Session& session,
                                               v1::GetAgentShapeRequest request, TimeNs at_ns) {
  const TimeNs reach_ns = BodyReachNs(session);
  request.set_from_ns(at_ns < kTimeMin + reach_ns ? kTimeMin : at_ns - reach_ns);
  request.set_to_ns(at_ns >= kTimeMax - reach_ns ? kTimeMax : at_ns + reach_ns + 1);
  request.clear_parts();
  std::optional<Body> nearest;
  const auto distance_of = [at_ns](const Body& body) {
    return body.time_ns < at_ns ? at_ns - body.time_ns : body.time_ns - at_ns;
  };
  DSG_RETURN_IF_ERROR(ReadBodies(session, request, nullptr, [&](const BodySource&, Body body) {
    const bool is_nearer = !nearest.has_value() || distance_of(body) < distance_of(*nearest);
    // They ascend, so after the instant the distance only grows.
    if (is_nearer) nearest = std::move(body);
    return is_nearer;
  }));
  return nearest;
}

}  // namespace dsg::cli
