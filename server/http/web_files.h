// SPDX-License-Identifier: Apache-2.0
// The files of server/web, which the build embeds.
#pragma once

#include <string_view>

namespace dsg::server {

struct WebFile {
  /// "/index.html"
  std::string_view path;
  /// The Content-Type.
  std::string_view type;
  /// Changes with the bytes; with its quotes.
  std::string_view etag;
  std::string_view bytes;
};

/// The file that a path names; "/" is the first page. nullptr if there is none.
const WebFile* FindWebFile(std::string_view path);

}  // namespace dsg::server
