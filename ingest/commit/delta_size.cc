// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/delta_size.h"

#include <algorithm>
#include <utility>

#include "schema/codec/proto_convert.h"

namespace dsg::ingest {
namespace {

// Field tags, lengths, ids and stamps of one row.
constexpr size_t kRowBytes = 64;
constexpr size_t kPoseBytes = 96;
constexpr size_t kCovarianceBytes = 88;
constexpr size_t kFactorBytes = 256;
// Position, normal, colour, label, instance and two stamps of a vertex; indices of a face.
constexpr size_t kVertexBytes = 64;
constexpr size_t kFaceBytes = 15;

size_t BytesOf(const std::vector<TimedPose>& poses) {
  size_t bytes = poses.size() * kPoseBytes;
  for (const TimedPose& pose : poses) bytes += pose.covariance != nullptr ? kCovarianceBytes : 0;
  return bytes;
}

size_t BytesOf(const BodyShape& shape) {
  return kRowBytes +
         sizeof(float) * (shape.pose_coefficients.size() + shape.shape_coefficients.size() +
                          shape.joints.size() + shape.vertices.size());
}

size_t BytesOf(const Edge& edge) {
  return kRowBytes + edge.relation.size() + EncodeEdgePayload(edge).size();
}

size_t BytesOf(const MeshBlock& block) {
  return block.positions_map.size() * kVertexBytes + block.faces.size() * kFaceBytes;
}

void Append(std::vector<GraphDelta> parts, std::vector<GraphDelta>* all) {
  std::move(parts.begin(), parts.end(), std::back_inserter(*all));
}

size_t RowCount(const GraphDelta& delta) {
  size_t count = delta.layers.size() + delta.labels.size() + delta.nodes.size() +
                 delta.retirements.size() + delta.edges.size() + delta.edge_removals.size() +
                 delta.corrections.size() + delta.factors.size() + delta.shapes.size() +
                 delta.stays.size() + delta.mesh_blocks.size() + delta.mesh_removals.size() +
                 delta.assets.size();
  for (const TrajectoryAppend& append : delta.appends) count += append.poses.size();
  return count;
}

std::vector<GraphDelta> PackMesh(std::vector<MeshBlock> blocks) {
  std::vector<GraphDelta> parts;
  size_t bytes = 0;
  for (MeshBlock& block : blocks) {
    const size_t more = BytesOf(block);
    if (parts.empty() || bytes + more > kDeltaBytesMax) {
      parts.emplace_back();
      bytes = 0;
    }
    bytes += more;
    parts.back().mesh_blocks.push_back(std::move(block));
  }
  return parts;
}

std::vector<GraphDelta> SplitToBytes(GraphDelta delta, size_t row_count_max) {
  if (EstimateBytes(delta) <= kDeltaBytesMax || row_count_max <= 1) {
    std::vector<GraphDelta> whole;
    whole.push_back(std::move(delta));
    return whole;
  }
  std::vector<GraphDelta> all;
  for (GraphDelta& part : SplitDelta(std::move(delta), row_count_max / 2)) {
    Append(SplitToBytes(std::move(part), row_count_max / 2), &all);
  }
  return all;
}

// So many poses with covariance are about 1 MiB as a message.
constexpr size_t kPosesPerPiece = 5000;

// Pieces that follow each other without a gap.
void AddPieces(TrajectoryCorrection whole, std::vector<TrajectoryCorrection>* pieces) {
  const std::vector<TimedPose>& poses = whole.poses;
  for (size_t begin = 0; begin < poses.size(); begin += kPosesPerPiece) {
    const size_t end = std::min(poses.size(), begin + kPosesPerPiece);
    TrajectoryCorrection& piece = pieces->emplace_back();
    piece.agent = whole.agent;
    piece.from_ns = begin == 0 ? whole.from_ns : poses[begin].time_ns;
    piece.to_ns = end == poses.size() ? whole.to_ns : poses[end].time_ns;
    piece.poses.assign(poses.begin() + static_cast<std::ptrdiff_t>(begin),
                       poses.begin() + static_cast<std::ptrdiff_t>(end));
  }
}

}  // namespace

size_t EstimateBytes(const GraphDelta& delta) {
  size_t bytes =
      kRowBytes * (delta.layers.size() + delta.labels.size() + delta.retirements.size() +
                   delta.edge_removals.size() + delta.stays.size() + delta.mesh_removals.size());
  for (const Node& node : delta.nodes) bytes += kRowBytes + EncodeNodePayload(node).size();
  for (const Edge& edge : delta.edges) bytes += BytesOf(edge);
  for (const TrajectoryAppend& append : delta.appends) bytes += kRowBytes + BytesOf(append.poses);
  for (const TrajectoryCorrection& item : delta.corrections) bytes += BytesOf(item.poses);
  for (const FactorAppend& item : delta.factors) bytes += item.factors.size() * kFactorBytes;
  for (const ShapeAppend& item : delta.shapes) {
    for (const BodyShape& shape : item.shapes) bytes += BytesOf(shape);
  }
  for (const MeshBlock& block : delta.mesh_blocks) bytes += BytesOf(block);
  for (const Asset& asset : delta.assets) bytes += kRowBytes + asset.content.size();
  return bytes;
}

std::vector<GraphDelta> SplitToSize(GraphDelta delta) {
  std::vector<GraphDelta> all;
  if (RowCount(delta) <= kDeltaRowsMax && EstimateBytes(delta) <= kDeltaBytesMax) {
    all.push_back(std::move(delta));
    return all;
  }
  std::vector<MeshBlock> mesh = std::exchange(delta.mesh_blocks, {});
  for (GraphDelta& part : SplitDelta(std::move(delta), kDeltaRowsMax)) {
    Append(SplitToBytes(std::move(part), kDeltaRowsMax), &all);
  }
  // Vertices are no rows: what counts of a mesh is its bytes.
  Append(PackMesh(std::move(mesh)), &all);
  return all;
}

std::vector<GraphDelta> CutCorrection(GraphDelta delta) {
  std::vector<GraphDelta> parts;
  if (EstimateBytes(delta) <= kDeltaBytesMax) {
    parts.push_back(std::move(delta));
    return parts;
  }
  GraphDelta rest;
  for (TrajectoryCorrection& track : delta.corrections) {
    AddPieces(std::move(track), &rest.corrections);
  }
  delta.corrections.clear();
  rest.mesh_blocks = std::exchange(delta.mesh_blocks, {});
  parts.push_back(std::move(delta));
  for (GraphDelta& part : SplitToSize(std::move(rest))) parts.push_back(std::move(part));
  return parts;
}

}  // namespace dsg::ingest
