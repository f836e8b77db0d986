// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "ingest/agents/detector/onnx_check.h"
#include "ingest/agents/detector/person_detector.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/agents/detector/onnx_writer.h"
#include "tests/unit/ingest/agents/detector/tiny_detector.h"

namespace dsg::ingest {
namespace {

using Output = TinyDetector::Output;

class BadModelTest : public testing::Test {
 protected:
  std::string Write(const std::string& bytes) const {
    std::string file = folder_.path() + "/bad.onnx";
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
    return file;
  }

  absl::Status LoadBytes(const std::string& bytes) const {
    return LoadFile({.model_file = Write(bytes),
                     .input_width_px = kTinyInputPx,
                     .input_height_px = kTinyInputPx});
  }

  absl::Status LoadFile(const PersonDetectorOptions& options) const {
    return PersonDetector::Load(options).status();
  }

  const std::string& path() const { return folder_.path(); }

 private:
  test::TempFolder folder_;
};

bool Contains(const absl::Status& status, const std::string& words) {
  return std::string(status.message()).find(words) != std::string::npos;
}

TEST_F(BadModelTest, IsNotFoundWhenMissing) {
  const absl::Status status = LoadFile({.model_file = path() + "/none.onnx"});
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
}

TEST_F(BadModelTest, IsMalformedWhenEmptyAFolderOrNoOnnx) {
  EXPECT_EQ(ReasonOf(LoadFile({.model_file = path()})), Reason::kFileMalformed);
  for (const std::string& bytes :
       {std::string(), std::string("a picture of a cat"), std::string(4096, '\0'),
        std::string(4096, '\xff'), std::string("\x08\x08", 2),
        WireMessage().Number(1, 8).Message(7, WireMessage()).bytes()}) {
    const absl::Status status = LoadBytes(bytes);
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
    EXPECT_TRUE(Contains(status, "bad.onnx")) << status;
  }
}

TEST_F(BadModelTest, IsMalformedWhenCutAnywhere) {
  const std::string whole = MakeTinyDetector({});
  const uint64_t seed = test::TestSeed(62);
  Random random(seed, 0);
  for (int i = 0; i < 200; ++i) {
    // The end says which version of ONNX; without it OpenCV still reads the rest.
    const size_t size = static_cast<size_t>(random.Index(static_cast<int>(whole.size()) - 20));
    EXPECT_EQ(ReasonOf(LoadBytes(whole.substr(0, size))), Reason::kFileMalformed)
        << "seed " << seed << " cut to " << size;
  }
}

TEST_F(BadModelTest, IsMalformedWhenOfRandomBytes) {
  const uint64_t seed = test::TestSeed(63);
  Random random(seed, 0);
  for (int i = 0; i < 500; ++i) {
    std::string bytes(static_cast<size_t>(random.Integer(1, 400)), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random.Index(256));
    EXPECT_FALSE(CheckOnnx(bytes).ok()) << "seed " << seed << " case " << i;
    EXPECT_EQ(ReasonOf(LoadBytes(bytes)), Reason::kFileMalformed);
  }
}

TEST_F(BadModelTest, IsMalformedWhenTooLarge) {
  const std::string file = Write("x");
  // A hole, which takes no room on the disk.
  std::filesystem::resize_file(file, (uintmax_t{1} << 30) + 1);
  const absl::Status status = LoadFile({.model_file = file});
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
  EXPECT_TRUE(Contains(status, "1073741824")) << status;
}

std::string OneTensor(const WireMessage& tensor) {
  return WireMessage().Number(1, 8).Message(7, WireMessage().Message(5, tensor)).bytes();
}

TEST_F(BadModelTest, IsMalformedWhenATensorIsNotAsLargeAsItSays) {
  const std::vector<float> four(4);
  EXPECT_TRUE(CheckOnnx(OneTensor(FloatTensor("w", {2, 2}, four))).ok());
  EXPECT_TRUE(CheckOnnx(OneTensor(FloatTensor("w", {4, 0}, {}))).ok());
  const std::vector<std::vector<int64_t>> shapes = {
      {5}, {3}, {2, 3}, {-4}, {int64_t{1} << 62, 4}, {1 << 20, 1 << 20}, {0}, {-2, -2}};
  for (const std::vector<int64_t>& shape : shapes) {
    const absl::Status status = LoadBytes(OneTensor(FloatTensor("w", shape, four)));
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
    EXPECT_TRUE(Contains(status, "tensor \"w\"")) << status;
  }
  const std::string external = OneTensor(FloatTensor("w", {2, 2}, {}).Number(14, 1));
  EXPECT_TRUE(Contains(LoadBytes(external), "as one file")) << LoadBytes(external);
}

TEST_F(BadModelTest, IsMalformedWhenAStepNeedsWhatNothingMakes) {
  OnnxWriter onnx;
  onnx.AddInput("images", {1, 3, 64, 64});
  onnx.AddNode("Concat", {"images", "other"}, "output", {{"axis", {1}, false}});
  onnx.AddNode("Relu", {"images"}, "other");
  onnx.AddOutput("output", {1, 6, 64, 64});
  const absl::Status status = LoadBytes(onnx.Bytes());
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
  EXPECT_TRUE(Contains(status, "tensor \"other\"")) << status;
}

TEST_F(BadModelTest, IsMalformedWhenAStepWouldEndTheProcess) {
  for (const std::string type : {"ArgMax", "ArgMin", "Equal", "Greater", "Less", "CumSum"}) {
    OnnxWriter onnx;
    onnx.AddInput("images", {1, 3, 64, 64});
    onnx.AddFloats("a", {2}, {1.0f, 2.0f});
    onnx.AddFloats("b", {2}, {2.0f, 1.0f});
    onnx.AddNode(type, {"a", type == "CumSum" ? "images" : "b"}, "output");
    onnx.AddOutput("output", {2});
    const absl::Status status = LoadBytes(onnx.Bytes());
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
    EXPECT_TRUE(Contains(status, type)) << status;
  }
}

TEST_F(BadModelTest, IsMalformedWhenGraphsNestForever) {
  WireMessage graph;
  for (int i = 0; i < 1000; ++i) {
    const WireMessage attribute = WireMessage().Message(6, graph);
    graph = WireMessage().Message(1, WireMessage().Message(5, attribute));
  }
  const absl::Status status = LoadBytes(WireMessage().Message(7, graph).bytes());
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
  EXPECT_TRUE(Contains(status, "too deep")) << status;
}

TEST_F(BadModelTest, IsMalformedWithItsShapeWhenThatIsNotKnown) {
  const absl::Status square = LoadBytes(MakeTinyDetector({.output = Output::kSquare}));
  EXPECT_EQ(ReasonOf(square), Reason::kFileMalformed);
  EXPECT_TRUE(Contains(square, "[1, 16, 16]")) << square;
  const absl::Status map = LoadBytes(MakeTinyDetector({.output = Output::kMap}));
  EXPECT_EQ(ReasonOf(map), Reason::kFileMalformed);
  EXPECT_TRUE(Contains(map, "[1, 1, 16, 16]")) << map;
  const absl::Status two =
      LoadBytes(MakeTinyDetector({.output = Output::kMap, .has_raw_output = true}));
  EXPECT_EQ(ReasonOf(two), Reason::kFileMalformed);
  EXPECT_TRUE(Contains(two, "[1, 2, 16, 16]")) << two;
}

TEST_F(BadModelTest, IsMalformedWhenItTakesNoColourImages) {
  const absl::Status status = LoadBytes(MakeTinyDetector({.channel_count = 2}));
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
}

TEST_F(BadModelTest, IsToldWhenItsInputHasAnotherSize) {
  PersonDetectorOptions options{.model_file = Write(MakeTinyDetector({}))};
  const absl::Status status = LoadFile(options);
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
  EXPECT_TRUE(Contains(status, "640 x 640")) << status;
}

TEST_F(BadModelTest, OptionsThatMeanNothingAreNamed) {
  PersonDetectorOptions good{.model_file = Write(MakeTinyDetector({})),
                             .input_width_px = kTinyInputPx,
                             .input_height_px = kTinyInputPx};
  EXPECT_TRUE(LoadFile(good).ok()) << LoadFile(good);
  std::vector<PersonDetectorOptions> bad(6, good);
  bad[0].input_width_px = 0;
  bad[1].input_height_px = 100'000;
  bad[2].score_min = 1.5;
  bad[3].overlap_max = -0.1;
  bad[4].person_class = -1;
  bad[5].person_class = 2;
  for (const PersonDetectorOptions& options : bad) {
    EXPECT_EQ(ReasonOf(LoadFile(options)), Reason::kFieldInvalid) << LoadFile(options);
  }
}

TEST_F(BadModelTest, WithBytesFlippedLoadsOrIsRefused) {
  const uint64_t seed = test::TestSeed(64);
  Random random(seed, 0);
  const std::string whole = MakeTinyDetector({.output = Output::kSsd});
  int refused_count = 0;
  for (int i = 0; i < 300; ++i) {
    std::string bytes = whole;
    for (int k = random.Integer(1, 3); k > 0; --k) {
      bytes[static_cast<size_t>(random.Index(static_cast<int>(bytes.size())))] =
          static_cast<char>(random.Index(256));
    }
    refused_count += LoadBytes(bytes).ok() ? 0 : 1;
  }
  EXPECT_GT(refused_count, 0);
}

}  // namespace
}  // namespace dsg::ingest
