// SPDX-License-Identifier: Apache-2.0
#include "server/http/access_rules.h"

#include <gtest/gtest.h>

#include <set>

#include "server/access/access_control.h"

namespace dsg::server {
namespace {

constexpr char kHost[] = "127.0.0.1:8080";

ListenAddress Port(int port) {
  ListenAddress address;
  address.host = "127.0.0.1";
  address.port = port;
  return address;
}

RequestHead Head(std::string_view method,
                 std::vector<std::pair<std::string_view, std::string_view>> fields) {
  return {method, "/dsg.v1.MapService/ListMaps", std::move(fields)};
}

// The status of the answer, 0 if the request may pass.
int StatusOf(const AccessRules& rules, const RequestHead& head) {
  const auto refusal = rules.Check(head);
  if (!refusal.has_value()) return 0;
  EXPECT_FALSE(refusal->error.ok());
  return refusal->http_status;
}

TEST(AccessRules, TakeOwnNamesWithTheOwnPort) {
  const AccessRules rules(Port(8080), {"Maps.example.org", "proxy:8443"}, "");
  for (const char* host : {"127.0.0.1:8080", "localhost:8080", "LOCALHOST:8080", "[::1]:8080",
                           "maps.example.org", "maps.example.org:8080", "proxy:8443"}) {
    EXPECT_EQ(StatusOf(rules, Head("GET", {{"Host", host}})), 0) << host;
  }
  for (const char* host : {"", "127.0.0.1", "127.0.0.1:80", "127.0.0.1:80801", "localhost",
                           "evil.example", "evil.example:8080", "localhost:8080.evil.example",
                           "proxy", "proxy:8080", "maps.example.org:1", "localhost:8080 "}) {
    EXPECT_EQ(StatusOf(rules, Head("GET", {{"Host", host}})), 421) << host;
  }
  EXPECT_EQ(StatusOf(rules, Head("GET", {})), 421);
  EXPECT_EQ(StatusOf(AccessRules(Port(80), {}, ""), Head("GET", {{"host", "localhost"}})), 0);
}

TEST(AccessRules, TakeAnyNameOnAUnixSocket) {
  ListenAddress address;
  address.socket_path = "dsg.http";
  const AccessRules rules(address, {}, "");
  EXPECT_EQ(StatusOf(rules, Head("POST", {{"Host", "localhost"}})), 0);
  EXPECT_EQ(StatusOf(rules, Head("POST", {{"Host", "a"}, {"Origin", "https://a"}})), 0);
  EXPECT_EQ(StatusOf(rules, Head("POST", {{"Host", "a"}, {"Origin", "https://b"}})), 403);
}

TEST(AccessRules, RefusePagesOfOtherSites) {
  const AccessRules rules(Port(8080), {}, "");
  const auto with = [&](std::string_view name, std::string_view value) {
    return StatusOf(rules, Head("POST", {{"Host", kHost}, {name, value}}));
  };
  EXPECT_EQ(with("Origin", "http://127.0.0.1:8080"), 0);
  EXPECT_EQ(with("Origin", "https://127.0.0.1:8080"), 0);
  for (const char* origin :
       {"null", "", "http://127.0.0.1", "http://localhost:8080", "http://127.0.0.1:8081",
        "http://evil.example", "http://127.0.0.1:8080.evil.example", "file://"}) {
    EXPECT_EQ(with("Origin", origin), 403) << origin;
  }
  EXPECT_EQ(with("Sec-Fetch-Site", "same-origin"), 0);
  EXPECT_EQ(with("Sec-Fetch-Site", "none"), 0);
  for (const char* site : {"cross-site", "same-site", "", "None"}) {
    EXPECT_EQ(with("Sec-Fetch-Site", site), 403) << site;
  }
}

TEST(AccessRules, AskCallsForTheToken) {
  const auto token = MakeToken();
  ASSERT_TRUE(token.ok());
  const AccessRules rules(Port(8080), {}, *token);
  const auto with = [&](const std::string& value) {
    return StatusOf(rules, Head("POST", {{"Host", kHost}, {"Authorization", value}}));
  };
  EXPECT_EQ(with("Bearer " + *token), 0);
  std::string other = *token;
  other.back() = other.back() == 'A' ? 'B' : 'A';
  for (const std::string& value :
       {std::string(), std::string("Bearer "), "Bearer " + other, "Bearer " + *token + "A",
        "Bearer " + token->substr(1), "bearer " + *token, *token, "Basic " + *token}) {
    EXPECT_EQ(with(value), 401) << value;
  }
  EXPECT_EQ(StatusOf(rules, Head("POST", {{"Host", kHost}})), 401);
  // A page has to load before it can show the token.
  EXPECT_EQ(StatusOf(rules, Head("GET", {{"Host", kHost}})), 0);
}

TEST(AccessRules, TokensAreLongAndNeverTheSame) {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) tokens.insert(*MakeToken());
  EXPECT_EQ(tokens.size(), 100u);
  EXPECT_EQ(tokens.begin()->size(), 43u);
  EXPECT_EQ(tokens.begin()->find_first_of("+/= #&"), std::string::npos);
}

TEST(AccessRules, RefuseOtherMethods) {
  const AccessRules rules(Port(8080), {}, "");
  for (const char* method : {"GET", "HEAD", "POST"}) {
    EXPECT_EQ(StatusOf(rules, Head(method, {{"Host", kHost}})), 0) << method;
  }
  for (const char* method : {"PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "get", "X"}) {
    EXPECT_EQ(StatusOf(rules, Head(method, {{"Host", kHost}})), 405) << method;
  }
}

TEST(AccessRules, RefuseWhatProxiesMayReadOtherwise) {
  const AccessRules rules(Port(8080), {}, "");
  const auto with = [&](std::vector<std::pair<std::string_view, std::string_view>> fields) {
    fields.emplace_back("Host", kHost);
    return StatusOf(rules, Head("POST", std::move(fields)));
  };
  EXPECT_EQ(with({{"Transfer-Encoding", "chunked"}}), 0);
  EXPECT_EQ(with({{"Transfer-Encoding", "chunked"}, {"Content-Length", "3"}}), 400);
  EXPECT_EQ(with({{"Transfer-Encoding", "gzip, chunked"}}), 501);
  EXPECT_EQ(with({{"Transfer-Encoding", "identity"}}), 501);
  EXPECT_EQ(with({{"Host", kHost}}), 400);
  EXPECT_EQ(with({{"Content-Length", "3"}, {"content-length", "3"}}), 400);
  EXPECT_EQ(with({{"Authorization", "a"}, {"authorization", "b"}}), 400);
  const std::string target(kTargetBytesMax + 1, '/');
  EXPECT_EQ(StatusOf(rules, {"GET", target, {{"Host", kHost}}}), 414);
}

}  // namespace
}  // namespace dsg::server
