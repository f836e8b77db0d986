// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/remote_writer.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/api/api.h"
#include "query/client/remote_api.h"
#include "query/client/retry.h"
#include "schema/base/status.h"
#include "schema/codec/patch.h"
#include "schema/codec/proto_convert.h"

namespace dsg::ingest {
namespace {

constexpr int kPageSize = 500;
// An answer may be so long: a page of nodes, or 1000 poses.
constexpr int kReceiveBytesMax = 64 << 20;
// Between a look at the agents and the commit others may write, again and again.
constexpr int kGuardedTriesMax = 100;

/// What all calls to one server share.
struct Connection {
  Connection(std::unique_ptr<query::Api> connected, const std::string& address,
             const RemoteOptions& options)
      : api(std::move(connected)), caller(address, options.retry_ns_max, options.tell) {}

  /// Makes one call of the api until it is answered.
  template <class Request, class Reply>
  absl::Status Call(absl::Status (query::Api::*method)(const query::CallContext&, const Request&,
                                                       Reply*),
                    const Request& request, Reply* reply) {
    return caller.Call(
        [&](const query::CallContext& call) { return (api.get()->*method)(call, request, reply); });
  }

  const std::unique_ptr<query::Api> api;
  client::PatientCaller caller;
};

// What a robot, or who looks after it, can do about a commit that the server refused.
absl::Status Advise(const absl::Status& status, const std::string& address) {
  constexpr char kGoesOn[] = "then run the same dsg-ingest again: it goes on where it stopped";
  switch (ReasonOf(status)) {
    case Reason::kQuotaExceeded:
      // The server says how to make room; only where, and what then, is missing.
      return MakeError(Reason::kQuotaExceeded,
                       absl::StrCat(status.message(), " of server ", address, ", ", kGoesOn),
                       MetadataOf(status));
    case Reason::kDiskFull:
      return Annotate(status, absl::StrCat("server ", address,
                                           " takes no more; make room on its disk, or forget with "
                                           "dsg prune, ",
                                           kGoesOn));
    case Reason::kSequenceGap:
      return Annotate(
          status,
          absl::StrCat("server ", address,
                       " has less than it acknowledged (was a backup restored?); ", kGoesOn));
    case Reason::kMapUnknown:
      return Annotate(status, absl::StrCat("the map was dropped or renamed on server ", address,
                                           " while it was written; look at `dsg maps --server ",
                                           address, "`, then ingest into the map of the new name"));
    default:
      return status;
  }
}

// All nodes of a layer, of one revision.
absl::Status ListLayer(Connection& connection, const std::string& map, const std::string& layer,
                       std::vector<Node>* nodes, Revision* revision) {
  v1::ListNodesRequest request;
  request.set_map(map);
  request.mutable_filter()->set_layer(layer);
  request.set_view(v1::NODE_VIEW_FULL);
  request.set_page_size(kPageSize);
  const LayerTable layers;
  do {
    v1::ListNodesResponse response;
    DSG_RETURN_IF_ERROR(connection.Call(&query::Api::ListNodes, request, &response));
    *revision = response.header().read_revision();
    for (const v1::Node& proto : response.nodes()) {
      DSG_ASSIGN_OR_RETURN(Node node, FromProto(proto, layers));
      nodes->push_back(std::move(node));
    }
    // The token holds the revision of the first page.
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty());
  return absl::OkStatus();
}

// Robots that write one map at once choose ids for new agents of what they know of it; what one
// brings first, the other must not write over.
class RemoteWriter : public GraphWriter {
 public:
  RemoteWriter(Connection& connection, std::string map)
      : connection_(connection), map_(std::move(map)) {}

  absl::StatusOr<CommitResult> Commit(GraphDelta delta) override {
    // The wire names layers; those of earlier deltas must be known by then.
    for (const Layer& layer : delta.layers) {
      if (layers_.Find(layer.id) == nullptr) layers_.Add(layer);
    }
    v1::CommitRequest request;
    ToProto(delta, layers_, request.mutable_delta());
    // What a log says of a thing is all that is to be believed of it.
    MarkWhole(request.mutable_delta());
    if (request.ByteSizeLong() > static_cast<size_t>(client::kMessageBytesMax)) {
      return MakeError(Reason::kLimitExceeded,
                       absl::StrCat("part ", delta.sequence, " of session ", delta.session_id,
                                    " is ", request.ByteSizeLong(), " bytes long, a server takes ",
                                    client::kMessageBytesMax,
                                    "; ingest into the store's folder with --store instead"),
                       {{"sequence", absl::StrCat(delta.sequence)}});
    }
    v1::CommitResponse response;
    absl::Status status = absl::OkStatus();
    const std::vector<Node> agents = NewAgents(delta);
    for (int tries = 0; tries < kGuardedTriesMax; ++tries) {
      if (!agents.empty()) DSG_RETURN_IF_ERROR(Guard(agents, request.mutable_delta()));
      status = connection_.Call(&query::Api::Commit, request, &response);
      if (agents.empty() || ReasonOf(status) != Reason::kParentRevisionStale) break;
    }
    if (!status.ok()) return Advise(status, connection_.caller.address());
    for (const Node& agent : agents) brought_.insert(agent.id);
    return CommitResult{response.revision(), response.replayed()};
  }

  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override {
    v1::GetSessionRequest request;
    request.set_map(map_);
    request.set_session_id(session_id);
    v1::GetSessionResponse response;
    DSG_RETURN_IF_ERROR(connection_.Call(&query::Api::GetSession, request, &response));
    return SessionState{response.last_sequence(), response.last_revision(),
                        response.first_revision()};
  }

 private:
  std::vector<Node> NewAgents(const GraphDelta& delta) const {
    std::vector<Node> agents;
    for (const Node& node : delta.nodes) {
      if (IsAgentKind(node.kind) && !brought_.contains(node.id)) agents.push_back(node);
    }
    return agents;
  }

  // Makes the delta one of the newest revision, in which the ids must be free, or of the same
  // agents.
  absl::Status Guard(const std::vector<Node>& agents, v1::GraphDelta* delta) {
    std::vector<Node> known;
    Revision revision = 0;
    DSG_RETURN_IF_ERROR(ListLayer(connection_, map_, "agents", &known, &revision));
    for (const Node& agent : agents) {
      const auto same_id = std::find_if(known.begin(), known.end(),
                                        [&](const Node& node) { return node.id == agent.id; });
      if (same_id == known.end() || same_id->name == agent.name) continue;
      return MakeError(
          Reason::kParentRevisionStale,
          absl::StrCat("map \"", map_, "\": ", ToString(agent.id), ", chosen for agent \"",
                       agent.name, "\", has become the id of \"", same_id->name,
                       "\"; read the map again and choose another"),
          {{"map", map_}, {"agent", ToString(agent.id)}});
    }
    delta->set_parent_revision(revision);
    return absl::OkStatus();
  }

  Connection& connection_;
  std::string map_;
  LayerTable layers_;
  /// Agents whose ids this writer has made its own.
  std::set<NodeId> brought_;
};

class GrpcRemoteMap : public RemoteMap {
 public:
  /// `incarnation`: of a map that opening has made; empty for others.
  GrpcRemoteMap(std::unique_ptr<Connection> connection, MapSpec spec, std::string incarnation)
      : connection_(std::move(connection)),
        spec_(std::move(spec)),
        incarnation_(std::move(incarnation)),
        writer_(*connection_, spec_.name) {}

  GraphWriter& writer() override { return writer_; }
  const MapSpec& spec() const override { return spec_; }
  bool is_new() const override { return !incarnation_.empty(); }

  absl::Status Drop(Revision head) override {
    v1::DropMapRequest request;
    request.set_map(spec_.name);
    request.set_expected_head_revision(head);
    request.set_expected_incarnation(incarnation_);
    v1::DropMapResponse response;
    return connection_->Call(&query::Api::DropMap, request, &response);
  }

  absl::StatusOr<std::vector<Node>> ListNodes(const std::string& layer) override {
    std::vector<Node> nodes;
    Revision revision = 0;
    DSG_RETURN_IF_ERROR(ListLayer(*connection_, spec_.name, layer, &nodes, &revision));
    return nodes;
  }

  absl::StatusOr<std::vector<NodeId>> ListChildren(NodeId parent) override {
    v1::ListEdgesRequest request;
    request.set_map(spec_.name);
    request.set_source(ToString(parent));
    request.set_relation(relations::kContains);
    request.set_page_size(kPageSize);
    std::vector<NodeId> children;
    do {
      v1::ListEdgesResponse response;
      DSG_RETURN_IF_ERROR(connection_->Call(&query::Api::ListEdges, request, &response));
      for (const v1::Edge& edge : response.edges()) {
        DSG_ASSIGN_OR_RETURN(const NodeId child, ParseNodeId(edge.target()));
        children.push_back(child);
      }
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    return children;
  }

  absl::StatusOr<std::vector<Node>> ListAgents() override {
    DSG_ASSIGN_OR_RETURN(std::vector<Node> agents, ListNodes("agents"));
    std::erase_if(agents, [](const Node& node) { return !IsAgentKind(node.kind); });
    return agents;
  }

  absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before, int limit) override {
    v1::ListRevisionsRequest request;
    request.set_map(spec_.name);
    request.set_before_revision(before);
    request.set_page_size(limit);
    v1::ListRevisionsResponse response;
    DSG_RETURN_IF_ERROR(connection_->Call(&query::Api::ListRevisions, request, &response));
    std::vector<RevisionInfo> revisions;
    for (const v1::Revision& proto : response.revisions()) {
      RevisionInfo& info = revisions.emplace_back();
      info.revision = proto.revision();
      info.committed_ns = proto.committed_ns();
      info.author = proto.author();
      info.message = proto.message();
      info.session_id = proto.session_id();
      info.sequence = proto.sequence();
      info.config_digest = proto.config_digest();
    }
    return revisions;
  }

  absl::StatusOr<std::optional<TrackInfo>> FindTrack(NodeId agent,
                                                     std::optional<Revision> at) override {
    v1::GetNodeRequest request;
    request.set_map(spec_.name);
    if (at.has_value()) request.mutable_read_at()->set_exact_revision(*at);
    request.set_id(ToString(agent));
    request.set_view(v1::NODE_VIEW_BASIC);
    v1::GetNodeResponse response;
    const absl::Status status = connection_->Call(&query::Api::GetNode, request, &response);
    if (ReasonOf(status) == Reason::kNodeUnknown) return std::nullopt;
    DSG_RETURN_IF_ERROR(status);
    // An unknown id may be another node's name.
    if (response.node().id() != request.id() || response.pose_count() == 0) return std::nullopt;
    return TrackInfo{.agent = agent,
                     .name = response.node().name(),
                     .kind = response.node().kind(),
                     .pose_count = response.pose_count(),
                     .first_ns = response.first_pose_ns(),
                     .last_ns = response.last_pose_ns(),
                     .gap_ns_max = spec_.gap_ns_max};
  }

  absl::StatusOr<std::vector<TimedPose>> ReadPoses(NodeId agent, TimeNs from_ns,
                                                   TimeNs to_ns) override {
    v1::GetTrajectoryRequest request;
    request.set_map(spec_.name);
    request.set_agent(ToString(agent));
    request.set_from_ns(from_ns);
    request.set_to_ns(to_ns);
    std::vector<v1::TimedPose> received;
    const absl::Status status = connection_->caller.Call([&](const query::CallContext& call) {
      received.clear();
      return query::ReadStream(call, connection_->api->GetTrajectory(call, request),
                               [&](const v1::GetTrajectoryResponse& response) {
                                 received.insert(received.end(), response.poses().begin(),
                                                 response.poses().end());
                                 return true;
                               });
    });
    const Reason reason = ReasonOf(status);
    if (reason == Reason::kTimeOutsideTrack || reason == Reason::kAgentUnknown) {
      return std::vector<TimedPose>();
    }
    DSG_RETURN_IF_ERROR(status);
    std::vector<TimedPose> poses;
    poses.reserve(received.size());
    for (const v1::TimedPose& proto : received) {
      DSG_ASSIGN_OR_RETURN(TimedPose pose, FromProto(proto));
      poses.push_back(std::move(pose));
    }
    return poses;
  }

 private:
  std::unique_ptr<Connection> connection_;
  MapSpec spec_;
  std::string incarnation_;
  RemoteWriter writer_;
};

absl::StatusOr<std::optional<MapSpec>> FindMap(Connection& connection, const std::string& name) {
  v1::ListMapsResponse response;
  DSG_RETURN_IF_ERROR(connection.Call(&query::Api::ListMaps, v1::ListMapsRequest(), &response));
  for (const v1::MapSpec& map : response.maps()) {
    if (map.name() != name) continue;
    DSG_ASSIGN_OR_RETURN(MapSpec spec, FromProto(map));
    return spec;
  }
  return std::nullopt;
}

// The incarnation of the new map; empty if it was there already.
absl::StatusOr<std::string> CreateMap(Connection& connection, const MapSpec& spec) {
  v1::CreateMapRequest request;
  ToProto(spec, request.mutable_map());
  v1::CreateMapResponse response;
  const absl::Status status = connection.Call(&query::Api::CreateMap, request, &response);
  // A repeated call, or another client that was faster; its map serves as well.
  if (ReasonOf(status) == Reason::kMapExists) return std::string();
  DSG_RETURN_IF_ERROR(status);
  v1::GetMapStatsRequest look;
  look.set_map(spec.name);
  v1::GetMapStatsResponse stats;
  DSG_RETURN_IF_ERROR(connection.Call(&query::Api::GetMapStats, look, &stats));
  return stats.header().incarnation();
}

}  // namespace

absl::StatusOr<std::unique_ptr<RemoteMap>> OpenRemoteMap(const std::string& address,
                                                         const MapSpec& spec,
                                                         const RemoteOptions& options) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<query::Api> api,
                       client::Connect(client::ServerAddress{.address = address,
                                                             .repeats = false,
                                                             .keeps_alive = true,
                                                             .receive_bytes_max = kReceiveBytesMax,
                                                             .credentials = options.credentials}));
  auto connection = std::make_unique<Connection>(std::move(api), address, options);
  DSG_ASSIGN_OR_RETURN(std::optional<MapSpec> found, FindMap(*connection, spec.name));
  std::string incarnation;
  if (!found.has_value()) {
    DSG_ASSIGN_OR_RETURN(incarnation, CreateMap(*connection, spec));
    DSG_ASSIGN_OR_RETURN(found, FindMap(*connection, spec.name));
  }
  if (!found.has_value()) {
    return MakeError(Reason::kMapUnknown,
                     absl::StrCat("map \"", spec.name, "\" was created on server ", address,
                                  " but is not listed there; look at the server's log"),
                     {{"map", spec.name}});
  }
  return std::make_unique<GrpcRemoteMap>(std::move(connection), *std::move(found),
                                         std::move(incarnation));
}

}  // namespace dsg::ingest
