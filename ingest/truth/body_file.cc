// SPDX-License-Identifier: Apache-2.0
#include "ingest/truth/body_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/truth/truth_parts_internal.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::truth {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little-endian");

constexpr char kBodiesFile[] = "bodies.bin";
constexpr std::string_view kMagic = "DSGBODY1";
constexpr uint32_t kVertexCountMax = 20'000;
constexpr double kStepsPerM = 10'000.0;
constexpr std::streamoff kHeadBytes = 12;

std::string PathIn(const std::string& folder) {
  return (std::filesystem::path(folder) / kBodiesFile).string();
}

template <typename Number>
void AppendBytes(Number number, std::string* out) {
  out->append(reinterpret_cast<const char*>(&number), sizeof(number));
}

template <typename Number>
Number NumberAt(const char* bytes) {
  Number number{};
  std::memcpy(&number, bytes, sizeof(number));
  return number;
}

}  // namespace

absl::StatusOr<BodyFileWriter> BodyFileWriter::Create(const std::string& folder,
                                                      size_t vertex_count) {
  DSG_ASSIGN_OR_RETURN(ingest::OutputFile file, ingest::OutputFile::Create(PathIn(folder)));
  file.buffer() = kMagic;
  AppendBytes(static_cast<uint32_t>(vertex_count), &file.buffer());
  return BodyFileWriter(std::move(file), vertex_count);
}

absl::Status BodyFileWriter::Add(int64_t detection_id,
                                 const std::vector<Eigen::Vector3f>& vertices_root_map) {
  DSG_CHECK(vertices_root_map.size() == vertex_count_);
  AppendBytes(detection_id, &file_.buffer());
  for (const Eigen::Vector3f& vertex : vertices_root_map) {
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = kStepsPerM * static_cast<double>(vertex[axis]);
      AppendBytes(static_cast<int16_t>(std::clamp(std::round(steps), -32767.0, 32767.0)),
                  &file_.buffer());
    }
  }
  return file_.Flush();
}

absl::StatusOr<std::optional<BodyFile>> BodyFile::Open(const std::string& folder) {
  BodyFile bodies;
  bodies.path_ = PathIn(folder);
  std::error_code error;
  if (!std::filesystem::exists(bodies.path_, error)) return std::nullopt;
  bodies.file_.open(bodies.path_, std::ios::binary);
  char head[kHeadBytes] = {};
  bodies.file_.read(head, sizeof(head));
  if (!bodies.file_ || std::string_view(head, kMagic.size()) != kMagic) {
    return Malformed(bodies.path_, "is no file of bodies; simulate the log again");
  }
  const auto vertex_count = NumberAt<uint32_t>(head + kMagic.size());
  if (vertex_count == 0 || vertex_count > kVertexCountMax) {
    return Malformed(bodies.path_, absl::StrCat("says ", vertex_count, " vertices a body; 1 to ",
                                                kVertexCountMax, " are due"));
  }
  bodies.vertex_count_ = vertex_count;
  const auto body_bytes = static_cast<std::streamoff>(sizeof(int64_t) + 6 * size_t{vertex_count});
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(bodies.path_, error));
  if (error || (size - kHeadBytes) % body_bytes != 0) {
    return Malformed(bodies.path_,
                     absl::StrCat("has ", size, " bytes, which ends within a body of ", body_bytes,
                                  "; copy it again"));
  }
  for (std::streamoff at = kHeadBytes; at < size; at += body_bytes) {
    char id[sizeof(int64_t)] = {};
    bodies.file_.seekg(at);
    bodies.file_.read(id, sizeof(id));
    const auto offset = at + static_cast<std::streamoff>(sizeof(id));
    bodies.offset_of_.emplace(NumberAt<int64_t>(id), offset);
  }
  if (!bodies.file_) return Malformed(bodies.path_, "cannot be read to its end");
  return std::optional<BodyFile>(std::move(bodies));
}

absl::StatusOr<std::optional<std::vector<Eigen::Vector3f>>> BodyFile::Read(int64_t detection_id) {
  const auto found = offset_of_.find(detection_id);
  if (found == offset_of_.end()) return std::nullopt;
  std::string bytes(6 * vertex_count_, '\0');
  file_.clear();
  file_.seekg(found->second);
  file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file_) return Malformed(path_, "cannot be read any more; did the truth change meanwhile?");
  std::vector<Eigen::Vector3f> vertices(vertex_count_);
  for (size_t i = 0; i < vertex_count_; ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto steps = NumberAt<int16_t>(bytes.data() + 6 * i + 2 * axis);
      vertices[i][static_cast<Eigen::Index>(axis)] =
          static_cast<float>(static_cast<double>(steps) / kStepsPerM);
    }
  }
  return std::optional(std::move(vertices));
}

}  // namespace dsg::truth
