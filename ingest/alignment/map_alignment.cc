// SPDX-License-Identifier: Apache-2.0
#include "ingest/alignment/map_alignment.h"

#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/recognition/place_index.h"
#include "ingest/recognition/place_memory.h"
#include "ingest/recognition/place_verifier.h"
#include "schema/base/status.h"
#include "schema/model/layer.h"

namespace dsg::ingest {
namespace {

/// What the robots of a map remember; tracks are counted from the first one on.
struct Memory {
  std::vector<NodeId> robots;
  std::vector<KeyframeFeatures> keyframes;
};

absl::StatusOr<std::vector<Node>> RobotsWithMemory(const Snapshot& map) {
  std::vector<Node> robots;
  NodeFilter filter;
  filter.layer = layers::kAgents;
  DSG_RETURN_IF_ERROR(map.ScanNodes(filter, {}, {}, [&](const Node& node) {
    if (node.agent.has_value() && !node.agent->place_memory.empty()) {
      robots.push_back(node);
    }
    return true;
  }));
  return robots;
}

absl::StatusOr<Memory> MemoryOf(const NamedMap& named, int first_track) {
  Memory memory;
  DSG_ASSIGN_OR_RETURN(const std::vector<Node> robots, RobotsWithMemory(*named.map));
  for (const Node& robot : robots) {
    const int track = first_track + static_cast<int>(memory.robots.size());
    memory.robots.push_back(robot.id);
    for (const Sha256& part : robot.agent->place_memory) {
      DSG_ASSIGN_OR_RETURN(const Asset asset, named.map->ReadAsset(part));
      auto keyframes = DecodePlaceMemory(asset.content, track);
      if (!keyframes.ok()) {
        return Annotate(keyframes.status(),
                        absl::StrCat("map \"", named.name, "\", robot ", ToString(robot.id)));
      }
      for (KeyframeFeatures& keyframe : *keyframes) memory.keyframes.push_back(std::move(keyframe));
    }
  }
  if (!memory.keyframes.empty()) return memory;
  return MakeError(Reason::kNoRegistration,
                   absl::StrCat("no robot of map \"", named.name,
                                "\" remembers places; ingest its log with --recognize"));
}

/// Nullopt where the track does not tell: before its begin, in a gap, or erased.
std::optional<Pose3d> BodyAt(const Snapshot& map, NodeId robot, TimeNs time_ns) {
  const absl::StatusOr<LocatedPose> located = map.Locate(robot, time_ns);
  if (!located.ok() || located->quality == PoseQuality::kInGap) return std::nullopt;
  return located->map_T_agent;
}

class Aligner {
 public:
  static absl::StatusOr<Aligner> Make(const NamedMap& into, const NamedMap& other,
                                      const MapAlignmentOptions& options) {
    DSG_ASSIGN_OR_RETURN(PlaceIndex index, PlaceIndex::Make(options.index));
    DSG_ASSIGN_OR_RETURN(const PlaceVerifier verifier, PlaceVerifier::Make(options.verifier));
    return Aligner(into, other, std::move(index), verifier);
  }

  void Remember(Memory memory) {
    robots_ = std::move(memory.robots);
    for (KeyframeFeatures& keyframe : memory.keyframes) {
      index_.Add(std::make_shared<const KeyframeFeatures>(std::move(keyframe)));
    }
  }

  void Seek(NodeId other_robot, const KeyframeFeatures& keyframe) {
    const TimeNs time_ns = keyframe.stamp.time_ns;
    const std::optional<Pose3d> other_T_body = BodyAt(*other_.map, other_robot, time_ns);
    if (!other_T_body.has_value()) return;
    for (const PlaceCandidate& candidate : index_.Query(keyframe)) {
      const KeyframeStamp& from = candidate.keyframe->stamp;
      const NodeId robot = robots_[static_cast<size_t>(from.track)];
      const std::optional<Pose3d> map_T_body = BodyAt(*into_.map, robot, from.time_ns);
      if (!map_T_body.has_value()) continue;
      const PlaceVerdict verdict = verifier_.Verify(*candidate.keyframe, keyframe);
      if (verdict.outcome != PlaceOutcome::kVerified) continue;
      ties_.push_back({time_ns, *map_T_body, *other_T_body, verdict.from_T_to});
    }
  }

  const std::vector<SessionTie>& ties() const { return ties_; }

 private:
  Aligner(const NamedMap& into, const NamedMap& other, PlaceIndex index,
          const PlaceVerifier& verifier)
      : into_(into), other_(other), index_(std::move(index)), verifier_(verifier) {}

  NamedMap into_;
  NamedMap other_;
  PlaceIndex index_;
  PlaceVerifier verifier_;
  /// Of `into`, by track.
  std::vector<NodeId> robots_;
  std::vector<SessionTie> ties_;
};

}  // namespace

std::vector<BoundOption> MapAlignmentOptions::Bind() {
  std::vector<BoundOption> bound = index.Bind();
  for (const BoundOption& field : verifier.Bind()) bound.push_back(field);
  for (const BoundOption& field : sessions.Bind()) bound.push_back(field);
  return bound;
}

absl::StatusOr<MapAlignment> AlignMaps(const NamedMap& into, const NamedMap& other,
                                       const MapAlignmentOptions& options,
                                       const std::function<void(int64_t, int64_t)>& on_work) {
  DSG_ASSIGN_OR_RETURN(Aligner aligner, Aligner::Make(into, other, options));
  DSG_ASSIGN_OR_RETURN(Memory known, MemoryOf(into, 0));
  const int first_other = static_cast<int>(known.robots.size());
  DSG_ASSIGN_OR_RETURN(const Memory sought, MemoryOf(other, first_other));
  MapAlignment alignment;
  alignment.keyframe_count = static_cast<int>(known.keyframes.size());
  alignment.other_keyframe_count = static_cast<int>(sought.keyframes.size());
  aligner.Remember(std::move(known));
  int64_t count = 0;
  for (const KeyframeFeatures& keyframe : sought.keyframes) {
    aligner.Seek(sought.robots[static_cast<size_t>(keyframe.stamp.track - first_other)], keyframe);
    if (on_work) on_work(++count, std::ssize(sought.keyframes));
  }
  auto found = AlignSessions(aligner.ties(), options.sessions);
  if (!found.ok()) {
    return Annotate(found.status(),
                    absl::StrCat("map \"", other.name, "\" is not found in \"", into.name, "\""));
  }
  alignment.found = *std::move(found);
  return alignment;
}

}  // namespace dsg::ingest
