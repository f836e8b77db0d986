// SPDX-License-Identifier: Apache-2.0
#include "query/engine/agents.h"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/engine/track_walk.h"
#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/base/utf8.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {

v1::PoseQuality QualityToProto(PoseQuality quality) {
  switch (quality) {
    case PoseQuality::kExact:
      return v1::EXACT;
    case PoseQuality::kInterpolated:
      return v1::INTERPOLATED;
    case PoseQuality::kInGap:
      return v1::IN_GAP;
  }
  return v1::POSE_QUALITY_UNSPECIFIED;
}

absl::StatusOr<NodeId> AgentNames::Resolve(const Snapshot& snapshot,
                                           const std::string& id_or_name) {
  if (id_or_name.empty()) {
    return FieldError("agent", "", "give a node id such as H12, or the name that the log gave");
  }
  const Key key{snapshot.opening(), snapshot.revision(), id_or_name};
  if (const auto known = entries_.Find(key)) return *known;
  DSG_ASSIGN_OR_RETURN(const NodeId id, snapshot.ResolveAgent(id_or_name));
  entries_.Insert(key, id, 1);
  return id;
}

absl::StatusOr<std::vector<TrackInfo>> TracksOf(
    AgentNames* names, const Snapshot& snapshot,
    const google::protobuf::RepeatedPtrField<std::string>& agents, const StopCheck& stop) {
  if (agents.empty()) return snapshot.Tracks(stop);
  if (agents.size() > kBatchSizeMax) {
    return FieldError("agents", absl::StrCat(agents.size(), " agents"),
                      "ask for at most 10000 a call, or for none to get all");
  }
  std::set<NodeId> ids;
  for (const std::string& agent : agents) {
    DSG_ASSIGN_OR_RETURN(const NodeId id, names->Resolve(snapshot, agent));
    ids.insert(id);
  }
  std::vector<TrackInfo> tracks;
  for (const NodeId id : ids) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(TrackInfo track, snapshot.GetTrack(id));
    tracks.push_back(std::move(track));
  }
  return tracks;
}

absl::StatusOr<std::optional<LocatedPose>> LocateAt(const Snapshot& snapshot, NodeId agent,
                                                    TimeNs at_ns) {
  DSG_ASSIGN_OR_RETURN(const TrackInfo track, snapshot.GetTrack(agent));
  if (track.pose_count == 0 || at_ns < track.first_ns || at_ns > track.last_ns) {
    return std::optional<LocatedPose>();
  }
  DSG_ASSIGN_OR_RETURN(LocatedPose located, snapshot.Locate(agent, at_ns));
  return std::optional(std::move(located));
}

absl::StatusOr<std::vector<AgentAt>> AgentsAt(const Snapshot& snapshot, NodeFilter filter,
                                              const StopCheck& stop) {
  std::vector<AgentAt> agents;
  if (filter.layer.has_value() && *filter.layer != layers::kAgents) return agents;
  const TimeNs at_ns = *filter.at_ns;
  filter.layer = layers::kAgents;
  // Of the box counts who was in it then, not who was there last.
  const std::optional<Box3d> box_map = filter.box_map;
  filter.box_map.reset();
  std::vector<Node> known;
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
    if (IsAgentKind(node.kind)) known.push_back(node);
    return true;
  }));
  for (Node& node : known) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const auto located, LocateAt(snapshot, node.id, at_ns));
    if (!located.has_value()) continue;
    const bool is_in_gap = located->quality == PoseQuality::kInGap;
    if (!is_in_gap) node.map_T_node = located->map_T_agent;
    if (box_map.has_value() && (is_in_gap || !box_map->intersects(node.BoxMap()))) continue;
    agents.push_back({std::move(node), is_in_gap});
  }
  return agents;
}

namespace {

absl::StatusOr<std::vector<NodeId>> FindIds(const Snapshot& snapshot, const Stay& stay) {
  std::vector<NodeId> ids;
  if (!stay.place.empty()) {
    DSG_ASSIGN_OR_RETURN(ids, snapshot.Ancestors(stay.place));
  }
  if (stay.room.empty() || std::find(ids.begin(), ids.end(), stay.room) != ids.end()) return ids;
  DSG_ASSIGN_OR_RETURN(ids, snapshot.Ancestors(stay.room));
  if (!stay.place.empty()) ids.insert(ids.begin(), stay.room);
  return ids;
}

absl::StatusOr<std::shared_ptr<const Ancestry>> Read(const Snapshot& snapshot, const Stay& stay) {
  DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> ids, FindIds(snapshot, stay));
  auto ancestry = std::make_shared<Ancestry>();
  for (const NodeId id : ids) {
    const absl::StatusOr<Node> node = snapshot.GetNode(id);
    // A stay outlasts a room that turned out never to have been.
    if (absl::IsNotFound(node.status())) continue;
    DSG_RETURN_IF_ERROR(node.status());
    ancestry->ids.push_back(ToString(id));
    const bool is_building = node->kind == kinds::kBuilding;
    if (is_building && ancestry->building_id.empty()) ancestry->building_id = ToString(id);
  }
  return std::shared_ptr<const Ancestry>(std::move(ancestry));
}

}  // namespace

absl::StatusOr<std::shared_ptr<const Ancestry>> AncestryCache::Find(const Snapshot& snapshot,
                                                                    const Stay& stay) {
  const Key key{snapshot.opening(), snapshot.revision(), stay.place, stay.room};
  if (auto known = entries_.Find(key)) return *std::move(known);
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Ancestry> read, Read(snapshot, stay));
  entries_.Insert(key, read, 1);
  return read;
}

namespace {

// Ten thousand messages of this length still fit into one reply.
constexpr size_t kItemMessageLengthMax = 200;

// The parts that the reply of one and the result of many have in common.
template <typename Reply>
void FillPose(const LocatedPose& located, const std::optional<Stay>& stay, Reply* reply) {
  reply->set_quality(QualityToProto(located.quality));
  if (located.quality != PoseQuality::kInGap) {
    ToProto(located.map_T_agent, reply->mutable_pose());
  }
  if (!stay.has_value()) return;
  if (!stay->place.empty()) reply->set_place_id(ToString(stay->place));
  if (!stay->room.empty()) reply->set_room_id(ToString(stay->room));
}

// What a batch needs to know of an agent, found once however often the batch names it.
struct ResolvedAgent {
  absl::StatusOr<NodeId> id;
  std::string id_text;
};

ResolvedAgent Resolve(const Snapshot& snapshot, AgentNames* names, const std::string& agent) {
  absl::StatusOr<NodeId> id = names->Resolve(snapshot, agent);
  std::string text = id.ok() ? ToString(*id) : "";
  return {std::move(id), std::move(text)};
}

absl::Status LocateOne(const Snapshot& snapshot, const ResolvedAgent& agent,
                       const v1::AgentInstant& instant, v1::LocateResult* result) {
  if (!agent.id.ok()) return agent.id.status();
  result->set_agent_id(agent.id_text);
  DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, InstantOf(instant));
  DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(*agent.id, at_ns));
  DSG_ASSIGN_OR_RETURN(const std::optional<Stay> stay, snapshot.StayAt(*agent.id, at_ns));
  FillPose(located, stay, result);
  return absl::OkStatus();
}

void FillError(const absl::Status& status, v1::LocateResult* result) {
  result->set_status_code(static_cast<int32_t>(status.code()));
  std::string message(status.message());
  // Protobuf refuses text that ends within a character.
  message.resize(Utf8Prefix(message, kItemMessageLengthMax).size());
  result->set_status_message(std::move(message));
}

}  // namespace

absl::Status LocateAgent(Engine* engine, const CallContext&, const v1::LocateAgentRequest& request,
                         v1::LocateAgentResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const Snapshot& snapshot = view.snapshot();
  DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, InstantOf(request));
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(snapshot, request.agent()));
  DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(agent, at_ns));
  DSG_ASSIGN_OR_RETURN(const std::optional<Stay> stay, snapshot.StayAt(agent, at_ns));
  DSG_ASSIGN_OR_RETURN(TrackInfo track, snapshot.GetTrack(agent));

  view.FillHeader(reply->mutable_header());
  reply->set_agent_id(ToString(agent));
  reply->set_agent_name(std::move(track.name));
  reply->set_at_ns(at_ns);
  reply->set_before_ns(located.before_ns);
  reply->set_after_ns(located.after_ns);
  reply->set_orientation_unknown((located.flags & pose_flags::kNoOrientation) != 0);
  FillPose(located, stay, reply);
  if (located.covariance != nullptr) {
    reply->mutable_covariance()->Add(located.covariance->begin(), located.covariance->end());
  }
  if (!stay.has_value()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Ancestry> ancestry,
                       engine->ancestries.Find(snapshot, *stay));
  reply->set_building_id(ancestry->building_id);
  reply->mutable_ancestor_ids()->Add(ancestry->ids.begin(), ancestry->ids.end());
  return absl::OkStatus();
}

// Names are resolved once a batch.
absl::Status BatchLocateAgents(Engine* engine, const CallContext& call,
                               const v1::BatchLocateAgentsRequest& request,
                               v1::BatchLocateAgentsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const int count = request.instants_size();
  if (count > kBatchSizeMax) {
    return FieldError("instants", absl::StrCat(count, " pairs"), "ask for at most 10000 a call");
  }
  view.FillHeader(reply->mutable_header());
  reply->mutable_results()->Reserve(count);
  std::unordered_map<std::string_view, ResolvedAgent> agents;
  for (int i = 0; i < count; ++i) {
    // Looking at the clock costs a tenth of a lookup, so not for every pair.
    if (i % 64 == 0) DSG_RETURN_IF_ERROR(call.Check());
    const v1::AgentInstant& instant = request.instants(i);
    auto found = agents.find(instant.agent());
    if (found == agents.end()) {
      found =
          agents.emplace(instant.agent(), Resolve(view.snapshot(), &engine->names, instant.agent()))
              .first;
    }
    v1::LocateResult* result = reply->add_results();
    const absl::Status status = LocateOne(view.snapshot(), found->second, instant, result);
    if (!status.ok()) FillError(status, result);
  }
  return absl::OkStatus();
}

namespace {

constexpr size_t kPosesPerMessage = 1000;

class TrajectoryCursor final : public EngineCursor<v1::GetTrajectoryResponse> {
 public:
  TrajectoryCursor(const ReadView& view, TrackWalk walk) : view_(view), walk_(std::move(walk)) {}

  bool done() const override { return walk_.done(); }

 private:
  absl::Status Fill(const CallContext& call, v1::GetTrajectoryResponse* reply) override {
    if (is_first_) {
      view_.FillHeader(reply->mutable_header());
      reply->set_agent_id(ToString(walk_.track().agent));
      is_first_ = false;
    }
    return walk_.Read(view_.snapshot(), call.stop(), [&](absl::Span<const TimedPose> poses, bool) {
      poses = poses.subspan(0, kPosesPerMessage - static_cast<size_t>(reply->poses_size()));
      for (const TimedPose& pose : poses) ToProto(pose, reply->add_poses());
      return poses.size();
    });
  }

  const ReadView view_;
  TrackWalk walk_;
  bool is_first_ = true;
};

}  // namespace

CursorOr<v1::GetTrajectoryResponse> GetTrajectory(Engine* engine, const CallContext&,
                                                  const v1::GetTrajectoryRequest& request) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const WalkRange range, WalkRangeOf(request));
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(view.snapshot(), request.agent()));
  DSG_ASSIGN_OR_RETURN(TrackInfo track, view.snapshot().GetTrack(agent));
  return std::make_unique<TrajectoryCursor>(view, TrackWalk(std::move(track), range));
}

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
