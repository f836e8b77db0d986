// SPDX-License-Identifier: Apache-2.0
#include "query/client/remote_api.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::client {
namespace {

TEST(Channel, TakesSocketsAndHostsWithPorts) {
  for (const char* address :
       {"unix:/run/dsg.sock", "unix:dsg.sock", "localhost:7070", "127.0.0.1:1", "[::1]:65535"}) {
    EXPECT_TRUE(CheckAddress(address).ok()) << address;
  }
}

TEST(Channel, RefusesOtherAddressesNamingThem) {
  const std::string endless = "unix:/" + std::string(120, 'x');
  for (const std::string address : {"", "unix:", "localhost", "localhost:", ":7070", "localhost:0",
                                    "localhost:65536", "localhost:http", endless.c_str()}) {
    const auto api = Connect(address);
    ASSERT_FALSE(api.ok()) << address;
    EXPECT_EQ(ReasonOf(api.status()), Reason::kFieldInvalid) << address;
    EXPECT_EQ(MetadataOf(api.status())["value"], address);
  }
}

}  // namespace
}  // namespace dsg::client
