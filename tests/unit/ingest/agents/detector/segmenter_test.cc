// SPDX-License-Identifier: Apache-2.0
// Classes of pixels by a network: what its outputs mean, and which networks are refused.
#include "ingest/agents/detector/segmenter.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/agents/detector/tiny_detector.h"
#include "tests/unit/ingest/agents/detector/tiny_segmenter.h"

namespace dsg::ingest {
namespace {

constexpr uint16_t kRed = 11 << 8;
constexpr uint16_t kGreen = 12 << 8;
constexpr uint16_t kBlue = 13 << 8;

class SegmenterTest : public testing::Test {
 protected:
  SegmenterOptions Options(const std::string& model) const {
    SegmenterOptions options;
    options.model_file = folder_.path() + "/model.onnx";
    std::ofstream(options.model_file, std::ios::binary) << model;
    options.input_width_px = options.input_height_px = 32;
    options.label_of_class = {0, kRed, kGreen, kBlue};
    options.classes_file = "classes.csv";
    return options;
  }
  void ExpectRefused(const SegmenterOptions& options, Reason reason,
                     const std::vector<std::string>& words) const {
    const absl::Status refused = Segmenter::Load(options).status();
    EXPECT_EQ(ReasonOf(refused), reason) << refused;
    for (const std::string& word : words) {
      EXPECT_NE(refused.message().find(word), std::string::npos) << word << ": " << refused;
    }
  }
  test::TempFolder folder_;
};

// Left half red, right half green, and a blue stripe below; wider than the network's input.
Image ThreeColors() {
  Image image = BlankImage(80, 40);
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 80; ++column) {
      const int channel = row >= 32 ? 2 : (column < 40 ? 0 : 1);
      image.bytes[image.Offset(column, row) + static_cast<size_t>(channel)] = 250;
    }
  }
  return image;
}

void ExpectThreeColors(const absl::StatusOr<Image>& label) {
  ASSERT_TRUE(label.ok()) << label.status();
  ASSERT_EQ(label->format, PixelFormat::kLabel16);
  ASSERT_EQ(label->width, 80);
  ASSERT_EQ(label->height, 40);
  EXPECT_EQ(LabelAt(*label, 0, 0), kRed);
  EXPECT_EQ(LabelAt(*label, 30, 25), kRed);
  EXPECT_EQ(LabelAt(*label, 79, 0), kGreen);
  EXPECT_EQ(LabelAt(*label, 50, 25), kGreen);
  EXPECT_EQ(LabelAt(*label, 0, 39), kBlue);
  EXPECT_EQ(LabelAt(*label, 79, 39), kBlue);
}

TEST_F(SegmenterTest, TellsColoursApartInEveryForm) {
  using Map = TinySegmenter::Output;
  for (const Map output : {Map::kScores, Map::kNumbers, Map::kFlatNumbers}) {
    for (const int stride : {1, 2}) {
      SCOPED_TRACE(absl::StrCat(static_cast<int>(output), " stride ", stride));
      auto segmenter =
          Segmenter::Load(Options(MakeTinySegmenter({.output = output, .stride_px = stride})));
      ASSERT_TRUE(segmenter.ok()) << segmenter.status();
      ExpectThreeColors((*segmenter)->Segment(ThreeColors()));
      // A dark one is of class 0, which is unknown here.
      EXPECT_EQ(LabelAt(*(*segmenter)->Segment(BlankImage(8, 8)), 3, 3), 0);
    }
  }
}

TEST_F(SegmenterTest, MakesItsInputAsItIsTold) {
  // Grey of 100: below the mean it is dark, as it is; in a quarter of the scale it is dark too.
  SegmenterOptions options = Options(MakeTinySegmenter({}));
  Image red = BlankImage(32, 32);
  for (size_t i = 0; i < red.bytes.size(); i += 3) red.bytes[i] = 100;
  const auto label_of = [&] {
    const auto segmenter = Segmenter::Load(options);
    EXPECT_TRUE(segmenter.ok()) << segmenter.status();
    return LabelAt(*(*segmenter)->Segment(red), 5, 5);
  };
  EXPECT_EQ(label_of(), kRed);
  options.mean = {90.0, 0.0, 0.0};
  EXPECT_EQ(label_of(), 0);
  options.mean = {0.0, 0.0, 0.0};
  options.scale[0] /= 4.0;
  EXPECT_EQ(label_of(), 0);
}

TEST_F(SegmenterTest, IsAskedByManyThreads) {
  const auto segmenter = Segmenter::Load(Options(MakeTinySegmenter({})));
  ASSERT_TRUE(segmenter.ok()) << segmenter.status();
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 10; ++k) ExpectThreeColors((*segmenter)->Segment(ThreeColors()));
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(SegmenterTest, RefusesNetworksThatAreNoneOfThese) {
  using Map = TinySegmenter::Output;
  SegmenterOptions options = Options(MakeTinySegmenter({}));
  options.label_of_class.push_back(0);
  ExpectRefused(options, Reason::kFileMalformed,
                {"model.onnx", "tells 4 classes apart, classes.csv lists 5"});
  ExpectRefused(Options(MakeTinySegmenter({.output = Map::kTable})), Reason::kFileMalformed,
                {"model.onnx", "no map of an input of 32 x 32"});
  ExpectRefused(Options(MakeTinySegmenter({.has_second_output = true})), Reason::kFileMalformed,
                {"2 are maps of classes, and exactly one must be"});
  ExpectRefused(Options(MakeTinyDetector({})), Reason::kFileMalformed, {"model.onnx"});
  ExpectRefused(Options("no network"), Reason::kFileMalformed, {"model.onnx"});
  const std::string whole = MakeTinySegmenter({});
  ExpectRefused(Options(whole.substr(0, whole.size() / 2)), Reason::kFileMalformed, {"model.onnx"});
  options = Options(whole);
  options.model_file = folder_.path() + "/none.onnx";
  EXPECT_TRUE(absl::IsNotFound(Segmenter::Load(options).status()));
}

TEST_F(SegmenterTest, RefusesOptionsOutOfBounds) {
  SegmenterOptions options = Options(MakeTinySegmenter({}));
  options.input_width_px = 0;
  ExpectRefused(options, Reason::kFieldInvalid, {"input size is 0 x 32"});
  options = Options(MakeTinySegmenter({}));
  options.scale[1] = 0.0;
  ExpectRefused(options, Reason::kFieldInvalid, {"scale is 0"});
  options = Options(MakeTinySegmenter({}));
  options.label_of_class.clear();
  ExpectRefused(options, Reason::kFieldInvalid, {"list of classes is empty"});
  const auto segmenter = Segmenter::Load(Options(MakeTinySegmenter({})));
  ASSERT_TRUE(segmenter.ok()) << segmenter.status();
  EXPECT_EQ(ReasonOf((*segmenter)->Segment(BlankImage(8, 8, PixelFormat::kDepth16)).status()),
            Reason::kFieldInvalid);
  Image cut = BlankImage(8, 8);
  cut.bytes.pop_back();
  EXPECT_EQ(ReasonOf((*segmenter)->Segment(cut).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
