// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/store/everything.h"

#include <map>
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

class Lister {
 public:
  explicit Lister(const Snapshot& snapshot) : snapshot_(snapshot) {}

  std::vector<Line> Run() {
    OrDie(snapshot_.ScanNodes({}, NodeId(), {}, [&](const Node& node) {
      lines_.push_back({{node.id},
                        kTimeMin,
                        absl::StrCat("node ", ToString(node.id), " ", node.layer, " ",
                                     node.revision, " ", Hex(EncodeNodePayload(node)))});
      if (IsAgentKind(node.kind)) agents_.push_back(node.id);
      return true;
    }));
    OrDie(snapshot_.ScanEdges({}, std::nullopt, {}, [&](const Edge& edge) {
      lines_.push_back({{edge.source, edge.target},
                        kTimeMin,
                        absl::StrCat("edge ", ToString(edge.source), " ", edge.relation, " ",
                                     ToString(edge.target), " ", edge.weight, " ",
                                     Hex(EncodeEdgePayload(edge)))});
      return true;
    }));
    for (const NodeId agent : agents_) AddAgent(agent);
    for (const auto& [index, revision] : OrDie(snapshot_.MeshBlockVersions({}))) {
      lines_.push_back(
          {{},
           kTimeMin,
           absl::StrCat("mesh ", index.x, ",", index.y, ",", index.z, " ", revision, " ",
                        Hex(EncodeMeshBlock(OrDie(snapshot_.ReadMeshBlock(index)))))});
    }
    return std::move(lines_);
  }

 private:
  static std::string Hex(const std::string& bytes) { return absl::BytesToHexString(bytes); }

  void AddAgent(NodeId agent) {
    const std::string name = ToString(agent);
    OrDie(snapshot_.ReadPoses(agent, kTimeMin, kTimeMax, {}, [&](const TimedPose& pose) {
      const Pose3d& at = pose.map_T_agent;
      lines_.push_back({{agent},
                        pose.time_ns,
                        absl::StrCat("pose ", name, " ", pose.time_ns, " ", at.position.x(), " ",
                                     at.position.y(), " ", at.position.z(), " ", at.orientation.w(),
                                     " ", pose.flags)});
      return true;
    }));
    for (const Stay& stay : OrDie(snapshot_.StaysOfAgent(agent, kTimeMin, kTimeMax))) {
      lines_.push_back({{agent, stay.room, stay.place},
                        stay.enter_ns,
                        absl::StrCat("stay ", name, " ", stay.enter_ns, " ", stay.exit_ns, " ",
                                     ToString(stay.place), " ", ToString(stay.room))});
    }
    for (const BodyShape& shape : OrDie(snapshot_.Shapes(agent, kTimeMin, kTimeMax))) {
      const ShapeAppend one{agent, std::nullopt, {shape}};
      lines_.push_back(
          {{agent},
           shape.time_ns,
           absl::StrCat("shape ", name, " ", Hex(EncodeShapes(one, TrajectoryCodec::kLossless)))});
    }
    for (const PoseFactor& factor : OrDie(snapshot_.Factors(agent, kTimeMin, kTimeMax))) {
      lines_.push_back({{agent},
                        factor.from_ns,
                        absl::StrCat("factor ", name, " ", Hex(EncodeFactors({factor})))});
    }
  }

  const Snapshot& snapshot_;
  std::vector<NodeId> agents_;
  std::vector<Line> lines_;
};

}  // namespace

std::vector<Line> LinesOf(const Snapshot& snapshot) { return Lister(snapshot).Run(); }

std::string WrongCounts(const Snapshot& snapshot) {
  std::map<std::string, int64_t> counts;
  std::set<TimeNs> pose_times;
  for (const Line& line : LinesOf(snapshot)) {
    const std::string kind = line.text.substr(0, line.text.find(' '));
    ++counts[kind];
    if (kind == "pose") pose_times.insert(line.time_ns);
  }
  const MapStats stats = OrDie(snapshot.Stats());
  std::string wrong;
  const auto compare = [&](const std::string& what, int64_t said, int64_t found) {
    if (said != found) absl::StrAppend(&wrong, what, ": said ", said, ", found ", found, "\n");
  };
  compare("nodes", stats.at.node_count, counts["node"]);
  compare("edges", stats.at.edge_count, counts["edge"]);
  compare("poses", stats.at.pose_count, counts["pose"]);
  compare("stays", stats.at.stay_count, counts["stay"]);
  compare("mesh blocks", stats.at.mesh_block_count, counts["mesh"]);
  int64_t layer_sum = 0;
  for (const LayerCount& layer : stats.layers) layer_sum += layer.node_count;
  compare("nodes of layers", layer_sum, counts["node"]);
  compare("first pose", stats.first_pose_ns.value_or(-1),
          pose_times.empty() ? -1 : *pose_times.begin());
  compare("last pose", stats.last_pose_ns.value_or(-1),
          pose_times.empty() ? -1 : *pose_times.rbegin());
  return wrong;
}

}  // namespace dsg::test
