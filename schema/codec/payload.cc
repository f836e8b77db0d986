// SPDX-License-Identifier: Apache-2.0
// What the store keeps as bytes: protobuf messages without what stands in columns, blocks
// compressed.
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <cstring>
#include <type_traits>

#include "dsg/v1/graph.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_internal.h"
#include "schema/codec/shuffle.h"

namespace dsg {
namespace {

// A block of four million vertices with all channels stays below this.
constexpr size_t kUnpackedBytesMax = size_t{512} << 20;

template <typename Message>
bool Unpack(std::string_view bytes, Message* message) {
  std::string plain;
  return Decompress(bytes, kUnpackedBytesMax, &plain) && message->ParseFromString(plain);
}

// Numbers in threes, one after the other, in one copy: a mesh has millions of them.
template <typename Triple, typename Number>
void CopyTriples(const std::vector<Triple>& from, google::protobuf::RepeatedField<Number>* to) {
  static_assert(sizeof(Triple) == 3 * sizeof(Number) && std::is_trivially_copyable_v<Number>);
  if (from.empty()) return;
  to->Resize(static_cast<int>(3 * from.size()), Number());
  std::memcpy(to->mutable_data(), from.data(), from.size() * sizeof(Triple));
}

template <typename Triple, typename Number>
void CopyTriples(const google::protobuf::RepeatedField<Number>& from, std::vector<Triple>* to) {
  static_assert(sizeof(Triple) == 3 * sizeof(Number) && std::is_trivially_copyable_v<Number>);
  if (from.empty()) return;
  to->resize(static_cast<size_t>(from.size()) / 3);
  std::memcpy(static_cast<void*>(to->data()), from.data(), to->size() * sizeof(Triple));
}

}  // namespace

std::string SerializeInOrder(const google::protobuf::MessageLite& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return bytes;
}

std::string EncodeEdgePayload(const Edge& edge) {
  // Of nearly all edges.
  if (edge.attributes.empty() && edge.valid == Interval()) return "";
  v1::Edge message;
  EdgeDetailsToProto(edge, &message);
  return SerializeInOrder(message);
}

bool DecodeEdgePayload(std::string_view bytes, Edge* edge) {
  v1::Edge message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return false;
  EdgeDetailsFromProto(message, edge);
  return true;
}

void ToProto(const MeshBlock& block, v1::MeshBlock* out) {
  out->set_x(block.index.x);
  out->set_y(block.index.y);
  out->set_z(block.index.z);
  CopyTriples(block.positions_map, out->mutable_positions());
  CopyTriples(block.normals_map, out->mutable_normals());
  out->mutable_colors()->Add(block.colors.begin(), block.colors.end());
  out->mutable_labels()->Add(block.labels.begin(), block.labels.end());
  out->mutable_instance_ids()->Add(block.instance_ids.begin(), block.instance_ids.end());
  out->mutable_first_seen_ns()->Add(block.first_seen_ns.begin(), block.first_seen_ns.end());
  out->mutable_last_seen_ns()->Add(block.last_seen_ns.begin(), block.last_seen_ns.end());
  CopyTriples(block.faces, out->mutable_faces());
}

absl::StatusOr<MeshBlock> FromProto(const v1::MeshBlock& in) {
  if (in.positions_size() % 3 != 0 || in.normals_size() % 3 != 0 || in.faces_size() % 3 != 0) {
    return MakeError(Reason::kFieldInvalid,
                     "a mesh block has positions, normals or faces that are not in threes",
                     {{"field", "mesh_blocks"}});
  }
  MeshBlock block;
  block.index = {in.x(), in.y(), in.z()};
  CopyTriples(in.positions(), &block.positions_map);
  CopyTriples(in.normals(), &block.normals_map);
  block.colors.assign(in.colors().begin(), in.colors().end());
  block.labels.assign(in.labels().begin(), in.labels().end());
  block.instance_ids.assign(in.instance_ids().begin(), in.instance_ids().end());
  block.first_seen_ns.assign(in.first_seen_ns().begin(), in.first_seen_ns().end());
  block.last_seen_ns.assign(in.last_seen_ns().begin(), in.last_seen_ns().end());
  CopyTriples(in.faces(), &block.faces);
  return block;
}

std::string EncodeMeshBlock(const MeshBlock& block) {
  v1::MeshBlock message;
  ToProto(block, &message);
  return Compress(SerializeInOrder(message));
}

bool DecodeMeshBlock(std::string_view bytes, MeshBlock* block) {
  v1::MeshBlock message;
  if (!Unpack(bytes, &message)) return false;
  auto decoded = FromProto(message);
  if (!decoded.ok()) return false;
  *block = *std::move(decoded);
  return true;
}

void ToProto(const PoseFactor& factor, v1::PoseFactor* out) {
  out->set_type(factor.type);
  out->set_from_time_ns(factor.from_ns);
  out->set_to_time_ns(factor.to_ns);
  out->set_to_agent(ToString(factor.to_agent));
  ToProto(factor.relative_pose, out->mutable_relative_pose());
  if (factor.information.has_value()) {
    out->mutable_information()->Add(factor.information->begin(), factor.information->end());
  }
}

absl::StatusOr<PoseFactor> FromProto(const v1::PoseFactor& in) {
  PoseFactor factor;
  factor.type = in.type();
  factor.from_ns = in.from_time_ns();
  factor.to_ns = in.to_time_ns();
  DSG_ASSIGN_OR_RETURN(factor.to_agent, OptionalNodeId(in.to_agent()));
  factor.relative_pose = FromProto(in.relative_pose());
  if (in.information_size() != 0) {
    if (in.information_size() != 21) {
      return MakeError(Reason::kFieldInvalid, "a factor's information needs 21 numbers or none",
                       {{"field", "factors.information"}});
    }
    factor.information.emplace();
    std::copy(in.information().begin(), in.information().end(), factor.information->begin());
  }
  return factor;
}

std::string EncodeFactors(const std::vector<PoseFactor>& factors) {
  v1::FactorAppend message;
  for (const PoseFactor& factor : factors) ToProto(factor, message.add_factors());
  return Compress(SerializeInOrder(message));
}

bool DecodeFactors(std::string_view bytes, std::vector<PoseFactor>* factors) {
  v1::FactorAppend message;
  if (!Unpack(bytes, &message)) return false;
  factors->clear();
  for (const v1::PoseFactor& factor : message.factors()) {
    auto decoded = FromProto(factor);
    if (!decoded.ok()) return false;
    factors->push_back(*std::move(decoded));
  }
  return true;
}

void ToProto(const BodyShape& shape, v1::BodyShape* out) {
  out->set_time_ns(shape.time_ns);
  out->mutable_pose_coefficients()->Add(shape.pose_coefficients.begin(),
                                        shape.pose_coefficients.end());
  out->mutable_shape_coefficients()->Add(shape.shape_coefficients.begin(),
                                         shape.shape_coefficients.end());
  out->mutable_vertices()->Add(shape.vertices.begin(), shape.vertices.end());
  out->mutable_joints()->Add(shape.joints.begin(), shape.joints.end());
}

BodyShape FromProto(const v1::BodyShape& in) {
  BodyShape shape;
  shape.time_ns = in.time_ns();
  shape.pose_coefficients.assign(in.pose_coefficients().begin(), in.pose_coefficients().end());
  shape.shape_coefficients.assign(in.shape_coefficients().begin(), in.shape_coefficients().end());
  shape.vertices.assign(in.vertices().begin(), in.vertices().end());
  shape.joints.assign(in.joints().begin(), in.joints().end());
  return shape;
}

}  // namespace dsg
