// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/objects/registration/cloud_files.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

namespace dsg::ingest {
namespace {

std::string ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

float FloatAt(const std::string& bytes, size_t offset) {
  float value = 0.0F;
  if (offset + sizeof(value) <= bytes.size()) {
    std::memcpy(&value, bytes.data() + offset, sizeof(value));
  }
  return value;
}

std::vector<Eigen::Vector3d> ReadTextRows(const std::string& text, size_t count) {
  std::istringstream lines(text);
  std::vector<Eigen::Vector3d> points;
  std::string line;
  while (points.size() < count && std::getline(lines, line)) {
    std::istringstream fields(line);
    std::string x;
    std::string y;
    std::string z;
    fields >> x >> y >> z;
    points.emplace_back(std::strtod(x.c_str(), nullptr), std::strtod(y.c_str(), nullptr),
                        std::strtod(z.c_str(), nullptr));
  }
  return points;
}

// The compression of PCD files: runs of literals and copies from earlier bytes.
std::string DecompressLzf(const std::string& bytes, size_t begin, size_t end) {
  std::string out;
  size_t i = begin;
  while (i < end) {
    const auto control = static_cast<unsigned char>(bytes[i++]);
    if (control < 32) {
      out.append(bytes, i, control + 1U);
      i += control + 1U;
      continue;
    }
    size_t length = control >> 5;
    if (length == 7) length += static_cast<unsigned char>(bytes[i++]);
    size_t back = (control & 31U) << 8;
    back += static_cast<unsigned char>(bytes[i++]) + 1U;
    if (back > out.size()) return {};
    const size_t from = out.size() - back;
    for (size_t k = 0; k < length + 2; ++k) out.push_back(out[from + k]);
  }
  return out;
}

struct PcdHeader {
  size_t point_count = 0;
  // Bytes of the fields of one point, all together.
  size_t point_size = 0;
  std::string data;
  size_t end = 0;
};

PcdHeader ReadPcdHeader(const std::string& bytes) {
  PcdHeader header;
  size_t begin = 0;
  while (header.data.empty() && begin < bytes.size()) {
    const size_t end = std::min(bytes.find('\n', begin), bytes.size());
    std::istringstream line(bytes.substr(begin, end - begin));
    std::string key;
    line >> key;
    if (key == "POINTS") line >> header.point_count;
    if (key == "DATA") line >> header.data;
    if (key == "SIZE") {
      size_t size = 0;
      while (line >> size) header.point_size += size;
    }
    begin = end + 1;
  }
  header.end = begin;
  return header;
}

}  // namespace

std::string RegistrationFile(const std::string& name) {
  const char* folder = std::getenv("DSG_DATA");
  const std::filesystem::path data =
      folder != nullptr ? folder : std::filesystem::path(DSG_SOURCE_DIR) / "../shared/data";
  const std::filesystem::path path = data / "registration" / name;
  return std::filesystem::exists(path) ? path.string() : "";
}

std::vector<Eigen::Vector3d> ReadPlyPoints(const std::string& path) {
  const std::string bytes = ReadBytes(path);
  const size_t vertex = bytes.find("element vertex ");
  const std::string last_line = "end_header\n";
  const size_t end = bytes.find(last_line);
  if (vertex == std::string::npos || end == std::string::npos) return {};
  const size_t count = std::strtoul(bytes.c_str() + vertex + 15, nullptr, 10);
  const std::string body = bytes.substr(end + last_line.size());
  if (bytes.find("format ascii") != std::string::npos) return ReadTextRows(body, count);
  std::vector<Eigen::Vector3d> points;
  for (size_t i = 0; i < count; ++i) {
    points.emplace_back(FloatAt(body, 12 * i), FloatAt(body, 12 * i + 4),
                        FloatAt(body, 12 * i + 8));
  }
  return points;
}

std::vector<Eigen::Vector3d> ReadPcdPoints(const std::string& path) {
  const std::string bytes = ReadBytes(path);
  const PcdHeader header = ReadPcdHeader(bytes);
  std::vector<Eigen::Vector3d> points;
  if (header.data == "ascii") {
    points = ReadTextRows(bytes.substr(header.end), header.point_count);
  } else {
    // Compressed files hold all x, then all y, then all z; others point after point.
    const bool is_compressed = header.data == "binary_compressed";
    const std::string body = is_compressed ? DecompressLzf(bytes, header.end + 8, bytes.size())
                                           : bytes.substr(header.end);
    const size_t field_step = is_compressed ? 4 * header.point_count : 4;
    const size_t point_step = is_compressed ? 4 : header.point_size;
    for (size_t i = 0; i < header.point_count; ++i) {
      const size_t at = i * point_step;
      points.emplace_back(FloatAt(body, at), FloatAt(body, at + field_step),
                          FloatAt(body, at + 2 * field_step));
    }
  }
  std::erase_if(points, [](const Eigen::Vector3d& p) { return !p.allFinite(); });
  return points;
}

std::vector<double> ReadNumbers(const std::string& path) {
  std::string text = ReadBytes(path);
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream stream(text);
  std::vector<double> numbers;
  double number = 0.0;
  while (stream >> number) numbers.push_back(number);
  return numbers;
}

}  // namespace dsg::ingest
