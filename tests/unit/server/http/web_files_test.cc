// SPDX-License-Identifier: Apache-2.0
#include "server/http/web_files.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace dsg::server {
namespace {

TEST(WebFiles, HoldTheBytesOfTheTree) {
  const WebFile* const page = FindWebFile("/index.html");
  ASSERT_NE(page, nullptr);
  std::ifstream file(std::string(DSG_SOURCE_DIR) + "/server/web/index.html", std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  EXPECT_EQ(page->bytes, bytes.str());
  EXPECT_EQ(page->type, "text/html; charset=utf-8");
  EXPECT_EQ(FindWebFile("/"), page);
}

TEST(WebFiles, AreFoundByTheirExactPathOnly) {
  for (const char* path : {"", "index.html", "/INDEX.html", "/../index.html", "/index.html?",
                           "/%69ndex.html", "/embed.cmake"}) {
    EXPECT_EQ(FindWebFile(path), nullptr) << path;
  }
}

}  // namespace
}  // namespace dsg::server
