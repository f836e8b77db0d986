// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/json_document.h"

namespace dsg {

absl::StatusOr<nlohmann::json> ParseJson(std::string_view bytes, const std::string& file) {
  JsonCursor cursor(bytes, file);
  nlohmann::json root = cursor.Value();
  cursor.End();
  if (!cursor.ok()) return cursor.status();
  return root;
}

}  // namespace dsg
