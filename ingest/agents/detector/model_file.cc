// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/model_file.h"

#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "ingest/agents/detector/onnx_check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr uintmax_t kModelBytesMax = uintmax_t{1} << 30;

}  // namespace

absl::Status BadModel(const std::string& file, const std::string& what) {
  return MakeError(Reason::kFileMalformed, absl::StrCat("model ", file, ": ", what),
                   {{"file", file}});
}

absl::StatusOr<std::vector<uint8_t>> ReadModelFile(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) {
    return absl::NotFoundError(absl::StrCat("model \"", file, "\" does not exist; check the path"));
  }
  if (status.type() != fs::file_type::regular) {
    return BadModel(file, "is not a regular file; give an ONNX file");
  }
  const uintmax_t size = fs::file_size(file, error);
  if (error) return BadModel(file, absl::StrCat("cannot be read: ", error.message()));
  if (size == 0) return BadModel(file, "is empty; was the copy cut short?");
  if (size > kModelBytesMax) {
    return BadModel(file, absl::StrCat("has ", size, " bytes; at most ", kModelBytesMax,
                                       " are read, so export a smaller network"));
  }
  std::ifstream in(file, std::ios::binary);
  std::vector<uint8_t> bytes(size);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!in) return BadModel(file, "cannot be read to its end; check its permissions and the disk");
  const absl::Status check = CheckOnnx({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!check.ok()) return BadModel(file, std::string(check.message()));
  return bytes;
}

}  // namespace dsg::ingest
