// SPDX-License-Identifier: Apache-2.0
// The JSON tree builder's limits and the UTF-8 check.
#include "schema/interop/json_cursor.h"

#include <gtest/gtest.h>

#include "schema/base/utf8.h"
#include "schema/interop/file_errors.h"
#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

TEST(JsonDocument, KeepsEveryBitOf64BitIntegers) {
  const auto json =
      ParseJson("[18446744073709551615, 5692549928996306945, -9223372036854775808]", "f.json");
  ASSERT_TRUE(json.ok()) << json.status();
  EXPECT_EQ((*json)[0].get<uint64_t>(), 18446744073709551615u);
  EXPECT_EQ((*json)[1].get<uint64_t>(), 5692549928996306945u);
  EXPECT_EQ((*json)[2].get<int64_t>(), std::numeric_limits<int64_t>::min());
}

TEST(JsonDocument, ReadsNestedValuesOfEveryType) {
  const auto json = ParseJson(R"({"a": [1, {"b": null}, [true, "x"], -2.5]})", "f.json");
  ASSERT_TRUE(json.ok()) << json.status();
  EXPECT_EQ(json->dump(), R"({"a":[1,{"b":null},[true,"x"],-2.5]})");
}

TEST(JsonDocument, RefusesTextCutAtAnyByteNamingTheFile) {
  const std::string text = R"({"nodes": [{"id": 5, "x": [1.5, true, null, "tail"]}], "e": {}})";
  for (size_t size = 0; size < text.size(); ++size) {
    const auto json = ParseJson(text.substr(0, size), "f.json");
    ASSERT_FALSE(json.ok()) << size;
    ExpectMalformed(json.status(), "f.json: byte ");
  }
}

TEST(JsonDocument, RefusesADuplicateKeyNamingIt) {
  ExpectMalformed(ParseJson(R"({"id": 1, "x": {"id": 2}, "id": 3})", "f.json").status(),
                  "key \"id\"");
}

TEST(JsonDocument, AllowsNestingUpToTheLimitAndRefusesOneMore) {
  const auto nested = [](size_t depth) {
    return std::string(depth, '[') + std::string(depth, ']');
  };
  EXPECT_TRUE(ParseJson(nested(kJsonDepthMax), "f.json").ok());
  ExpectMalformed(ParseJson(nested(kJsonDepthMax + 1), "f.json").status(), "nested deeper");
  ExpectMalformed(ParseJson(std::string(5'000'000, '['), "f.json").status(), "nested deeper");
}

TEST(JsonDocument, RefusesWhatIsNotJson) {
  for (const char* text : {"", "{]", "[1,]", "[NaN]", "[1e999]", "{} {}", "[\"\xff\"]"}) {
    EXPECT_FALSE(ParseJson(text, "f.json").ok()) << text;
  }
}

std::string WithoutUsual(const std::string& text) {
  const UsualMembers usual{"attributes", {{"list", "[]"}, {"flag", "false"}, {"size", "0.0"}}};
  JsonCursor cursor(text, "f.json");
  const nlohmann::json value = cursor.Value(&usual);
  cursor.End();
  return cursor.ok() ? value.dump() : std::string(cursor.status().message());
}

TEST(JsonCursor, LeavesOutUsualMembersOfTheNamedObjectOnly) {
  EXPECT_EQ(WithoutUsual(R"({"attributes": {"flag":false, "list": [],"size":0.0}, "flag":false})"),
            R"({"attributes":{},"flag":false})");
  EXPECT_EQ(WithoutUsual(R"({"attributes":{"a":{"flag":false},"attributes":{"flag":false}}})"),
            R"({"attributes":{"a":{"flag":false},"attributes":{"flag":false}}})");
  EXPECT_EQ(WithoutUsual(R"({"x":{"attributes":{"flag":false}}})"),
            R"({"x":{"attributes":{"flag":false}}})");
}

TEST(JsonCursor, KeepsMembersThatOnlyBeginAsUsual) {
  const std::string other = R"({"attributes":{"flag":true,"list":[1],"size":0.05}})";
  EXPECT_EQ(WithoutUsual(other), other);
  EXPECT_EQ(WithoutUsual(R"({"attributes":{"list":[ ],"size":0.0 }})"),
            R"({"attributes":{"list":[],"size":0.0}})");
}

TEST(JsonCursor, RefusesADuplicateOfWhatItLeftOut) {
  for (const char* text : {R"({"attributes":{"flag":false,"flag":true}})",
                           R"({"attributes":{"flag":true,"flag":false}})",
                           R"({"attributes":{"flag":false,"list":[],"flag":false}})"}) {
    EXPECT_NE(WithoutUsual(text).find("key \"flag\""), std::string::npos) << text;
  }
}

TEST(Utf8, AcceptsWellFormedTextAndRefusesTheRest) {
  for (const char* good :
       {"", "chair", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80", "\xf4\x8f\xbf\xbf"}) {
    EXPECT_TRUE(IsUtf8(good)) << good;
  }
  for (const char* bad : {"\x80", "\xc0\xaf", "\xc3", "\xe2\x82", "\xe0\x80\xaf", "\xed\xa0\x80",
                          "\xf0\x80\x80\x80", "\xf4\x90\x80\x80", "\xff", "a\xc3(b"}) {
    EXPECT_FALSE(IsUtf8(bad)) << bad;
  }
}

}  // namespace
}  // namespace dsg
