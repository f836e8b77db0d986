// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/mesh_file.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/cli/export/outline.h"
#include "query/cli/table.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/picture/look.h"
#include "schema/picture/wire.h"

namespace dsg::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

constexpr size_t kFlushBytes = size_t{1} << 20;

// Appends values as they are in memory, and writes them in large pieces.
class PlyWriter {
 public:
  explicit PlyWriter(AtomicFile* file) : file_(file) {}

  template <class T>
  void Add(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    buffer_.append(bytes, sizeof(T));
  }
  void AddText(std::string_view text) { buffer_.append(text); }
  void AddPoint(const Eigen::Vector3f& point) {
    for (int i = 0; i < 3; ++i) Add(point[i]);
  }
  void AddColor(uint32_t rgb) {
    for (const int shift : {16, 8, 0}) Add(static_cast<uint8_t>(rgb >> shift));
  }
  absl::Status Flush(size_t bytes_min) {
    if (buffer_.size() < bytes_min) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(file_->Write(buffer_));
    buffer_.clear();
    return absl::OkStatus();
  }

 private:
  AtomicFile* file_;
  std::string buffer_;
};

absl::Status CheckCount(size_t count, const AtomicFile& file) {
  if (count <= static_cast<size_t>(std::numeric_limits<int32_t>::max())) return absl::OkStatus();
  return MakeError(Reason::kLimitExceeded,
                   absl::StrCat(file.path(), " would have ", count,
                                " vertices, more than PLY readers can count"),
                   {{"path", file.path()}});
}

// The beginning of both files. Control characters in names would end a line of the header.
std::string Heading(const MapContent& content) {
  return absl::StrCat("ply\nformat binary_little_endian 1.0\ncomment map ", content.spec.name,
                      " at revision ", content.revision, "\ncomment frame ",
                      Printable(content.spec.frame), ", z up, metres\n");
}

void AppendClasses(const MapContent& content, std::string* header) {
  std::map<int32_t, std::string> names;
  for (const Node& node : content.nodes) {
    if (node.class_id >= 0) names.emplace(node.class_id, node.class_name);
  }
  for (const auto& [id, name] : names) {
    absl::StrAppend(header, "comment label ", id, " ", Printable(name), "\n");
  }
}

std::string MeshHeader(const MapContent& content, const MeshCounts& counts) {
  std::string header = Heading(content);
  AppendClasses(content, &header);
  absl::StrAppend(&header, "element vertex ", counts.vertices, "\n");
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) {
    absl::StrAppend(&header, "property float ", name, "\n");
  }
  for (const char* name : {"red", "green", "blue"}) {
    absl::StrAppend(&header, "property uchar ", name, "\n");
  }
  absl::StrAppend(&header, "property uint label\nproperty uint instance\nelement face ",
                  counts.faces, "\nproperty list uchar int vertex_indices\nend_header\n");
  return header;
}

absl::Status WriteVertices(const std::vector<MeshBlock>& mesh, MeshColor color, PlyWriter* writer) {
  for (const MeshBlock& block : mesh) {
    const std::vector<Eigen::Vector3f> normals = NormalsOf(block);
    for (size_t i = 0; i < block.positions_map.size(); ++i) {
      writer->AddPoint(block.positions_map[i]);
      writer->AddPoint(normals[i]);
      writer->AddColor(VertexColor(block, i, color));
      writer->Add(block.labels.empty() ? uint32_t{0} : block.labels[i]);
      writer->Add(block.instance_ids.empty() ? uint32_t{0} : block.instance_ids[i]);
      DSG_RETURN_IF_ERROR(writer->Flush(kFlushBytes));
    }
  }
  return absl::OkStatus();
}

// `first`: vertices that are before those of the mesh.
absl::Status WriteFaces(const std::vector<MeshBlock>& mesh, uint32_t first, PlyWriter* writer) {
  for (const MeshBlock& block : mesh) {
    for (const auto& face : block.faces) {
      writer->Add(uint8_t{3});
      for (const uint32_t vertex : face) writer->Add(static_cast<int32_t>(first + vertex));
      DSG_RETURN_IF_ERROR(writer->Flush(kFlushBytes));
    }
    first += static_cast<uint32_t>(block.positions_map.size());
  }
  return absl::OkStatus();
}

struct GraphVertex {
  Eigen::Vector3f point_map;
  uint32_t rgb = 0;
  LayerId layer = 0;
};

struct GraphLine {
  size_t from = 0;
  size_t to = 0;
  uint32_t rgb = 0;
};

// Points and lines of the graph: first the nodes in their order, then their boxes and tracks.
class GraphLines {
 public:
  explicit GraphLines(const MapContent& content) {
    AddNodes(content);
    AddEdges(content);
    for (const Node& node : content.nodes) AddWire(node);
    AddTracks(content);
  }

  const std::vector<GraphVertex>& vertices() const { return vertices_; }
  const std::vector<GraphLine>& lines() const { return lines_; }

 private:
  size_t AddVertex(const Eigen::Vector3d& point_map, uint32_t rgb, LayerId layer) {
    vertices_.push_back({point_map.cast<float>(), rgb, layer});
    return vertices_.size() - 1;
  }

  static uint32_t ColorOf(const Node& node) {
    return node.kind == kinds::kObject ? ClassColor(node) : LayerColor(node.layer);
  }

  void AddNodes(const MapContent& content) {
    std::unordered_map<NodeId, const Track*> tracks;
    for (const Track& track : content.tracks) tracks.emplace(track.agent, &track);
    for (const Node& node : content.nodes) {
      const auto track = tracks.find(node.id);
      // An agent is at its last position.
      const Eigen::Vector3d point_map =
          track == tracks.end() ? MiddleOf(node) : LastOf(*track->second);
      vertex_of_.emplace(node.id, AddVertex(point_map, ColorOf(node), node.layer));
    }
  }

  void AddEdges(const MapContent& content) {
    for (const Edge& edge : content.edges) {
      lines_.push_back(
          {vertex_of_.at(edge.source), vertex_of_.at(edge.target), RelationColor(edge.relation)});
    }
  }

  void AddWire(const Node& node) {
    // Boxes of places fill the free space and would hide everything.
    if (node.kind == kinds::kPlace) return;
    const Wire wire = WireOf(node);
    const size_t first = vertices_.size();
    for (const Eigen::Vector3d& point : wire.points) AddVertex(point, ColorOf(node), node.layer);
    for (const auto& line : wire.lines) {
      lines_.push_back({first + line[0], first + line[1], ColorOf(node)});
    }
  }

  void AddTracks(const MapContent& content) {
    for (size_t i = 0; i < content.tracks.size(); ++i) {
      for (const auto& piece : content.tracks[i].pieces) {
        for (size_t k = 0; k < piece.size(); ++k) {
          const size_t vertex = AddVertex(piece[k], AgentColor(i), layers::kAgents);
          if (k > 0) lines_.push_back({vertex - 1, vertex, AgentColor(i)});
        }
      }
    }
  }

  std::vector<GraphVertex> vertices_;
  std::vector<GraphLine> lines_;
  std::unordered_map<NodeId, size_t> vertex_of_;
};

std::string GraphHeader(const MapContent& content, const GraphPlyCounts& counts) {
  std::string header = Heading(content);
  for (const Layer& layer : content.layers) {
    absl::StrAppend(&header, "comment layer ", layer.id, " ", Printable(layer.name), "\n");
  }
  constexpr char kColors[] = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  absl::StrAppend(&header, "element vertex ", counts.vertices,
                  "\nproperty float x\nproperty float y\nproperty float z\n", kColors,
                  "property int layer\nelement edge ", counts.edges,
                  "\nproperty int vertex1\nproperty int vertex2\n", kColors, "end_header\n");
  return header;
}

// A body has a few thousand vertices, so its file is made in memory.
template <class T>
void AppendBytes(const T& value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

}  // namespace

absl::Status WriteMeshPly(const MapContent& content, MeshColor color, AtomicFile* file) {
  std::vector<MeshBlock> bodies;
  for (const AgentBodies& agent : content.bodies) {
    for (const Body& body : agent.bodies) bodies.push_back(MeshOf(body, agent.rgb));
  }
  const MeshCounts counts = CountMesh(content.mesh);
  const MeshCounts of_bodies = CountMesh(bodies);
  const MeshCounts all{counts.vertices + of_bodies.vertices, counts.faces + of_bodies.faces};
  DSG_RETURN_IF_ERROR(CheckCount(all.vertices, *file));
  PlyWriter writer(file);
  writer.AddText(MeshHeader(content, all));
  DSG_RETURN_IF_ERROR(WriteVertices(content.mesh, SettleColor(content.mesh, color), &writer));
  DSG_RETURN_IF_ERROR(WriteVertices(bodies, MeshColor::kRgb, &writer));
  DSG_RETURN_IF_ERROR(WriteFaces(content.mesh, 0, &writer));
  DSG_RETURN_IF_ERROR(WriteFaces(bodies, static_cast<uint32_t>(counts.vertices), &writer));
  return writer.Flush(0);
}

absl::StatusOr<GraphPlyCounts> WriteGraphPly(const MapContent& content, AtomicFile* file) {
  const GraphLines graph(content);
  const GraphPlyCounts counts{graph.vertices().size(), graph.lines().size()};
  DSG_RETURN_IF_ERROR(CheckCount(counts.vertices, *file));
  PlyWriter writer(file);
  writer.AddText(GraphHeader(content, counts));
  for (const GraphVertex& vertex : graph.vertices()) {
    writer.AddPoint(vertex.point_map);
    writer.AddColor(vertex.rgb);
    writer.Add(vertex.layer);
    DSG_RETURN_IF_ERROR(writer.Flush(kFlushBytes));
  }
  for (const GraphLine& line : graph.lines()) {
    writer.Add(static_cast<int32_t>(line.from));
    writer.Add(static_cast<int32_t>(line.to));
    writer.AddColor(line.rgb);
    DSG_RETURN_IF_ERROR(writer.Flush(kFlushBytes));
  }
  DSG_RETURN_IF_ERROR(writer.Flush(0));
  return counts;
}

absl::Status WriteBodyPly(const Body& body, const std::string& comment, AtomicFile* file) {
  std::string bytes =
      absl::StrCat("ply\nformat binary_little_endian 1.0\ncomment ", Printable(comment),
                   "\nelement vertex ", body.points_map.size(),
                   "\nproperty float x\nproperty float y\nproperty float z\nelement face ",
                   body.face_count(), "\nproperty list uchar int vertex_indices\nend_header\n");
  for (const Eigen::Vector3f& point : body.points_map) {
    for (int axis = 0; axis < 3; ++axis) AppendBytes(point[axis], &bytes);
  }
  for (size_t i = 0; i < body.face_count(); ++i) {
    AppendBytes(uint8_t{3}, &bytes);
    for (const uint32_t vertex : (*body.faces)[i]) AppendBytes(vertex, &bytes);
  }
  return file->Write(bytes);
}

absl::Status WriteBodyObj(const Body& body, const std::string& comment, AtomicFile* file) {
  std::string text = absl::StrCat("# ", Printable(comment), "\n");
  for (const Eigen::Vector3f& point : body.points_map) {
    absl::StrAppend(&text, "v ", Fixed(static_cast<double>(point.x()), 4), " ",
                    Fixed(static_cast<double>(point.y()), 4), " ",
                    Fixed(static_cast<double>(point.z()), 4), "\n");
  }
  // The format counts from 1.
  for (size_t i = 0; i < body.face_count(); ++i) {
    const auto& face = (*body.faces)[i];
    absl::StrAppend(&text, "f ", face[0] + 1, " ", face[1] + 1, " ", face[2] + 1, "\n");
  }
  return file->Write(text);
}

}  // namespace dsg::cli
