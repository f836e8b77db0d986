// SPDX-License-Identifier: Apache-2.0
// Packed JSON and attributes: the same text comes back, whatever it is, and damage is refused.
#include "schema/codec/json_pack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "schema/base/random.h"
#include "schema/codec/attribute_codec.h"

namespace dsg {
namespace {

constexpr const char* kTexts[] = {
    "{}",
    "[]",
    R"({"fields":{"bounding_box":[3486761403,null,true],"orientation":[true,{"w":4.6e-310}]}})",
    R"({"mesh_connections":[238070890,[0,1,2,50,7,4294967295,9223372036854775807]]})",
    R"([0,-1,127,128,-9223372036854775808,18446744073709551615,1e+300,-0.5,3.0,-2.0,0.1])",
    R"([1,2.5,3])",
    R"([1,2,3.5])",
    R"([1,2,"three"])",
    // The library that writes JSON is at times a digit off the shortest.
    R"([-10.84999942779541,-4.350000381469727,1.6817398071289063])",
    R"([4.6e-310,4.7e-310,4.8e-310])",
    R"([0.1,0.2,0.30000000000000004])",
    R"([0.5,0.0,0.25])",
    R"({"w":4.6e-310,"x":4.7e-310,"y":4.8e-310,"z":4.9e-310})",
    R"({"w":0.5,"x":0.5,"y":-0.5,"z":0.5})",
    R"({"w":0.5,"x":0.5,"y":-0.5,"z":0.5,"a":1})",
    R"(["a \"quoted\" text","",null,false,{"own key":{"w":1.0,"x":0.0,"y":0.0,"z":0.0}}])",
    R"([-0,1E5,1.50,007,0.30000001192092896,123456789012345678901234567890])",
    R"({"w":1.0,"x":0.0,"y":0.0,"z":0.0})",
    R"([{"a":255,"b":0,"g":0,"r":0},{"a":255,"b":0,"g":0,"r":1},[[],[{}]]])",
};

TEST(JsonPack, GivesTheSameTextBack) {
  for (const std::string text : kTexts) {
    SCOPED_TRACE(text);
    std::string packed = "before";
    ASSERT_TRUE(PackJson(text, &packed));
    ByteReader in(std::string_view(packed).substr(6));
    std::string back = "before";
    ASSERT_TRUE(UnpackJson(&in, &back));
    EXPECT_EQ(back, "before" + text);
    EXPECT_EQ(in.remaining(), 0u);
  }
}

std::string RandomText(int depth, Random* random) {
  const int kind = static_cast<int>(random->Index(depth > 3 ? 8 : 11));
  if (kind == 0) return std::to_string(random->Index(300));
  if (kind == 1) return "-" + std::to_string(1 + random->Index(1 << 30));
  if (kind == 2) return std::to_string(random->Uniform(-9, 9));
  if (kind == 3) return std::to_string(random->Index(9)) + ".0";
  if (kind == 4) return "0.5";
  if (kind == 5) return random->Chance(0.5) ? "null" : "true";
  if (kind == 6) return "\"text \\\" " + std::to_string(random->Index(9)) + "\"";
  if (kind == 7) return "{\"w\":0.25,\"x\":" + RandomText(9, random) + ",\"y\":1e-310,\"z\":0.1}";
  const auto count = random->Index(6);
  std::string text = kind == 8 ? "{" : "[";
  for (int64_t i = 0; i < count; ++i) {
    if (i > 0) text += ",";
    if (kind == 8) text += (i == 0 ? "\"type\":" : "\"key" + std::to_string(i) + "\":");
    text += kind == 10 ? std::to_string(random->Index(99)) : RandomText(depth + 1, random);
  }
  return text + (kind == 8 ? "}" : "]");
}

TEST(JsonPack, GivesRandomTextsBack) {
  Random random(41, 0);
  for (int round = 0; round < 20'000; ++round) {
    const std::string text = "[" + RandomText(0, &random) + "," + RandomText(0, &random) + "]";
    std::string packed;
    ASSERT_TRUE(PackJson(text, &packed)) << text;
    ByteReader in(packed);
    std::string back;
    ASSERT_TRUE(UnpackJson(&in, &back)) << text;
    ASSERT_EQ(back, text);
    ASSERT_EQ(in.remaining(), 0u) << text;
  }
}

TEST(JsonPack, LeavesWhatIsNoCompactJsonAlone) {
  for (const std::string text :
       {"", "7", "\"text\"", "{", "[1,2", "[1, 2]", "{\"a\":}", "[1,]", "{} ", "[nul]", "zAAAA",
        "{\"a\" :1}", "[\"open]", "{\"key\":1}}"}) {
    std::string packed = "before";
    EXPECT_FALSE(PackJson(text, &packed)) << text;
    EXPECT_EQ(packed, "before");
  }
  std::string packed;
  EXPECT_FALSE(PackJson(std::string(500, '[') + "1" + std::string(500, ']'), &packed));
}

TEST(JsonPack, WritesWhatIsKeptOfAPlaceInFewBytes) {
  std::string packed;
  ASSERT_TRUE(PackJson(R"({"fields":{"bounding_box":[3486761403,null,true]}})", &packed));
  EXPECT_LE(packed.size(), 16u);
}

TEST(JsonPack, WritesRoundAndTinyDoublesShorter) {
  Random random(3, 0);
  for (const double value : {0.0, -0.0, 0.5, 3.0, 4.6e-310, 0.1, -1e300, M_PI,
                             std::numeric_limits<double>::infinity(), random.Uniform(-1, 1)}) {
    std::string bytes;
    const DoubleForm form = ShortestForm(value);
    AppendDouble(form, value, &bytes);
    EXPECT_LE(bytes.size(), 8u);
    ByteReader in(bytes);
    const double back = ReadDouble(form, &in);
    EXPECT_EQ(back, value);
    EXPECT_EQ(std::signbit(back), std::signbit(value));
    EXPECT_EQ(in.remaining(), 0u);
  }
  EXPECT_EQ(ShortestForm(0.5), DoubleForm::kSwappedVarint);
  EXPECT_EQ(ShortestForm(4.6e-310), DoubleForm::kVarint);
  EXPECT_EQ(ShortestForm(0.1), DoubleForm::kFixed);
}

Attributes SampleAttributes() {
  Attributes attributes = {{"real_place", true},
                           {"off", false},
                           {"frontier_scale_x", 4.6e-310},
                           {"n", 0.1},
                           {"text", std::string("plain")},
                           {"empty", std::string()},
                           {"z", std::string("zAAECAw==")},
                           {"zz", std::string("z is a letter")}};
  int number = 0;
  for (const char* text : kTexts)
    attributes["json " + std::to_string(number++)] = std::string(text);
  return attributes;
}

TEST(AttributeCodec, GivesEveryAttributeBack) {
  std::string bytes;
  AppendAttributes(SampleAttributes(), &bytes);
  ByteReader in(bytes);
  Attributes back;
  ASSERT_TRUE(ReadAttributes(&in, &back));
  EXPECT_EQ(back, SampleAttributes());
  EXPECT_EQ(in.remaining(), 0u);
}

TEST(AttributeCodec, RefusesBytesThatAreCut) {
  std::string bytes;
  AppendAttributes(SampleAttributes(), &bytes);
  for (size_t size = 0; size < bytes.size(); ++size) {
    ByteReader in(std::string_view(bytes).substr(0, size));
    Attributes back;
    EXPECT_FALSE(ReadAttributes(&in, &back)) << size;
  }
}

TEST(AttributeCodec, TakesNoHarmFromFlippedBits) {
  Random random(29, 0);
  std::string bytes;
  AppendAttributes(SampleAttributes(), &bytes);
  for (int round = 0; round < 5000; ++round) {
    std::string flipped = bytes;
    for (int flip = 0; flip < 3; ++flip) {
      flipped[static_cast<size_t>(random.Index(static_cast<int>(flipped.size())))] ^=
          static_cast<char>(1 << random.Index(8));
    }
    ByteReader in(flipped);
    Attributes back;
    if (!ReadAttributes(&in, &back)) continue;
    for (const auto& [name, value] : back) {
      const auto* text = std::get_if<std::string>(&value);
      if (text != nullptr) {
        EXPECT_LE(text->size(), kUnpackedJsonMax + bytes.size());
      }
    }
  }
}

}  // namespace
}  // namespace dsg
