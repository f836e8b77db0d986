// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "ingest/truth/truth_parts_internal.h"
#include "schema/base/status.h"

namespace dsg::truth {
namespace {

static_assert(std::endian::native == std::endian::little, "the bytes are copied as they are");

constexpr size_t kVertexBytes = 3 * sizeof(float) + sizeof(uint16_t);
constexpr size_t kFaceBytes = 1 + 3 * sizeof(int32_t) + 1;
constexpr uint64_t kCountMax = 200'000'000;

std::string Header(uint64_t vertex_count, uint64_t face_count) {
  return absl::StrCat(
      "ply\nformat binary_little_endian 1.0\n"
      "comment label is class << 8 | instance; observed: some depth image showed the face\n"
      "element vertex ",
      vertex_count,
      "\nproperty float x\nproperty float y\nproperty float z\nproperty ushort label\n"
      "element face ",
      face_count,
      "\nproperty list uchar int vertex_indices\nproperty uchar observed\nend_header\n");
}

template <typename T>
void Append(T value, std::string* out) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out->append(bytes, sizeof(T));
}

template <typename T>
T Take(const char** at) {
  T value;
  std::memcpy(&value, *at, sizeof(T));
  *at += sizeof(T);
  return value;
}

// The number after `name` in the header; 0 when there is none, which the comparison of the whole
// header then finds.
uint64_t CountOf(std::string_view bytes, std::string_view name) {
  const size_t at = bytes.substr(0, 1024).find(name);
  if (at == std::string_view::npos) return 0;
  uint64_t count = 0;
  for (size_t i = at + name.size(); i < bytes.size() && bytes[i] >= '0' && bytes[i] <= '9'; ++i) {
    count = count * 10 + static_cast<uint64_t>(bytes[i] - '0');
    if (count > kCountMax) return 0;
  }
  return count;
}

absl::Status ReadFaces(const char* at, uint64_t face_count, const std::string& file, Truth* truth) {
  const auto vertex_count = static_cast<int64_t>(truth->mesh.positions_map.size());
  truth->mesh.faces.resize(face_count);
  truth->face_observed.resize(face_count);
  for (size_t i = 0; i < face_count; ++i) {
    if (Take<uint8_t>(&at) != 3)
      return Malformed(file, absl::StrCat("face ", i, " is no triangle"));
    for (uint32_t& corner : truth->mesh.faces[i]) {
      const auto index = Take<int32_t>(&at);
      if (index < 0 || index >= vertex_count) {
        return Malformed(file,
                         absl::StrCat("face ", i, " has vertex ", index, " of ", vertex_count));
      }
      corner = static_cast<uint32_t>(index);
    }
    truth->face_observed[i] = Take<uint8_t>(&at);
    if (truth->face_observed[i] > 1) {
      return Malformed(file, absl::StrCat("observed of face ", i, " is neither 0 nor 1"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

std::string MeshToPly(const MeshBlock& mesh, const std::vector<uint8_t>& face_observed) {
  std::string out = Header(mesh.positions_map.size(), mesh.faces.size());
  out.reserve(out.size() + mesh.positions_map.size() * kVertexBytes +
              mesh.faces.size() * kFaceBytes);
  for (size_t i = 0; i < mesh.positions_map.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) Append(mesh.positions_map[i][axis], &out);
    Append(static_cast<uint16_t>(mesh.instance_ids[i]), &out);
  }
  for (size_t i = 0; i < mesh.faces.size(); ++i) {
    Append(uint8_t{3}, &out);
    for (const uint32_t corner : mesh.faces[i]) Append(static_cast<int32_t>(corner), &out);
    Append(static_cast<uint8_t>(face_observed[i] != 0 ? 1 : 0), &out);
  }
  return out;
}

absl::Status MeshFromPly(std::string_view bytes, const std::string& file, Truth* truth) {
  const uint64_t vertex_count = CountOf(bytes, "element vertex ");
  const uint64_t face_count = CountOf(bytes, "element face ");
  const std::string header = Header(vertex_count, face_count);
  if (bytes.substr(0, header.size()) != header) {
    return Malformed(file, "the header is not one that dsg-simulate writes; write the truth again");
  }
  const uint64_t wanted = header.size() + vertex_count * kVertexBytes + face_count * kFaceBytes;
  if (bytes.size() != wanted) {
    return Malformed(file, absl::StrCat("has ", bytes.size(), " bytes where the header promises ",
                                        wanted, "; the file was cut or changed"));
  }
  const char* at = bytes.data() + header.size();
  MeshBlock& mesh = truth->mesh;
  mesh.positions_map.resize(vertex_count);
  mesh.labels.resize(vertex_count);
  mesh.instance_ids.resize(vertex_count);
  for (size_t i = 0; i < vertex_count; ++i) {
    for (int axis = 0; axis < 3; ++axis) mesh.positions_map[i][axis] = Take<float>(&at);
    mesh.instance_ids[i] = Take<uint16_t>(&at);
    mesh.labels[i] = mesh.instance_ids[i] >> 8;
    if (!mesh.positions_map[i].allFinite()) {
      return Malformed(file, absl::StrCat("vertex ", i, " is not finite"));
    }
  }
  return ReadFaces(at, face_count, file, truth);
}

}  // namespace dsg::truth
