// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/gltf_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>
#include <utility>

#include "query/cli/export/gltf_bodies.h"
#include "query/cli/export/outline.h"
#include "schema/picture/look.h"
#include "schema/picture/wire.h"

namespace dsg::cli {
namespace {

constexpr double kPlaceRadiusM = 0.06;
constexpr double kPointRadiusM = 0.12;
constexpr double kAgentRadiusM = 0.2;

using Indices = std::vector<uint32_t>;
using Points = std::vector<Eigen::Vector3f>;

// A ball of radius 1: an octahedron with each face split in four.
struct Ball {
  Ball() {
    const std::array<Eigen::Vector3f, 6> tips = {
        Eigen::Vector3f::UnitX(),  Eigen::Vector3f::UnitY(),  Eigen::Vector3f::UnitZ(),
        -Eigen::Vector3f::UnitX(), -Eigen::Vector3f::UnitY(), -Eigen::Vector3f::UnitZ()};
    for (size_t octant = 0; octant < 8; ++octant) {
      const Eigen::Vector3f& a = tips[octant & 1 ? 3 : 0];
      const Eigen::Vector3f& b = tips[octant & 2 ? 4 : 1];
      const Eigen::Vector3f& c = tips[octant & 4 ? 5 : 2];
      const Eigen::Vector3f ab = (a + b).normalized();
      const Eigen::Vector3f bc = (b + c).normalized();
      const Eigen::Vector3f ca = (c + a).normalized();
      for (const auto& face : {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c},
                               std::array{ab, bc, ca}}) {
        AddFace(face);
      }
    }
  }

  void AddFace(const std::array<Eigen::Vector3f, 3>& face) {
    const bool is_outward = (face[1] - face[0]).cross(face[2] - face[0]).dot(face[0]) > 0.0f;
    for (const size_t corner :
         {size_t{0}, is_outward ? size_t{1} : 2, is_outward ? size_t{2} : 1}) {
      indices.push_back(static_cast<uint32_t>(points.size()));
      points.push_back(face[corner]);
    }
  }

  Points points;
  Indices indices;
};

class SceneBuilder {
 public:
  SceneBuilder(const MapContent& content, MeshColor color, size_t vertex_count_max)
      : content_(content),
        color_(SettleColor(content.mesh, color)),
        vertex_count_max_(vertex_count_max) {}

  GltfDocument Build() {
    GltfNode top;
    top.name = content_.spec.name;
    // A quarter turn about x takes the map's z to the format's y.
    top.rotation = Eigen::Quaterniond(std::sqrt(0.5), -std::sqrt(0.5), 0.0, 0.0);
    top.extras = {{"revision", std::to_string(content_.revision)}, {"frame", content_.spec.frame}};
    const int root = document_.AddNode(std::move(top));
    document_.roots = {root};
    std::vector<int> groups;
    AddMesh(&groups);
    AddLayers(&groups);
    AddEdges(&groups);
    document_.nodes[static_cast<size_t>(root)].children = std::move(groups);
    return std::move(document_);
  }

 private:
  int Material(uint32_t rgb, bool is_unlit) {
    const auto [it, is_new] = materials_.try_emplace({rgb, is_unlit}, kNone);
    if (is_new) {
      it->second = document_.AddMaterial(
          {.name = is_unlit ? "lines" : "surface", .rgb = rgb, .is_unlit = is_unlit});
    }
    return it->second;
  }

  static void AddGroup(GltfDocument* document, const std::string& name, std::vector<int> children,
                       std::vector<int>* groups) {
    if (children.empty()) return;
    GltfNode group;
    group.name = name;
    group.children = std::move(children);
    groups->push_back(document->AddNode(std::move(group)));
  }

  // The mesh; blocks are joined up to the size of a primitive.
  void AddMesh(std::vector<int>* groups) {
    GltfMesh mesh{.name = "mesh", .primitives = {}};
    Points points;
    Points normals;
    std::vector<uint32_t> colors;
    Indices indices;
    const auto finish = [&] {
      if (indices.empty()) return;
      mesh.primitives.push_back({.positions = document_.AddPositions(points),
                                 .normals = document_.AddNormals(normals),
                                 .colors = document_.AddColors(colors),
                                 .indices = document_.AddIndices(indices),
                                 .material = Material(0xffffff, false),
                                 .mode = GltfMode::kTriangles});
      points.clear();
      normals.clear();
      colors.clear();
      indices.clear();
    };
    for (const MeshBlock& block : content_.mesh) {
      if (block.faces.empty()) continue;
      if (points.size() + block.positions_map.size() > vertex_count_max_) finish();
      const auto first = static_cast<uint32_t>(points.size());
      points.insert(points.end(), block.positions_map.begin(), block.positions_map.end());
      const Points own_normals = NormalsOf(block);
      normals.insert(normals.end(), own_normals.begin(), own_normals.end());
      for (size_t i = 0; i < block.positions_map.size(); ++i) {
        colors.push_back(VertexColor(block, i, color_));
      }
      for (const auto& face : block.faces) {
        for (const uint32_t vertex : face) indices.push_back(first + vertex);
      }
    }
    finish();
    if (mesh.primitives.empty()) return;
    GltfNode node;
    node.name = "mesh";
    node.mesh = document_.AddMesh(std::move(mesh));
    groups->push_back(document_.AddNode(std::move(node)));
  }

  int LineMesh(const std::string& name, const Points& points, const Indices& indices,
               uint32_t rgb) {
    const GltfPrimitive lines{.positions = document_.AddPositions(points),
                              .indices = document_.AddIndices(indices),
                              .material = Material(rgb, true),
                              .mode = GltfMode::kLines};
    return document_.AddMesh({.name = name, .primitives = {lines}});
  }

  // One ball per colour; all share their geometry.
  int BallMesh(uint32_t rgb) {
    const auto [it, is_new] = balls_.try_emplace(rgb, kNone);
    if (!is_new) return it->second;
    if (!ball_.has_value()) {
      const Ball ball;
      ball_ = GltfPrimitive{.positions = document_.AddPositions(ball.points),
                            .normals = document_.AddNormals(ball.points),
                            .indices = document_.AddIndices(ball.indices),
                            .mode = GltfMode::kTriangles};
    }
    GltfPrimitive colored = *ball_;
    colored.material = Material(rgb, false);
    it->second = document_.AddMesh({.name = "ball", .primitives = {colored}});
    return it->second;
  }

  // One cube of lines per colour, with edges of length 1 around the origin.
  int CubeMesh(uint32_t rgb) {
    const auto [it, is_new] = cubes_.try_emplace(rgb, kNone);
    if (!is_new) return it->second;
    if (!cube_.has_value()) {
      Node unit;
      unit.box_node = Box3d(Eigen::Vector3d::Constant(-0.5), Eigen::Vector3d::Constant(0.5));
      const auto [points, indices] = Flatten(WireOf(unit));
      cube_ = GltfPrimitive{.positions = document_.AddPositions(points),
                            .indices = document_.AddIndices(indices),
                            .mode = GltfMode::kLines};
    }
    GltfPrimitive colored = *cube_;
    colored.material = Material(rgb, true);
    it->second = document_.AddMesh({.name = "box", .primitives = {colored}});
    return it->second;
  }

  static std::pair<Points, Indices> Flatten(const Wire& wire) {
    std::pair<Points, Indices> flat;
    for (const Eigen::Vector3d& point : wire.points) flat.first.push_back(point.cast<float>());
    for (const auto& line : wire.lines) {
      flat.second.insert(flat.second.end(), line.begin(), line.end());
    }
    return flat;
  }

  void AddLayers(std::vector<int>* groups) {
    for (size_t i = 0; i < content_.tracks.size(); ++i) {
      track_of_.emplace(content_.tracks[i].agent, i);
    }
    for (const Layer& layer : content_.layers) {
      std::vector<int> children;
      for (const Node& node : content_.nodes) {
        if (node.layer == layer.id) children.push_back(AddNode(node, layer.name));
      }
      AddGroup(&document_, layer.name, std::move(children), groups);
    }
  }

  int AddNode(const Node& node, const std::string& layer_name) {
    GltfNode out;
    out.name = NameOf(node);
    out.extras = {{"id", ToString(node.id)}, {"kind", node.kind}, {"layer", layer_name}};
    if (!node.class_name.empty()) out.extras.emplace_back("class", node.class_name);
    if (IsAgentKind(node.kind)) {
      ShapeAgent(node, &out);
    } else {
      ShapeNode(node, &out);
    }
    return document_.AddNode(std::move(out));
  }

  void ShapeNode(const Node& node, GltfNode* out) {
    const bool is_object = node.kind == kinds::kObject;
    const uint32_t rgb = is_object ? ClassColor(node) : LayerColor(node.layer);
    if (node.kind == kinds::kPlace || (node.box_node.isEmpty() && !node.region.has_value())) {
      const double radius_m = node.kind == kinds::kPlace ? kPlaceRadiusM : kPointRadiusM;
      PutBall(node.map_T_node.position, radius_m, rgb, out);
    } else if (node.region.has_value() && node.region->footprint_map.size() >= 3) {
      const auto [points, indices] = Flatten(WireOf(node));
      out->mesh = LineMesh("prism", points, indices, rgb);
    } else if (!node.box_node.isEmpty()) {
      out->mesh = CubeMesh(rgb);
      out->translation = MiddleOf(node);
      out->rotation = node.map_T_node.orientation;
      // A scale of zero, as of a wall without thickness, has no inverse in viewers.
      out->scale = node.box_node.sizes().cwiseMax(1e-4);
    } else {
      PutBall(node.map_T_node.position, kPointRadiusM, rgb, out);
    }
  }

  void PutBall(const Eigen::Vector3d& point_map, double radius_m, uint32_t rgb, GltfNode* out) {
    out->mesh = BallMesh(rgb);
    out->translation = point_map;
    out->scale = Eigen::Vector3d::Constant(radius_m);
  }

  // The node of an agent has no shape; its children are its last position and its track.
  void ShapeAgent(const Node& node, GltfNode* out) {
    const auto it = track_of_.find(node.id);
    if (it == track_of_.end()) return;
    const Track& track = content_.tracks[it->second];
    const uint32_t rgb = AgentColor(it->second);
    GltfNode last;
    last.name = out->name + " last position";
    PutBall(LastOf(track), kAgentRadiusM, rgb, &last);
    out->children.push_back(document_.AddNode(std::move(last)));
    ShapeBodies(node, rgb, out);
    Points points;
    Indices indices;
    for (const auto& piece : track.pieces) {
      for (size_t i = 0; i < piece.size(); ++i) {
        const auto index = static_cast<uint32_t>(points.size());
        points.push_back(piece[i].cast<float>());
        if (i > 0) indices.insert(indices.end(), {index - 1, index});
      }
    }
    if (indices.empty()) return;
    GltfNode path;
    path.name = out->name + " track";
    path.mesh = LineMesh("track", points, indices, rgb);
    out->children.push_back(document_.AddNode(std::move(path)));
  }

  void ShapeBodies(const Node& node, uint32_t rgb, GltfNode* out) {
    const auto found =
        std::find_if(content_.bodies.begin(), content_.bodies.end(),
                     [&node](const AgentBodies& bodies) { return bodies.agent == node.id; });
    if (found == content_.bodies.end()) return;
    const std::vector<int> nodes =
        AddBodies(*found, out->name, FirstBodyNs(content_.bodies), content_.spec.gap_ns_max,
                  Material(rgb, false), &document_);
    out->children.insert(out->children.end(), nodes.begin(), nodes.end());
  }

  void AddEdges(std::vector<int>* groups) {
    const std::unordered_map<NodeId, const Node*> nodes = NodesById(content_);
    const auto point_of = [&](NodeId id) -> Eigen::Vector3f {
      const auto track = track_of_.find(id);
      if (track != track_of_.end()) return LastOf(content_.tracks[track->second]).cast<float>();
      return MiddleOf(*nodes.at(id)).cast<float>();
    };
    std::map<std::string, Points> ends_of;
    for (const Edge& edge : content_.edges) {
      Points& ends = ends_of[edge.relation];
      ends.push_back(point_of(edge.source));
      ends.push_back(point_of(edge.target));
    }
    std::vector<int> children;
    for (const auto& [relation, ends] : ends_of) {
      Indices indices(ends.size());
      for (uint32_t i = 0; i < indices.size(); ++i) indices[i] = i;
      GltfNode node;
      node.name = relation;
      node.mesh = LineMesh(relation, ends, indices, RelationColor(relation));
      children.push_back(document_.AddNode(std::move(node)));
    }
    AddGroup(&document_, "edges", std::move(children), groups);
  }

  const MapContent& content_;
  const MeshColor color_;
  const size_t vertex_count_max_;
  GltfDocument document_;
  std::map<std::pair<uint32_t, bool>, int> materials_;
  std::optional<GltfPrimitive> ball_;
  std::optional<GltfPrimitive> cube_;
  std::map<uint32_t, int> balls_;
  std::map<uint32_t, int> cubes_;
  /// Index into content_.tracks.
  std::unordered_map<NodeId, size_t> track_of_;
};

}  // namespace

GltfDocument MakeGltf(const MapContent& content, MeshColor color,
                      size_t primitive_vertex_count_max) {
  return SceneBuilder(content, color, primitive_vertex_count_max).Build();
}

}  // namespace dsg::cli
