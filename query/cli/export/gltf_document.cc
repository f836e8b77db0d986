// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/gltf_document.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "the files are little endian");

constexpr uint32_t kMagic = 0x46546c67;
constexpr uint32_t kVersion = 2;
constexpr uint32_t kJsonChunk = 0x4e4f534a;
constexpr uint32_t kBinaryChunk = 0x004e4942;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kVertices = 34962;
constexpr int kIndices = 34963;
constexpr char kUnlit[] = "KHR_materials_unlit";

// Colours are sRGB (IEC 61966-2-1); glTF stores linear light.
double LightOf(uint32_t rgb, int shift) {
  const double shown = static_cast<double>(rgb >> shift & 0xff) / 255.0;
  return shown <= 0.04045 ? shown / 12.92 : std::pow((shown + 0.055) / 1.055, 2.4);
}

size_t Padding(size_t size) { return (4 - size % 4) % 4; }

template <class Vector>
Json NumbersOf(const Vector& vector) {
  return Json(std::vector<double>(vector.begin(), vector.end()));
}

Json JsonOf(const GltfNode& node) {
  Json out = {{"name", node.name}};
  if (node.mesh != kNone) out["mesh"] = node.mesh;
  if (!node.children.empty()) out["children"] = node.children;
  if (node.translation.has_value()) out["translation"] = NumbersOf(*node.translation);
  if (node.rotation.has_value()) {
    // x y z w, as Eigen keeps them.
    out["rotation"] = NumbersOf(node.rotation->normalized().coeffs());
  }
  if (node.scale.has_value()) out["scale"] = NumbersOf(*node.scale);
  for (const auto& [name, text] : node.extras) out["extras"][name] = text;
  return out;
}

Json JsonOf(const GltfPrimitive& primitive) {
  Json out = {{"attributes", {{"POSITION", primitive.positions}}},
              {"mode", static_cast<int>(primitive.mode)}};
  if (primitive.normals != kNone) out["attributes"]["NORMAL"] = primitive.normals;
  if (primitive.colors != kNone) out["attributes"]["COLOR_0"] = primitive.colors;
  if (primitive.indices != kNone) out["indices"] = primitive.indices;
  if (primitive.material != kNone) out["material"] = primitive.material;
  for (const int target : primitive.targets) out["targets"].push_back({{"POSITION", target}});
  return out;
}

Json JsonOf(const GltfMesh& mesh) {
  Json primitives = Json::array();
  for (const GltfPrimitive& primitive : mesh.primitives) primitives.push_back(JsonOf(primitive));
  return {{"name", mesh.name}, {"primitives", primitives}};
}

Json JsonOf(const GltfMaterial& material) {
  Json color = Json::array();
  for (const int shift : {16, 8, 0}) color.push_back(LightOf(material.rgb, shift));
  color.push_back(1.0);
  Json out = {{"name", material.name},
              {"doubleSided", true},
              {"pbrMetallicRoughness",
               {{"baseColorFactor", color}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}};
  if (material.is_unlit) out["extensions"][kUnlit] = Json::object();
  return out;
}

const char* PathName(GltfPath path) {
  switch (path) {
    case GltfPath::kTranslation:
      return "translation";
    case GltfPath::kScale:
      return "scale";
    case GltfPath::kWeights:
      break;
  }
  return "weights";
}

Json AnimationOf(const std::vector<GltfChannel>& channels) {
  Json out = {{"name", "over time"}};
  for (size_t i = 0; i < channels.size(); ++i) {
    const GltfChannel& channel = channels[i];
    out["samplers"].push_back({{"input", channel.times},
                               {"output", channel.values},
                               {"interpolation", channel.is_step ? "STEP" : "LINEAR"}});
    out["channels"].push_back(
        {{"sampler", i}, {"target", {{"node", channel.node}, {"path", PathName(channel.path)}}}});
  }
  return out;
}

// Leaves out empty lists, which the format forbids.
template <class T>
void AddList(const char* name, const std::vector<T>& parts, Json* document) {
  for (const T& part : parts) (*document)[name].push_back(JsonOf(part));
}

std::string WordsOf(std::initializer_list<uint32_t> words) {
  std::string bytes(words.size() * sizeof(uint32_t), '\0');
  std::memcpy(bytes.data(), words.begin(), bytes.size());
  return bytes;
}

}  // namespace

int GltfDocument::AddNode(GltfNode node) {
  nodes.push_back(std::move(node));
  return static_cast<int>(nodes.size()) - 1;
}

int GltfDocument::AddMesh(GltfMesh mesh) {
  meshes.push_back(std::move(mesh));
  return static_cast<int>(meshes.size()) - 1;
}

int GltfDocument::AddMaterial(GltfMaterial material) {
  materials.push_back(std::move(material));
  return static_cast<int>(materials.size()) - 1;
}

int GltfDocument::AddAccessor(const void* data, size_t byte_length, Accessor accessor) {
  DSG_CHECK(accessor.count > 0);
  accessor.offset = buffer_.size();
  accessor.byte_length = byte_length;
  buffer_.append(static_cast<const char*>(data), byte_length);
  buffer_.append(Padding(buffer_.size()), '\0');
  accessors_.push_back(std::move(accessor));
  return static_cast<int>(accessors_.size()) - 1;
}

int GltfDocument::AddPositions(const std::vector<Eigen::Vector3f>& points) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& point : points) bounds.extend(point);
  const auto list = [](const Eigen::Vector3f& v) { return std::vector<float>(v.begin(), v.end()); };
  return AddAccessor(points.data(), points.size() * sizeof(Eigen::Vector3f),
                     {.count = points.size(),
                      .component_type = kFloat,
                      .type = "VEC3",
                      .target = kVertices,
                      .low = list(bounds.min()),
                      .high = list(bounds.max())});
}

int GltfDocument::AddNormals(const std::vector<Eigen::Vector3f>& normals) {
  return AddAccessor(normals.data(), normals.size() * sizeof(Eigen::Vector3f),
                     {.count = normals.size(),
                      .component_type = kFloat,
                      .type = "VEC3",
                      .target = kVertices,
                      .low = {},
                      .high = {}});
}

int GltfDocument::AddColors(const std::vector<uint32_t>& colors) {
  // Two bytes per channel: one byte cannot separate dark colours in linear light.
  std::array<uint16_t, 256> light_of{};
  for (uint32_t i = 0; i < light_of.size(); ++i) {
    light_of[i] = static_cast<uint16_t>(std::lround(65535.0 * LightOf(i, 0)));
  }
  std::vector<std::array<uint16_t, 4>> lights;
  lights.reserve(colors.size());
  for (const uint32_t rgb : colors) {
    lights.push_back(
        {light_of[rgb >> 16 & 0xff], light_of[rgb >> 8 & 0xff], light_of[rgb & 0xff], 65535});
  }
  return AddAccessor(lights.data(), lights.size() * sizeof(lights[0]),
                     {.count = lights.size(),
                      .component_type = kUnsignedShort,
                      .type = "VEC4",
                      .is_normalized = true,
                      .target = kVertices,
                      .low = {},
                      .high = {}});
}

int GltfDocument::AddIndices(const std::vector<uint32_t>& indices) {
  return AddAccessor(indices.data(), indices.size() * sizeof(uint32_t),
                     {.count = indices.size(),
                      .component_type = kUnsignedInt,
                      .type = "SCALAR",
                      .target = kIndices,
                      .low = {},
                      .high = {}});
}

int GltfDocument::AddTimes(const std::vector<float>& times_s) {
  return AddAccessor(times_s.data(), times_s.size() * sizeof(float),
                     {.count = times_s.size(),
                      .component_type = kFloat,
                      .type = "SCALAR",
                      .low = {times_s.front()},
                      .high = {times_s.back()}});
}

int GltfDocument::AddScalars(const std::vector<float>& numbers) {
  return AddAccessor(
      numbers.data(), numbers.size() * sizeof(float),
      {.count = numbers.size(), .component_type = kFloat, .type = "SCALAR", .low = {}, .high = {}});
}

int GltfDocument::AddVectors(const std::vector<Eigen::Vector3f>& vectors) {
  return AddAccessor(
      vectors.data(), vectors.size() * sizeof(Eigen::Vector3f),
      {.count = vectors.size(), .component_type = kFloat, .type = "VEC3", .low = {}, .high = {}});
}

std::string GltfDocument::MakeJson() const {
  Json document = {{"asset", {{"version", "2.0"}, {"generator", "dsg"}}}};
  const auto is_unlit = [](const GltfMaterial& material) { return material.is_unlit; };
  if (std::any_of(materials.begin(), materials.end(), is_unlit)) {
    document["extensionsUsed"] = Json::array({kUnlit});
  }
  document["scene"] = 0;
  document["scenes"] = Json::array({{{"nodes", roots}}});
  AddList("nodes", nodes, &document);
  AddList("meshes", meshes, &document);
  AddList("materials", materials, &document);
  if (!channels.empty()) document["animations"] = Json::array({AnimationOf(channels)});
  for (size_t i = 0; i < accessors_.size(); ++i) {
    const Accessor& accessor = accessors_[i];
    Json out = {{"bufferView", i},
                {"componentType", accessor.component_type},
                {"count", accessor.count},
                {"type", accessor.type}};
    if (accessor.is_normalized) out["normalized"] = true;
    if (!accessor.low.empty()) {
      out["min"] = NumbersOf(accessor.low);
      out["max"] = NumbersOf(accessor.high);
    }
    document["accessors"].push_back(std::move(out));
    Json view = {
        {"buffer", 0}, {"byteOffset", accessor.offset}, {"byteLength", accessor.byte_length}};
    if (accessor.target != 0) view["target"] = accessor.target;
    document["bufferViews"].push_back(std::move(view));
  }
  if (!buffer_.empty()) {
    document["buffers"] = Json::array({{{"byteLength", buffer_.size()}}});
  }
  // Invalid UTF-8 in the texts of a map is replaced, so that the file stays readable.
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

absl::Status GltfDocument::Write(AtomicFile* file) const {
  std::string json = MakeJson();
  json.append(Padding(json.size()), ' ');
  size_t size = 12 + 8 + json.size();
  if (!buffer_.empty()) size += 8 + buffer_.size();
  if (size > std::numeric_limits<uint32_t>::max()) {
    return MakeError(Reason::kLimitExceeded,
                     absl::StrCat(file->path(), " would have ", size,
                                  " bytes, more than a .glb file can; export as PLY instead"),
                     {{"path", file->path()}});
  }
  const auto word = [](size_t value) { return static_cast<uint32_t>(value); };
  DSG_RETURN_IF_ERROR(
      file->Write(WordsOf({kMagic, kVersion, word(size), word(json.size()), kJsonChunk})));
  DSG_RETURN_IF_ERROR(file->Write(json));
  if (buffer_.empty()) return absl::OkStatus();
  DSG_RETURN_IF_ERROR(file->Write(WordsOf({word(buffer_.size()), kBinaryChunk})));
  return file->Write(buffer_);
}

}  // namespace dsg::cli
