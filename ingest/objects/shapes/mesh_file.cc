// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/mesh_file.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "ingest/objects/shapes/mesh_file_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

static_assert(std::endian::native == std::endian::little, "the bytes are copied as they are");

constexpr size_t kQuotedCharacterMax = 40;

template <typename T>
void Append(T value, std::string* out) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out->append(bytes, sizeof(T));
}

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

}  // namespace

void TriangleSoup::AddPolygon(const std::vector<uint32_t>& corners) {
  for (size_t i = 2; i < corners.size(); ++i) {
    faces.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

absl::Status CadFileError(const std::string& file, std::string_view message) {
  return MakeError(Reason::kFileMalformed, absl::StrCat(file, ": ", std::string(message)),
                   {{"file", file}});
}

absl::Status CadLineError(const std::string& file, int64_t line, std::string_view message) {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(file, ":", line, ": ", std::string(message)),
                   {{"file", file}, {"line", absl::StrCat(line)}});
}

void WordReader::SkipBlanks(bool may_end_line) {
  while (at_ < bytes_.size()) {
    if (bytes_[at_] == '\n') {
      if (!may_end_line) return;
      ++line_;
    } else if (!IsBlank(bytes_[at_])) {
      return;
    }
    ++at_;
  }
}

std::string_view WordReader::Next() {
  SkipBlanks(true);
  return NextInLine();
}

std::string_view WordReader::NextInLine() {
  SkipBlanks(false);
  const size_t begin = at_;
  while (at_ < bytes_.size() && bytes_[at_] != '\n' && !IsBlank(bytes_[at_])) ++at_;
  return bytes_.substr(begin, at_ - begin);
}

bool WordReader::SkipLine() {
  while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
  if (at_ == bytes_.size()) return false;
  ++at_;
  ++line_;
  return at_ < bytes_.size();
}

bool ParseCadNumber(std::string_view word, double* value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *value);
  return error == std::errc() && end == word.data() + word.size() && std::isfinite(*value);
}

bool ParseCadInteger(std::string_view word, int64_t* value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *value);
  return error == std::errc() && end == word.data() + word.size();
}

std::string Quoted(std::string_view word) {
  std::string out = "\"";
  for (const char c : word.substr(0, kQuotedCharacterMax)) {
    out.push_back(c >= ' ' && c <= '~' ? c : '?');
  }
  return out + (word.size() > kQuotedCharacterMax ? "...\"" : "\"");
}

std::string WritePly(const TriangleSoup& mesh, std::string_view frame) {
  std::string out = absl::StrCat(
      "ply\nformat binary_little_endian 1.0\ncomment ", std::string(frame), "\nelement vertex ",
      mesh.vertices.size(), "\nproperty float x\nproperty float y\nproperty float z\nelement face ",
      mesh.faces.size(), "\nproperty list uchar int vertex_indices\nend_header\n");
  out.reserve(out.size() + mesh.vertices.size() * 12 + mesh.faces.size() * 13);
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    for (int axis = 0; axis < 3; ++axis) Append(static_cast<float>(vertex[axis]), &out);
  }
  for (const std::array<uint32_t, 3>& face : mesh.faces) {
    Append(uint8_t{3}, &out);
    for (const uint32_t corner : face) Append(static_cast<int32_t>(corner), &out);
  }
  return out;
}

}  // namespace dsg::ingest
