// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/gltf_bodies.h"

#include <algorithm>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/check.h"

namespace dsg::cli {
namespace {

using Vertices = std::vector<Eigen::Vector3f>;

// A scale of zero has no inverse in viewers.
constexpr float kHidden = 1e-4f;
// How long a body is shown that no other one follows.
constexpr TimeNs kAloneNs = kNsPerSecond / 4;

Vertices AroundAgent(const Body& body) {
  const Eigen::Vector3f at = body.map_T_agent.position.cast<float>();
  Vertices points;
  points.reserve(body.points_map.size());
  for (const Eigen::Vector3f& point : body.points_map) points.push_back(point - at);
  return points;
}

bool IsJoined(const Body& before, const Body& after, TimeNs gap_ns) {
  return before.faces == after.faces && before.points_map.size() == after.points_map.size() &&
         after.time_ns - before.time_ns <= gap_ns;
}

// Poses of one node. The last of a full one is the first of the next, so that the way goes on.
std::vector<std::span<const Body>> Pieces(const std::vector<Body>& bodies, TimeNs gap_ns) {
  std::vector<std::span<const Body>> pieces;
  size_t first = 0;
  for (size_t i = 1; i <= bodies.size(); ++i) {
    const bool is_cut = i == bodies.size() || !IsJoined(bodies[i - 1], bodies[i], gap_ns);
    const bool is_full = i - first == kPosesPerNode;
    if (!is_cut && !is_full) continue;
    pieces.push_back(std::span(bodies).subspan(first, i - first));
    first = is_cut ? i : i - 1;
  }
  return pieces;
}

class PieceBuilder {
 public:
  PieceBuilder(std::span<const Body> poses, TimeNs begin_ns, GltfDocument* document)
      : poses_(poses), begin_ns_(begin_ns), document_(*document) {}

  GltfMesh Mesh(const std::string& name, int material) const {
    const Vertices base = AroundAgent(poses_.front());
    std::vector<uint32_t> indices;
    for (const auto& face : *poses_.front().faces) {
      indices.insert(indices.end(), face.begin(), face.end());
    }
    GltfPrimitive skin{.positions = document_.AddPositions(base),
                       .indices = document_.AddIndices(indices),
                       .material = material,
                       .targets = {},
                       .mode = GltfMode::kTriangles};
    for (const Body& pose : poses_.subspan(1)) {
      Vertices moved = AroundAgent(pose);
      for (size_t i = 0; i < moved.size(); ++i) moved[i] -= base[i];
      skin.targets.push_back(document_.AddPositions(moved));
    }
    return {.name = name, .primitives = {std::move(skin)}};
  }

  void Animate(int node) const {
    AnimateSize(node);
    if (poses_.size() == 1) return;
    std::vector<float> times_s;
    Vertices places;
    std::vector<float> weights;
    for (size_t i = 0; i < poses_.size(); ++i) {
      times_s.push_back(Seconds(poses_[i].time_ns));
      places.push_back(poses_[i].map_T_agent.position.cast<float>());
      // All weights are 0 for the first pose, which is the mesh itself.
      for (size_t target = 1; target < poses_.size(); ++target) {
        weights.push_back(target == i ? 1.0f : 0.0f);
      }
    }
    const int times = document_.AddTimes(times_s);
    document_.channels.push_back(
        {node, GltfPath::kTranslation, times, document_.AddVectors(places), /*is_step=*/false});
    document_.channels.push_back(
        {node, GltfPath::kWeights, times, document_.AddScalars(weights), /*is_step=*/false});
  }

 private:
  float Seconds(TimeNs time_ns) const {
    return static_cast<float>(static_cast<double>(time_ns - begin_ns_) /
                              static_cast<double>(kNsPerSecond));
  }

  void AnimateSize(int node) const {
    const TimeNs last_ns = poses_.back().time_ns + (poses_.size() == 1 ? kAloneNs : 0);
    std::vector<float> times_s = {Seconds(poses_.front().time_ns), Seconds(last_ns)};
    Vertices sizes = {Eigen::Vector3f::Ones(), Eigen::Vector3f::Constant(kHidden)};
    if (times_s.front() > 0.0f) {
      times_s.insert(times_s.begin(), 0.0f);
      sizes.insert(sizes.begin(), Eigen::Vector3f::Constant(kHidden));
    }
    const int times = document_.AddTimes(times_s);
    document_.channels.push_back(
        {node, GltfPath::kScale, times, document_.AddVectors(sizes), /*is_step=*/true});
  }

  std::span<const Body> poses_;
  TimeNs begin_ns_;
  GltfDocument& document_;
};

}  // namespace

TimeNs FirstBodyNs(const std::vector<AgentBodies>& bodies) {
  TimeNs first_ns = kTimeMax;
  for (const AgentBodies& agent : bodies) {
    first_ns = std::min(first_ns, agent.bodies.front().time_ns);
  }
  return first_ns;
}

std::vector<int> AddBodies(const AgentBodies& agent, const std::string& name, TimeNs begin_ns,
                           TimeNs gap_ns, int material, GltfDocument* document) {
  DSG_CHECK(!agent.bodies.empty());
  const bool is_walking = agent.bodies.size() > 1;
  std::vector<int> nodes;
  for (const std::span<const Body> poses : Pieces(agent.bodies, gap_ns)) {
    const PieceBuilder builder(poses, begin_ns, document);
    GltfNode node;
    node.name = is_walking ? absl::StrCat(name, " body ", nodes.size() + 1) : name + " body";
    node.mesh = document->AddMesh(builder.Mesh(node.name, material));
    node.translation = poses.front().map_T_agent.position;
    if (!nodes.empty()) {
      node.scale = Eigen::Vector3d::Constant(static_cast<double>(kHidden));
    }
    nodes.push_back(document->AddNode(std::move(node)));
    if (is_walking) builder.Animate(nodes.back());
  }
  return nodes;
}

}  // namespace dsg::cli
