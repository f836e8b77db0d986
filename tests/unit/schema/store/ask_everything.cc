// SPDX-License-Identifier: Apache-2.0
// Every question a snapshot answers, with every bit of each answer as text.
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

template <typename T>
std::string Hex(const T& value) {
  return absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(&value), sizeof(T)));
}

std::string Text(const Node& node) {
  return absl::StrCat(ToString(node.id), " layer ", node.layer, " revision ", node.revision, " ",
                      absl::BytesToHexString(EncodeNodePayload(node)), "\n");
}

std::string Text(const Edge& edge) {
  return absl::StrCat(ToString(edge.source), " ", edge.relation, " ", ToString(edge.target), " ",
                      Hex(edge.weight), " revision ", edge.revision, " ",
                      absl::BytesToHexString(EncodeEdgePayload(edge)), "\n");
}

std::string Text(const Pose3d& pose) {
  const Eigen::Vector4d q = pose.orientation.coeffs();
  return absl::StrCat(Hex(pose.position.x()), Hex(pose.position.y()), Hex(pose.position.z()),
                      Hex(q.x()), Hex(q.y()), Hex(q.z()), Hex(q.w()));
}

std::string Text(const TimedPose& pose) {
  return absl::StrCat(pose.time_ns, " ", pose.flags, " ", Text(pose.map_T_agent), " ",
                      pose.covariance == nullptr ? "" : Hex(*pose.covariance), "\n");
}

std::string Text(const Stay& stay) {
  return absl::StrCat(ToString(stay.agent), " in ", ToString(stay.place), " ", ToString(stay.room),
                      " ", stay.enter_ns, " ", stay.exit_ns, "\n");
}

std::string Text(const RevisionInfo& info) {
  return absl::StrCat(info.revision, " ", info.committed_ns, " ", info.author, " ", info.message,
                      " ", info.session_id, " ", info.sequence, " ", info.config_digest, " ",
                      ToHex(info.digest), " ", info.node_count, " ", info.edge_count, " ",
                      info.agent_count, " ", info.pose_count, " ", info.stay_count, " ",
                      info.mesh_block_count, "\n");
}

// A stopped question answers what it answers; what it was is the caller's business.
class Asker {
 public:
  explicit Asker(const Snapshot& snapshot) : snapshot_(snapshot) {}

  std::vector<Answer> Ask() {
    using Question = absl::StatusOr<std::string> (Asker::*)();
    const std::pair<const char*, Question> questions[] = {
        {"spec", &Asker::AskSpec},
        {"stats", &Asker::AskStats},
        {"ScanNodes", &Asker::AskNodes},
        {"GetNode", &Asker::AskSingleNodes},
        {"ScanNodes of a layer", &Asker::AskLayers},
        {"ScanNodes in a box", &Asker::AskBoxes},
        {"ResolveNode", &Asker::AskNames},
        {"Ancestors", &Asker::AskAncestors},
        {"ScanEdges", &Asker::AskEdges},
        {"ScanEdges to a node", &Asker::AskEdgesTo},
        {"ReadPoses", &Asker::AskPoses},
        {"Locate", &Asker::AskPositions},
        {"VisitsToBox", &Asker::AskVisits},
        {"stays", &Asker::AskStays},
        {"StaysInNode", &Asker::AskStaysInNodes},
        {"factors and shapes", &Asker::AskBatches},
        {"mesh", &Asker::AskMesh},
        {"assets", &Asker::AskAssets},
    };
    std::vector<Answer> answers;
    for (const auto& [name, question] : questions) answers.push_back({name, (this->*question)()});
    return answers;
  }

 private:
  absl::StatusOr<std::string> AskSpec() {
    const MapSpec& spec = snapshot_.spec();
    return absl::StrCat(spec.name, " ", spec.frame, " ", spec.epoch_ns, " ",
                        static_cast<int>(spec.clock), " ", static_cast<int>(spec.codec), " ",
                        spec.gap_ns_max, " ", Hex(spec.mesh_block_size_m));
  }

  absl::StatusOr<std::string> AskStats() {
    DSG_ASSIGN_OR_RETURN(const MapStats stats, snapshot_.Stats());
    std::string text = absl::StrCat(Text(stats.at), stats.first_pose_ns.value_or(-1), " ",
                                    stats.last_pose_ns.value_or(-1), "\n");
    for (const LayerCount& count : stats.layers) {
      absl::StrAppend(&text, count.layer.id, " ", count.layer.name, " ", count.layer.rank, " ",
                      count.node_count, "\n");
    }
    DSG_ASSIGN_OR_RETURN(const auto labels, snapshot_.Labels());
    for (const SemanticLabel& label : labels) {
      absl::StrAppend(&text, "label ", label.id, " ", label.name, "\n");
    }
    return text;
  }

  absl::StatusOr<std::vector<Node>> Scan(const NodeFilter& filter) {
    std::vector<Node> nodes;
    DSG_RETURN_IF_ERROR(snapshot_.ScanNodes(filter, NodeId(), {}, [&](const Node& node) {
      nodes.push_back(node);
      return true;
    }));
    return nodes;
  }

  absl::StatusOr<std::string> ScanText(const NodeFilter& filter) {
    DSG_ASSIGN_OR_RETURN(const auto nodes, Scan(filter));
    std::string text;
    for (const Node& node : nodes) text += Text(node);
    return text;
  }

  absl::StatusOr<std::string> AskNodes() { return ScanText({}); }

  absl::StatusOr<std::string> AskSingleNodes() {
    DSG_ASSIGN_OR_RETURN(const auto nodes, Scan({}));
    std::string text;
    for (const Node& node : nodes) {
      DSG_ASSIGN_OR_RETURN(const Node again, snapshot_.GetNode(node.id));
      text += Text(again);
    }
    return text;
  }

  absl::StatusOr<std::string> AskLayers() {
    DSG_ASSIGN_OR_RETURN(const auto layers, snapshot_.Layers());
    std::string text;
    for (const Layer& layer : layers) {
      NodeFilter filter;
      filter.layer = layer.id;
      DSG_ASSIGN_OR_RETURN(const std::string part, ScanText(filter));
      text += part;
    }
    return text;
  }

  absl::StatusOr<std::string> AskBoxes() {
    std::string text;
    for (const LayerId layer : {layers::kObjects, layers::kPlaces, layers::kRooms}) {
      for (double x = 0.0; x < 100.0; x += 20.0) {
        NodeFilter filter;
        filter.layer = layer;
        filter.box_map = BoxOf(x, 0, 0, x + 15.0, 60, 5);
        DSG_ASSIGN_OR_RETURN(const std::string part, ScanText(filter));
        text += part;
      }
    }
    return text;
  }

  absl::StatusOr<std::string> AskNames() {
    DSG_ASSIGN_OR_RETURN(const auto nodes, Scan({}));
    std::string text;
    for (const Node& node : nodes) {
      if (node.name.empty()) continue;
      DSG_ASSIGN_OR_RETURN(const NodeId found, snapshot_.ResolveNode(node.name));
      absl::StrAppend(&text, node.name, " ", ToString(found), "\n");
    }
    return text;
  }

  absl::StatusOr<std::string> AskAncestors() {
    DSG_ASSIGN_OR_RETURN(const auto nodes, Scan({}));
    std::string text;
    for (const Node& node : nodes) {
      DSG_ASSIGN_OR_RETURN(const auto ancestors, snapshot_.Ancestors(node.id));
      for (const NodeId id : ancestors) absl::StrAppend(&text, ToString(id), " ");
      text += "\n";
    }
    return text;
  }

  absl::StatusOr<std::string> EdgesText(const EdgeFilter& filter) {
    std::string text;
    DSG_RETURN_IF_ERROR(snapshot_.ScanEdges(filter, std::nullopt, {}, [&](const Edge& edge) {
      text += Text(edge);
      return true;
    }));
    return text;
  }

  absl::StatusOr<std::string> AskEdges() { return EdgesText({}); }

  absl::StatusOr<std::string> AskEdgesTo() {
    DSG_ASSIGN_OR_RETURN(const auto nodes, Scan({}));
    std::string text;
    for (const Node& node : nodes) {
      EdgeFilter filter;
      filter.target = node.id;
      DSG_ASSIGN_OR_RETURN(const std::string part, EdgesText(filter));
      text += part;
    }
    return text;
  }

  absl::StatusOr<std::string> AskPoses() {
    DSG_ASSIGN_OR_RETURN(const auto tracks, snapshot_.Tracks());
    std::string text;
    for (const TrackInfo& track : tracks) {
      absl::StrAppend(&text, ToString(track.agent), " ", track.name, " ", track.kind, " ",
                      track.pose_count, " ", track.first_ns, " ", track.last_ns, " ",
                      track.gap_ns_max, "\n");
      DSG_RETURN_IF_ERROR(
          snapshot_.ReadPoses(track.agent, kTimeMin, kTimeMax, {}, [&](const TimedPose& pose) {
            text += Text(pose);
            return true;
          }));
    }
    return text;
  }

  absl::StatusOr<std::string> AskPositions() {
    DSG_ASSIGN_OR_RETURN(const auto tracks, snapshot_.Tracks());
    std::string text;
    for (const TrackInfo& track : tracks) {
      if (track.pose_count == 0) continue;
      for (int i = 0; i <= 40; ++i) {
        const TimeNs at_ns = track.first_ns + (track.last_ns - track.first_ns) / 40 * i;
        DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot_.Locate(track.agent, at_ns));
        absl::StrAppend(&text, static_cast<int>(located.quality), " ", located.before_ns, " ",
                        located.after_ns, " ", located.flags, " ", Text(located.map_T_agent), "\n");
      }
    }
    return text;
  }

  absl::StatusOr<std::string> AskVisits() {
    std::string text;
    for (double x = 0.0; x < 100.0; x += 25.0) {
      DSG_ASSIGN_OR_RETURN(
          const auto visits,
          snapshot_.VisitsToBox(BoxOf(x, 10, -1, x + 20.0, 50, 3), kTimeMin, kTimeMax, {}));
      for (const BoxVisit& visit : visits) {
        absl::StrAppend(&text, ToString(visit.agent), " ", visit.enter_ns, " ", visit.exit_ns,
                        "\n");
      }
    }
    return text;
  }

  absl::StatusOr<std::string> AskStays() {
    DSG_ASSIGN_OR_RETURN(const auto tracks, snapshot_.Tracks());
    std::string text;
    for (const TrackInfo& track : tracks) {
      DSG_ASSIGN_OR_RETURN(const auto stays,
                           snapshot_.StaysOfAgent(track.agent, kTimeMin, kTimeMax));
      for (const Stay& stay : stays) text += Text(stay);
    }
    return text;
  }

  absl::StatusOr<std::string> AskStaysInNodes() {
    std::string text;
    for (const LayerId layer : {layers::kRooms, layers::kPlaces}) {
      NodeFilter filter;
      filter.layer = layer;
      DSG_ASSIGN_OR_RETURN(const auto nodes, Scan(filter));
      for (const Node& node : nodes) {
        DSG_ASSIGN_OR_RETURN(const auto stays,
                             snapshot_.StaysInNode(node.id, kTimeMin, kTimeMax, {}));
        for (const Stay& stay : stays) text += Text(stay);
      }
    }
    return text;
  }

  absl::StatusOr<std::string> AskBatches() {
    DSG_ASSIGN_OR_RETURN(const auto tracks, snapshot_.Tracks());
    std::string text;
    for (const TrackInfo& track : tracks) {
      DSG_ASSIGN_OR_RETURN(const auto factors, snapshot_.Factors(track.agent, kTimeMin, kTimeMax));
      DSG_ASSIGN_OR_RETURN(const auto shapes, snapshot_.Shapes(track.agent, kTimeMin, kTimeMax));
      absl::StrAppend(&text, absl::BytesToHexString(EncodeFactors(factors)), "\n");
      for (const BodyShape& shape : shapes) {
        const ShapeAppend one{track.agent, {}, {shape}};
        absl::StrAppend(
            &text, absl::BytesToHexString(EncodeShapes(one, TrajectoryCodec::kLossless)), "\n");
      }
    }
    return text;
  }

  absl::StatusOr<std::string> AskMesh() {
    DSG_ASSIGN_OR_RETURN(const auto blocks, snapshot_.MeshBlocks());
    std::string text;
    for (const BlockIndex& index : blocks) {
      DSG_ASSIGN_OR_RETURN(const MeshBlock block, snapshot_.ReadMeshBlock(index));
      absl::StrAppend(&text, index.x, ",", index.y, ",", index.z, " ",
                      ToHex(ComputeSha256(EncodeMeshBlock(block))), "\n");
    }
    return text;
  }

  absl::StatusOr<std::string> AskAssets() {
    DSG_ASSIGN_OR_RETURN(const auto nodes, Scan({}));
    std::string text;
    for (const Node& node : nodes) {
      if (!node.object.has_value() || !node.object->model.has_value()) continue;
      DSG_ASSIGN_OR_RETURN(const Asset asset, snapshot_.ReadAsset(*node.object->model));
      absl::StrAppend(&text, ToHex(asset.sha256), " ", asset.media_type, " ", asset.content.size(),
                      "\n");
    }
    return text;
  }

  const Snapshot& snapshot_;
};

}  // namespace

std::vector<Answer> AskEverything(const Snapshot& snapshot) { return Asker(snapshot).Ask(); }

absl::StatusOr<std::string> Dump(const Snapshot& snapshot) {
  std::string text;
  for (const Answer& answer : AskEverything(snapshot)) {
    if (!answer.text.ok()) return Annotate(answer.text.status(), answer.question);
    absl::StrAppend(&text, answer.question, ":\n", *answer.text);
  }
  return text;
}

}  // namespace dsg::test
