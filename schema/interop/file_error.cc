// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/file_error.h"

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {

absl::Status FileError(const std::string& file, const std::string& where, std::string_view what) {
  return MakeError(Reason::kFileMalformed, absl::StrCat(file, ": ", where, ": ", std::string(what)),
                   {{"file", file}, {"where", where}});
}

}  // namespace dsg
