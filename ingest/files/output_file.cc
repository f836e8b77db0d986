// SPDX-License-Identifier: Apache-2.0
#include "ingest/files/output_file.h"

#include <charconv>
#include <cmath>
#include <utility>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;

}  // namespace

absl::StatusOr<OutputFile> OutputFile::Create(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path));
  return OutputFile(std::move(file));
}

absl::Status OutputFile::WriteBuffer() {
  DSG_RETURN_IF_ERROR(file_.Write(buffer_));
  buffer_.clear();
  return absl::OkStatus();
}

absl::Status OutputFile::Flush() {
  return buffer_.size() < kBufferBytes ? absl::OkStatus() : WriteBuffer();
}

absl::Status OutputFile::Commit() {
  DSG_RETURN_IF_ERROR(WriteBuffer());
  return file_.Commit();
}

absl::Status WriteFile(const std::string& path, std::string bytes) {
  DSG_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path));
  file.buffer() = std::move(bytes);
  return file.Commit();
}

void AppendInteger(int64_t value, std::string* out) {
  char digits[24];
  const auto [end, error] = std::to_chars(digits, digits + sizeof(digits), value);
  out->append(digits, end);
}

void AppendFixed(double value, int decimals, std::string* out) {
  static constexpr int64_t kScales[] = {1,       10,        100,        1'000,       10'000,
                                        100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};
  const int64_t scale = kScales[decimals];
  int64_t scaled = std::llround(value * static_cast<double>(scale));
  if (scaled == 0) {
    out->push_back('0');
    return;
  }
  if (scaled < 0) {
    out->push_back('-');
    scaled = -scaled;
  }
  AppendInteger(scaled / scale, out);
  out->push_back('.');
  int64_t fraction = scaled % scale;
  char digits[10];
  for (int i = decimals - 1; i >= 0; --i) {
    digits[i] = static_cast<char>('0' + fraction % 10);
    fraction /= 10;
  }
  out->append(digits, static_cast<size_t>(decimals));
}

}  // namespace dsg::ingest
