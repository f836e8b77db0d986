// SPDX-License-Identifier: Apache-2.0
#include "query/cli/read_content.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/read_bodies.h"
#include "query/cli/session.h"
#include "query/cli/values.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

// Poses closer to the last kept pose than this do not change a picture.
constexpr double kStepM = 0.02;

// Ids for layers that the map added. No map uses them; here they only need to differ.
constexpr LayerId kFirstMadeUpLayer = 1'000'000;

class ContentReader {
 public:
  ContentReader(Session* session, const ContentOptions& options)
      : session_(*session), options_(options) {}

  absl::StatusOr<ContentAnswer> Read() {
    DSG_RETURN_IF_ERROR(ReadStats());
    DSG_RETURN_IF_ERROR(ReadNodes());
    DSG_RETURN_IF_ERROR(ReadEdges());
    DSG_RETURN_IF_ERROR(ReadTracks());
    if (options_.with_bodies) DSG_RETURN_IF_ERROR(ReadAllBodies());
    if (options_.with_mesh) DSG_RETURN_IF_ERROR(ReadMesh());
    return std::move(answer_);
  }

 private:
  // Later requests read at the revision of the first answer.
  template <class Request>
  Request Begin() const {
    Request request;
    request.set_map(session_.map().name);
    request.mutable_read_at()->set_exact_revision(answer_.content.revision);
    return request;
  }

  absl::Status ReadStats() {
    auto request = session_.Begin<v1::GetMapStatsRequest>();
    if (options_.revision.has_value()) {
      request.mutable_read_at()->set_exact_revision(*options_.revision);
    }
    v1::GetMapStatsResponse reply;
    DSG_RETURN_IF_ERROR(session_.api().GetMapStats(session_.NewCall(), request, &reply));
    MapContent& content = answer_.content;
    content.spec = session_.map();
    content.revision = reply.header().read_revision();
    if (reply.has_last_pose_ns()) answer_.last_pose_ns = reply.last_pose_ns();
    const LayerTable known;
    for (const v1::LayerStats& layer : reply.layers()) {
      const Layer* standard = known.Find(layer.name());
      const LayerId id = standard != nullptr
                             ? standard->id
                             : kFirstMadeUpLayer + static_cast<LayerId>(content.layers.size());
      content.layers.push_back({id, layer.name(), layer.rank()});
    }
    return absl::OkStatus();
  }

  bool IsWanted(const Interval& valid) const {
    return options_.at_ns.has_value() ? valid.Contains(*options_.at_ns) : valid.to_ns == kTimeMax;
  }

  absl::Status ReadNodes() {
    auto request = Begin<v1::ListNodesRequest>();
    if (options_.at_ns.has_value()) request.mutable_filter()->set_at_ns(*options_.at_ns);
    const LayerTable layers(answer_.content.layers);
    v1::ListNodesResponse all;
    DSG_RETURN_IF_ERROR(session_.ReadPages(&query::Api::ListNodes, request, 0,
                                           &v1::ListNodesResponse::nodes_size, &all));
    for (const v1::Node& in : all.nodes()) {
      DSG_ASSIGN_OR_RETURN(Node node, FromProto(in, layers));
      if (IsAgentKind(node.kind) && !options_.with_agents) continue;
      if (IsWanted(node.valid)) answer_.content.nodes.push_back(std::move(node));
    }
    return absl::OkStatus();
  }

  absl::Status ReadEdges() {
    auto request = Begin<v1::ListEdgesRequest>();
    if (options_.at_ns.has_value()) request.set_at_ns(*options_.at_ns);
    v1::ListEdgesResponse all;
    DSG_RETURN_IF_ERROR(session_.ReadPages(&query::Api::ListEdges, request, 0,
                                           &v1::ListEdgesResponse::edges_size, &all));
    const auto nodes = NodesById(answer_.content);
    for (const v1::Edge& in : all.edges()) {
      DSG_ASSIGN_OR_RETURN(Edge edge, FromProto(in));
      const bool has_ends = nodes.contains(edge.source) && nodes.contains(edge.target);
      if (has_ends && IsWanted(edge.valid)) answer_.content.edges.push_back(std::move(edge));
    }
    return absl::OkStatus();
  }

  absl::Status ReadTracks() {
    for (const Node& node : answer_.content.nodes) {
      if (!IsAgentKind(node.kind)) continue;
      DSG_ASSIGN_OR_RETURN(Track track, ReadTrack(node));
      if (!track.pieces.empty()) answer_.content.tracks.push_back(std::move(track));
    }
    return absl::OkStatus();
  }

  TimeNs GapOf(const Node& agent) const {
    const bool has_own = agent.agent.has_value() && agent.agent->gap_ns_max > 0;
    return has_own ? agent.agent->gap_ns_max : session_.map().gap_ns_max;
  }

  static absl::Status KeepPose(const v1::TimedPose& in, std::vector<TimedPose>* poses) {
    DSG_ASSIGN_OR_RETURN(TimedPose pose, FromProto(in));
    poses->push_back(std::move(pose));
    return absl::OkStatus();
  }

  absl::StatusOr<Track> ReadTrack(const Node& agent) {
    auto request = Begin<v1::GetTrajectoryRequest>();
    request.set_agent(ToString(agent.id));
    if (options_.at_ns.has_value() && *options_.at_ns < kTimeMax) {
      request.set_to_ns(*options_.at_ns + 1);
    }
    Track track{.agent = agent.id, .pieces = {}, .poses = {}};
    absl::Status broken;
    const TimeNs gap_ns = GapOf(agent);
    std::optional<TimeNs> last_ns;
    Eigen::Vector3d last_map = Eigen::Vector3d::Zero();
    const auto take = [&](const v1::TimedPose& in) {
      if (options_.with_poses) broken = KeepPose(in, &track.poses);
      const Eigen::Vector3d point_map = FromProto(in.pose()).position;
      const bool begins = !last_ns.has_value() || in.time_ns() - *last_ns > gap_ns;
      if (begins) track.pieces.emplace_back();
      std::vector<Eigen::Vector3d>& piece = track.pieces.back();
      if (begins || (point_map - piece.back()).norm() >= kStepM) piece.push_back(point_map);
      last_ns = in.time_ns();
      last_map = point_map;
    };
    DSG_RETURN_IF_ERROR(session_.Read(&query::Api::GetTrajectory, request,
                                      [&](const v1::GetTrajectoryResponse& message) {
                                        for (const v1::TimedPose& pose : message.poses())
                                          take(pose);
                                        return broken.ok();
                                      }));
    DSG_RETURN_IF_ERROR(broken);
    // The last position is kept, however close it is to the one before.
    if (last_ns.has_value() && track.pieces.back().back() != last_map) {
      track.pieces.back().push_back(last_map);
    }
    return track;
  }

  absl::Status ReadAllBodies() {
    MapContent& content = answer_.content;
    for (size_t i = 0; i < content.tracks.size(); ++i) {
      AgentBodies bodies{.agent = content.tracks[i].agent, .rgb = AgentColor(i), .bodies = {}};
      auto request = Begin<v1::GetAgentShapeRequest>();
      request.set_agent(ToString(bodies.agent));
      if (options_.at_ns.has_value()) {
        DSG_ASSIGN_OR_RETURN(std::optional<Body> body,
                             ReadBodyAt(session_, std::move(request), *options_.at_ns));
        if (body.has_value() && body->face_count() > 0) bodies.bodies = {*std::move(body)};
      } else {
        DSG_RETURN_IF_ERROR(ReadBodiesOverTime(request, &bodies.bodies));
      }
      if (!bodies.bodies.empty()) content.bodies.push_back(std::move(bodies));
    }
    if (content.bodies.empty()) {
      session_.notes() << "note: no agent has a body with faces and a pose then\n";
    }
    return absl::OkStatus();
  }

  absl::Status ReadBodiesOverTime(const v1::GetAgentShapeRequest& request,
                                  std::vector<Body>* bodies) {
    bool is_full = false;
    DSG_RETURN_IF_ERROR(ReadBodies(session_, request, nullptr, [&](const BodySource&, Body body) {
      const bool is_early =
          !bodies->empty() && body.time_ns - bodies->back().time_ns < options_.body_step_ns;
      if (is_early || body.face_count() == 0) return true;
      is_full = ++body_count_ > options_.body_count_max;
      if (!is_full) bodies->push_back(std::move(body));
      return !is_full;
    }));
    if (!is_full) return absl::OkStatus();
    const double step_s = static_cast<double>(options_.body_step_ns) / kNsPerSecond;
    return MakeError(
        Reason::kLimitExceeded,
        absl::StrCat("the map has more than ", options_.body_count_max, " bodies that are ", step_s,
                     " s apart; raise --body-step or --body-max, or give --at"),
        {{"field", "--body-max"}});
  }

  // Indices from a faulty server must not lead outside the lists.
  static absl::Status CheckBlock(const MeshBlock& block) {
    const size_t count = block.positions_map.size();
    const auto fits = [count](size_t size) { return size == 0 || size == count; };
    const bool has_even_channels = fits(block.normals_map.size()) && fits(block.colors.size()) &&
                                   fits(block.labels.size()) && fits(block.instance_ids.size());
    const bool has_own_vertices = std::all_of(
        block.faces.begin(), block.faces.end(),
        [&](const auto& face) { return *std::max_element(face.begin(), face.end()) < count; });
    if (has_even_channels && has_own_vertices) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat(
        "mesh block ", block.index.x, ",", block.index.y, ",", block.index.z,
        " has channels or faces that do not fit its vertices; verify the map with dsg verify"));
  }

  absl::Status ReadMesh() {
    auto request = Begin<v1::GetMeshRequest>();
    request.set_node(options_.mesh_node);
    absl::Status broken;
    const auto take = [&](const v1::GetMeshResponse& message) {
      for (const v1::MeshBlock& in : message.blocks()) {
        absl::StatusOr<MeshBlock> block = FromProto(in);
        broken = block.ok() ? CheckBlock(*block) : block.status();
        if (!broken.ok()) return false;
        answer_.content.mesh.push_back(*std::move(block));
      }
      return true;
    };
    DSG_RETURN_IF_ERROR(session_.Read(&query::Api::GetMesh, request, take));
    return broken;
  }

  Session& session_;
  const ContentOptions options_;
  int64_t body_count_ = 0;
  ContentAnswer answer_;
};

}  // namespace

absl::StatusOr<ContentAnswer> ReadContent(Session* session, const ContentOptions& options) {
  return ContentReader(session, options).Read();
}

absl::StatusOr<ContentAnswer> ReadContentAt(Session* session, const std::string& at,
                                            ContentOptions options) {
  if (!at.empty()) {
    DSG_ASSIGN_OR_RETURN(options.at_ns, ParseInstant("--at", at, session->map()));
  }
  return ReadContent(session, options);
}

}  // namespace dsg::cli
