// SPDX-License-Identifier: Apache-2.0
#include "ingest/files/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;

std::string PartPath(const std::string& path) { return path + ".part"; }

}  // namespace

absl::StatusOr<OutputFile> OutputFile::Create(const std::string& path) {
  std::FILE* file = std::fopen(PartPath(path).c_str(), "wb");
  if (file == nullptr) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("cannot create ", PartPath(path), ": ", std::strerror(errno),
                                  "; name a folder you may write to"),
                     {{"path", path}});
  }
  // We keep our own buffer; a second copy in the library would only cost time.
  std::setvbuf(file, nullptr, _IONBF, 0);
  return OutputFile(path, file);
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  file_.reset();
  std::remove(PartPath(path_).c_str());
}

absl::Status OutputFile::Failure(const char* what) const {
  const int error = errno;
  const std::string message = absl::StrCat("cannot ", what, " ", path_, ": ", std::strerror(error));
  if (error == ENOSPC || error == EDQUOT) {
    return MakeError(Reason::kDiskFull, absl::StrCat(message, "; free some space"),
                     {{"path", path_}});
  }
  return absl::UnavailableError(message);
}

absl::Status OutputFile::WriteBuffer() {
  if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) != buffer_.size()) {
    return Failure("write");
  }
  byte_count_ += static_cast<int64_t>(buffer_.size());
  buffer_.clear();
  return absl::OkStatus();
}

absl::Status OutputFile::Flush() {
  return buffer_.size() < kBufferBytes ? absl::OkStatus() : WriteBuffer();
}

absl::Status OutputFile::Commit() {
  DSG_RETURN_IF_ERROR(WriteBuffer());
  if (fsync(fileno(file_.get())) != 0) return Failure("sync");
  // Closed by hand, since closing may be what fails.
  if (std::fclose(file_.release()) != 0) return Failure("close");
  if (std::rename(PartPath(path_).c_str(), path_.c_str()) != 0) return Failure("rename to");
  return absl::OkStatus();
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
