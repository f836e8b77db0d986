// SPDX-License-Identifier: Apache-2.0
// The only place that sees both the model and the protobuf messages of dsg.v1.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"
#include "schema/model/revision.h"

namespace dsg::v1 {
class BodyShape;
class Box;
class Edge;
class GraphDelta;
class MapSpec;
class MeshBlock;
class Node;
class Pose;
class PoseFactor;
class Revision;
class TimedPose;
class Vector3;
}  // namespace dsg::v1

namespace dsg {

/// Layers by name and id, as a map knows them; needed because the wire names layers.
class LayerTable {
 public:
  LayerTable() : LayerTable(DefaultLayers()) {}
  explicit LayerTable(std::vector<Layer> known) : layers_(std::move(known)) {}
  const Layer* Find(LayerId id) const;
  const Layer* Find(std::string_view name) const;
  void Add(const Layer& layer) { layers_.push_back(layer); }

 private:
  std::vector<Layer> layers_;
};

void ToProto(const Eigen::Vector3d& v, v1::Vector3* out);
void ToProto(const Pose3d& pose, v1::Pose* out);
Pose3d FromProto(const v1::Pose& in);
void ToProto(const Box3d& box, v1::Box* out);
/// Errors: INVALID_ARGUMENT/BOX_INVERTED or NUMBER_NOT_FINITE, naming `field`.
absl::StatusOr<Box3d> BoxFromProto(const v1::Box& in, std::string_view field);

void ToProto(const TimedPose& pose, v1::TimedPose* out);
absl::StatusOr<TimedPose> FromProto(const v1::TimedPose& in);

void ToProto(const PoseFactor& factor, v1::PoseFactor* out);
absl::StatusOr<PoseFactor> FromProto(const v1::PoseFactor& in);

void ToProto(const BodyShape& shape, v1::BodyShape* out);
BodyShape FromProto(const v1::BodyShape& in);

void ToProto(const Node& node, const LayerTable& layers, v1::Node* out);
absl::StatusOr<Node> FromProto(const v1::Node& in, const LayerTable& layers);
void ToProto(const Edge& edge, v1::Edge* out);
absl::StatusOr<Edge> FromProto(const v1::Edge& in);
void ToProto(const MeshBlock& block, v1::MeshBlock* out);
absl::StatusOr<MeshBlock> FromProto(const v1::MeshBlock& in);
void ToProto(const MapSpec& spec, v1::MapSpec* out);
/// Unset fields take the defaults of MapSpec.
absl::StatusOr<MapSpec> FromProto(const v1::MapSpec& in);
void ToProto(const RevisionInfo& revision, v1::Revision* out);

void ToProto(const GraphDelta& delta, const LayerTable& layers, v1::GraphDelta* out);
/// How nodes and edges are meant that have no update mask.
enum class Unmasked {
  /// As they stand, whole.
  kWhole,
  /// Only what is set in them.
  kPatch,
};
/// `layers`: the map's; layers that the delta itself adds are known too.
absl::StatusOr<GraphDelta> FromProto(const v1::GraphDelta& in, const LayerTable& layers,
                                     Unmasked unmasked = Unmasked::kWhole);

/// A delta as protobuf JSON with proto field names: how the simulator writes its world.
std::string DeltaToJson(const GraphDelta& delta);
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED.
absl::StatusOr<GraphDelta> DeltaFromJson(std::string_view json);

/// Bytes kept in the store; id, layer and revision stand in columns and are left out.
std::string EncodeNodePayload(const Node& node);
/// False if the bytes are not an encoded node.
bool DecodeNodePayload(std::string_view bytes, Node* node);
/// Validity and attributes of an edge; empty for the default ones.
std::string EncodeEdgePayload(const Edge& edge);
bool DecodeEdgePayload(std::string_view bytes, Edge* edge);
/// Compressed.
std::string EncodeMeshBlock(const MeshBlock& block);
bool DecodeMeshBlock(std::string_view bytes, MeshBlock* block);
std::string EncodeFactors(const std::vector<PoseFactor>& factors);
bool DecodeFactors(std::string_view bytes, std::vector<PoseFactor>* factors);

}  // namespace dsg
