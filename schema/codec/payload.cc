// SPDX-License-Identifier: Apache-2.0
// A node is numbers without tags, and nothing for what is usual (no rotation, rotation about z, a
// box around the origin), since a map has many nodes and keeps them for years. What few nodes have
// is a protobuf message at the end. Edges, factors and mesh blocks from elsewhere are protobuf
// messages without what stands in columns. docs/storage_format.md gives the layout.
#include "schema/codec/payload.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <bit>
#include <iterator>
#include <optional>
#include <utility>

#include "dsg/v1/graph.pb.h"
#include "schema/codec/attribute_codec.h"
#include "schema/codec/bit_stream.h"
#include "schema/codec/mesh_codec.h"
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

// No protobuf message begins with this byte, and the payloads of format 1 are such messages.
constexpr uint8_t kNodeVersion = 1;

// Two bits each say in which form a rotation or a box is written.
enum Form : uint64_t { kNothing = 0, kUsual = 1, kShort = 2, kFull = 3 };
constexpr int kRotationShift = 0;
constexpr int kBoxShift = 2;
enum Flag : uint64_t {
  kHasClass = 1u << 4,
  kHasValidFrom = 1u << 5,
  kHasValidTo = 1u << 6,
  kHasFirstObserved = 1u << 7,
  kHasLastObserved = 1u << 8,
  kHasConfidence = 1u << 9,
  kHasObject = 1u << 10,
  kHasPlace = 1u << 11,
  kHasMore = 1u << 12,
  kHasAttributes = 1u << 13,
  kNodeFlags = (1u << 14) - 1,
};
enum ObjectFlag : uint64_t {
  kHasModel = 1u << 2,
  kHasResidual = 1u << 3,
  kHasColor = 1u << 4,
  kHasSize = 1u << 5,
  kSizeIsBox = 1u << 6,
  kObjectFlags = (1u << 7) - 1,
};

// Equal as bytes: 0 and -0 differ, so that nothing is lost.
bool IsSame(double a, double b) { return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b); }
bool IsSame(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return IsSame(a.x(), b.x()) && IsSame(a.y(), b.y()) && IsSame(a.z(), b.z());
}

void AppendText(std::string_view text, std::string* out) {
  AppendVarint(text.size(), out);
  out->append(text);
}
void AppendVector(const Eigen::Vector3d& v, std::string* out) {
  for (int axis = 0; axis < 3; ++axis) AppendFixed(v[axis], out);
}
std::string ReadText(ByteReader* in) {
  const uint64_t size = in->Varint();
  return std::string(in->Bytes(size));
}
Eigen::Vector3d ReadVector(ByteReader* in) {
  Eigen::Vector3d v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = in->Fixed<double>();
  return v;
}

Form FormOf(const Eigen::Quaterniond& q) {
  if (!IsSame(q.x(), 0.0) || !IsSame(q.y(), 0.0)) return kFull;
  return IsSame(q.z(), 0.0) && IsSame(q.w(), 1.0) ? kNothing : kShort;
}

void AppendRotation(Form form, const Eigen::Quaterniond& q, std::string* out) {
  if (form == kNothing) return;
  AppendFixed(q.w(), out);
  AppendFixed(q.z(), out);
  if (form == kShort) return;
  AppendFixed(q.x(), out);
  AppendFixed(q.y(), out);
}

Eigen::Quaterniond ReadRotation(Form form, ByteReader* in) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  if (form == kNothing) return q;
  q.w() = in->Fixed<double>();
  q.z() = in->Fixed<double>();
  if (form == kShort) return q;
  q.x() = in->Fixed<double>();
  q.y() = in->Fixed<double>();
  return q;
}

// kUsual: a point in the origin; kShort: the origin is its centre.
Form FormOf(const Box3d& box) {
  if (box.isEmpty()) return kNothing;
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  if (IsSame(box.min(), zero) && IsSame(box.max(), zero)) return kUsual;
  return IsSame(box.min(), -box.max()) ? kShort : kFull;
}

void AppendBox(Form form, const Box3d& box, std::string* out) {
  if (form >= kShort) AppendVector(box.max(), out);
  if (form == kFull) AppendVector(box.min(), out);
}

Box3d ReadBox(Form form, ByteReader* in) {
  if (form == kNothing) return Box3d();
  const Eigen::Vector3d max = form == kUsual ? Eigen::Vector3d::Zero() : ReadVector(in);
  if (form == kUsual) return Box3d(max, max);
  return form == kShort ? Box3d(-max, max) : Box3d(ReadVector(in), max);
}

uint64_t FlagIf(bool condition, uint64_t flag) { return condition ? flag : 0; }

void AppendObject(const ObjectInfo& object, const Box3d& box, std::string* out) {
  const Form rotation = FormOf(object.map_T_model.orientation);
  const bool has_size = !object.size.isZero(0.0);
  const bool is_box = has_size && IsSame(object.size, box.sizes());
  const bool has_residual = !IsSame(object.registration_residual_m, 0.0);
  AppendVarint(FlagIf(object.model.has_value(), kHasModel | rotation << kRotationShift) |
                   FlagIf(has_residual, kHasResidual) |
                   FlagIf(object.color.has_value(), kHasColor) |
                   FlagIf(has_size && !is_box, kHasSize) | FlagIf(is_box, kSizeIsBox),
               out);
  if (object.model.has_value()) {
    out->append(BytesOf(*object.model));
    AppendVector(object.map_T_model.position, out);
    AppendRotation(rotation, object.map_T_model.orientation, out);
  }
  if (has_residual) AppendFixed(object.registration_residual_m, out);
  if (object.color.has_value()) AppendFixed(*object.color, out);
  if (has_size && !is_box) AppendVector(object.size, out);
  AppendVarint(object.mesh_instance_id, out);
}

bool ReadObject(const Box3d& box, ByteReader* in, ObjectInfo* object) {
  const uint64_t flags = in->Varint();
  if ((flags & ~uint64_t{kObjectFlags}) != 0) return false;
  if (flags & kHasModel) {
    object->model = in->Fixed<Sha256>();
    object->map_T_model.position = ReadVector(in);
    object->map_T_model.orientation = ReadRotation(Form(flags >> kRotationShift & 3), in);
  }
  if (flags & kHasResidual) object->registration_residual_m = in->Fixed<double>();
  if (flags & kHasColor) object->color = in->Fixed<Color>();
  if (flags & kHasSize) object->size = ReadVector(in);
  if (flags & kSizeIsBox) object->size = box.sizes();
  object->mesh_instance_id = static_cast<uint32_t>(in->Varint());
  return true;
}

void AppendPlace(const PlaceInfo& place, std::string* out) {
  const Form box = FormOf(place.free_box);
  AppendVarint(box, out);
  AppendFixed(place.clearance_m, out);
  AppendBox(box, place.free_box, out);
  AppendVarint(ZigZag(place.basis_point_count), out);
}

bool ReadPlace(ByteReader* in, PlaceInfo* place) {
  const uint64_t box = in->Varint();
  if (box > kFull) return false;
  place->clearance_m = in->Fixed<double>();
  place->free_box = ReadBox(Form(box), in);
  place->basis_point_count = static_cast<int32_t>(UnZigZag(in->Varint()));
  return true;
}

bool HasMore(const Node& node) {
  return node.agent.has_value() || node.structure.has_value() || node.region.has_value();
}

uint64_t FlagsOf(const Node& node) {
  return FormOf(node.map_T_node.orientation) << kRotationShift |
         FormOf(node.box_node) << kBoxShift |
         FlagIf(node.class_id >= 0 || !node.class_name.empty(), kHasClass) |
         FlagIf(node.valid.from_ns != kTimeMin, kHasValidFrom) |
         FlagIf(node.valid.to_ns != kTimeMax, kHasValidTo) |
         FlagIf(node.first_observed_ns.has_value(), kHasFirstObserved) |
         FlagIf(node.last_observed_ns.has_value(), kHasLastObserved) |
         FlagIf(node.confidence.has_value(), kHasConfidence) |
         FlagIf(node.object.has_value(), kHasObject) | FlagIf(node.place.has_value(), kHasPlace) |
         FlagIf(HasMore(node), kHasMore) | FlagIf(!node.attributes.empty(), kHasAttributes);
}

void AppendKind(const std::string& kind, std::string* out) {
  const kinds::Kind* const known = kinds::Find(kind);
  AppendVarint(known == nullptr ? 0 : static_cast<uint64_t>(known - kinds::kAll) + 1, out);
  if (known == nullptr) AppendText(kind, out);
}

bool ReadKind(ByteReader* in, std::string* kind) {
  const uint64_t number = in->Varint();
  if (number > std::size(kinds::kAll)) return false;
  *kind = number == 0 ? ReadText(in) : kinds::kAll[number - 1].name;
  return true;
}

// The last time minus the first: few bytes where nanoseconds since 1970 take eight.
void AppendTimes(const Node& node, std::string* out) {
  if (node.valid.from_ns != kTimeMin) AppendFixed(node.valid.from_ns, out);
  if (node.valid.to_ns != kTimeMax) AppendFixed(node.valid.to_ns, out);
  if (node.first_observed_ns.has_value()) AppendFixed(*node.first_observed_ns, out);
  if (!node.last_observed_ns.has_value()) return;
  const auto first = static_cast<uint64_t>(node.first_observed_ns.value_or(0));
  const auto last = static_cast<uint64_t>(*node.last_observed_ns);
  AppendVarint(ZigZag(static_cast<int64_t>(last - first)), out);
}

void ReadTimes(uint64_t flags, ByteReader* in, Node* node) {
  if (flags & kHasValidFrom) node->valid.from_ns = in->Fixed<TimeNs>();
  if (flags & kHasValidTo) node->valid.to_ns = in->Fixed<TimeNs>();
  if (flags & kHasFirstObserved) node->first_observed_ns = in->Fixed<TimeNs>();
  if (!(flags & kHasLastObserved)) return;
  const auto first = static_cast<uint64_t>(node->first_observed_ns.value_or(0));
  const auto since = static_cast<uint64_t>(UnZigZag(in->Varint()));
  node->last_observed_ns = static_cast<TimeNs>(first + since);
}

bool ReadComponents(uint64_t flags, ByteReader* in, Node* node) {
  if (flags & kHasObject && !ReadObject(node->box_node, in, &node->object.emplace())) return false;
  if (flags & kHasPlace && !ReadPlace(in, &node->place.emplace())) return false;
  Attributes attributes;
  if (flags & kHasAttributes && !ReadAttributes(in, &attributes)) return false;
  if (flags & kHasMore) {
    const std::string_view rest = in->Bytes(in->remaining());
    v1::Node message;
    const bool is_read = message.ParseFromArray(rest.data(), static_cast<int>(rest.size())) &&
                         RareDetailsFromProto(message, node).ok();
    if (!is_read) return false;
  }
  // Format 2 wrote attributes with the rare details.
  if (flags & kHasAttributes) node->attributes = std::move(attributes);
  return true;
}

std::string EncodeNode(const Node& node, bool with_attributes) {
  const uint64_t flags = FlagsOf(node);
  std::string out;
  AppendFixed(kNodeVersion, &out);
  AppendVarint(flags, &out);
  AppendKind(node.kind, &out);
  AppendText(node.name, &out);
  if (flags & kHasClass) {
    AppendVarint(ZigZag(node.class_id), &out);
    AppendText(node.class_name, &out);
  }
  AppendVector(node.map_T_node.position, &out);
  AppendRotation(FormOf(node.map_T_node.orientation), node.map_T_node.orientation, &out);
  AppendBox(FormOf(node.box_node), node.box_node, &out);
  AppendTimes(node, &out);
  AppendVarint(ZigZag(node.observation_count), &out);
  if (node.confidence.has_value()) AppendFixed(*node.confidence, &out);
  AppendVarint(static_cast<uint64_t>(node.provenance), &out);
  if (node.object.has_value()) AppendObject(*node.object, node.box_node, &out);
  if (node.place.has_value()) AppendPlace(*node.place, &out);
  if (with_attributes && (flags & kHasAttributes)) AppendAttributes(node.attributes, &out);
  if (flags & kHasMore) {
    v1::Node message;
    ComponentsOfFewToProto(node, &message);
    out += SerializeInOrder(message);
  }
  return out;
}

// Up to where the components begin.
bool ReadHead(ByteReader* in, uint64_t* flags, Node* node) {
  *flags = in->Varint();
  if ((*flags & ~uint64_t{kNodeFlags}) != 0 || !ReadKind(in, &node->kind)) return false;
  node->name = ReadText(in);
  if (*flags & kHasClass) {
    node->class_id = static_cast<int32_t>(UnZigZag(in->Varint()));
    node->class_name = ReadText(in);
  }
  node->map_T_node.position = ReadVector(in);
  node->map_T_node.orientation = ReadRotation(Form(*flags >> kRotationShift & 3), in);
  node->box_node = ReadBox(Form(*flags >> kBoxShift & 3), in);
  ReadTimes(*flags, in, node);
  node->observation_count = UnZigZag(in->Varint());
  if (*flags & kHasConfidence) node->confidence = in->Fixed<double>();
  node->provenance = static_cast<Provenance>(in->Varint());
  return in->ok();
}

bool IsOfThisCodec(std::string_view bytes) {
  return !bytes.empty() && static_cast<uint8_t>(bytes[0]) == kNodeVersion;
}

}  // namespace

std::string EncodeNodePayload(const Node& node) { return EncodeNode(node, true); }

std::string EncodeAllButAttributes(const Node& node) { return EncodeNode(node, false); }

bool DecodeNodePlacement(std::string_view bytes, Node* node) {
  if (!IsOfThisCodec(bytes)) return DecodeNodePayload(bytes, node);
  ByteReader in(bytes.substr(1));
  uint64_t flags = 0;
  return ReadHead(&in, &flags, node);
}

bool DecodeNodePayload(std::string_view bytes, Node* node) {
  if (!IsOfThisCodec(bytes)) {
    v1::Node message;
    return message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) &&
           NodeDetailsFromProto(message, node).ok();
  }
  ByteReader in(bytes.substr(1));
  uint64_t flags = 0;
  return ReadHead(&in, &flags, node) && ReadComponents(flags, &in, node) && in.ok() &&
         in.remaining() == 0;
}

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

std::string EncodeMeshBlock(const MeshBlock& block) {
  std::optional<std::string> bytes = EncodeLatticeMesh(block);
  if (bytes.has_value()) return *std::move(bytes);
  v1::MeshBlock message;
  ToProto(block, &message);
  return Compress(SerializeInOrder(message));
}

bool DecodeMeshBlock(std::string_view bytes, MeshBlock* block) {
  if (IsLatticeMesh(bytes)) return DecodeLatticeMesh(bytes, block);
  v1::MeshBlock message;
  if (!Unpack(bytes, &message)) return false;
  auto decoded = FromProto(message);
  if (!decoded.ok()) return false;
  *block = *std::move(decoded);
  return true;
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

}  // namespace dsg
