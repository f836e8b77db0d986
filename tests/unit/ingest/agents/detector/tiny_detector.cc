// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/agents/detector/tiny_detector.h"

#include <algorithm>
#include <vector>

#include "tests/unit/ingest/agents/detector/onnx_writer.h"

namespace dsg::ingest {
namespace {

using Output = TinyDetector::Output;

constexpr int kStridePx = 4;
constexpr int kGrid = kTinyInputPx / kStridePx;
constexpr int kBoxWidthPx = 8;
constexpr int kBoxHeightPx = 16;
// The box and 2 pixels around it.
constexpr int kKernelWidth = 12;
constexpr int kKernelHeight = 20;
// A sigmoid of gain * (answer - threshold); a full rectangle answers 1, one that is 4 pixels off
// 0.6 at most.
constexpr float kGain = 20.0f;
constexpr float kThreshold = 0.8f;

// Bright inside and dark around it, of one colour channel.
void AddTemplate(int channel, int channel_count, std::vector<float>* weights) {
  constexpr int kInside = kBoxWidthPx * kBoxHeightPx;
  constexpr int kAround = kKernelWidth * kKernelHeight - kInside;
  for (int c = 0; c < channel_count; ++c) {
    for (int y = 0; y < kKernelHeight; ++y) {
      for (int x = 0; x < kKernelWidth; ++x) {
        const bool is_inside = x >= 2 && x < 2 + kBoxWidthPx && y >= 2 && y < 2 + kBoxHeightPx;
        const float weight = is_inside ? 1.0f / kInside : -1.0f / kAround;
        weights->push_back(c == channel ? kGain * weight : 0.0f);
      }
    }
  }
}

// Scores of red and of green.
void AddScores(const TinyDetector& options, OnnxWriter* onnx) {
  std::vector<float> weights;
  AddTemplate(0, options.channel_count, &weights);
  AddTemplate(1, options.channel_count, &weights);
  onnx->AddFloats("weights", {2, options.channel_count, kKernelHeight, kKernelWidth}, weights);
  onnx->AddFloats("bias", {2}, {-kGain * kThreshold, -kGain * kThreshold});
  onnx->AddNode("Conv", {"images", "weights", "bias"}, "answers",
                {{"kernel_shape", {kKernelHeight, kKernelWidth}},
                 {"strides", {kStridePx, kStridePx}},
                 {"pads", {8, 4, 8, 4}}});
  onnx->AddNode(options.has_sigmoid ? "Sigmoid" : "Relu", {"answers"}, "scores");
}

// One number of each cell's box.
template <typename Value>
void AddPlane(const Value& value, std::vector<float>* planes) {
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const float x_px = static_cast<float>(kStridePx * column + 2);
      const float y_px = static_cast<float>(kStridePx * row + 2);
      planes->push_back(static_cast<float>(value(x_px, y_px)));
    }
  }
}

void AddConstant(float number, std::vector<float>* planes) {
  AddPlane([number](float, float) { return number; }, planes);
}

void AddCenters(OnnxWriter* onnx) {
  std::vector<float> planes;
  AddPlane([](float x, float) { return x; }, &planes);
  AddPlane([](float, float y) { return y; }, &planes);
  AddConstant(kBoxWidthPx, &planes);
  AddConstant(kBoxHeightPx, &planes);
  onnx->AddFloats("boxes", {1, 4, kGrid, kGrid}, planes);
}

void AddCorners(OnnxWriter* onnx) {
  constexpr float kPx = 1.0f / kTinyInputPx;
  constexpr float kHalfWidth = 0.5f * kBoxWidthPx;
  constexpr float kHalfHeight = 0.5f * kBoxHeightPx;
  std::vector<float> planes;
  AddPlane([](float x, float) { return (x - kHalfWidth) * kPx; }, &planes);
  AddPlane([](float, float y) { return (y - kHalfHeight) * kPx; }, &planes);
  AddPlane([](float x, float) { return (x + kHalfWidth) * kPx; }, &planes);
  AddPlane([](float, float y) { return (y + kHalfHeight) * kPx; }, &planes);
  onnx->AddFloats("boxes", {1, 4, kGrid, kGrid}, planes);
}

void AddConcat(const std::vector<std::string>& inputs, OnnxWriter* onnx) {
  onnx->AddNode("Concat", inputs, "planes", {{"axis", {1}, false}});
}

void AddReshape(const std::string& input, const std::string& output,
                const std::vector<int64_t>& shape, OnnxWriter* onnx) {
  onnx->AddInts(output + "_shape", shape);
  onnx->AddNode("Reshape", {input, output + "_shape"}, output);
}

// planes [1, C, 16, 16] to rows [1, 256, C].
void AddTable(int column_count, const std::string& output, OnnxWriter* onnx) {
  AddReshape("planes", "columns", {1, column_count, kTinyBoxCount}, onnx);
  onnx->AddNode("Transpose", {"columns"}, output, {{"perm", {0, 2, 1}}});
}

void AddRows(OnnxWriter* onnx) {
  AddCenters(onnx);
  std::vector<float> ones;
  AddConstant(1.0f, &ones);
  onnx->AddFloats("any_object", {1, 1, kGrid, kGrid}, ones);
  AddConcat({"boxes", "any_object", "scores"}, onnx);
  AddTable(7, "output", onnx);
}

// Of reds only: such networks write the class into the row.
void AddSsd(OnnxWriter* onnx) {
  AddCorners(onnx);
  std::vector<float> head;
  AddConstant(0.0f, &head);
  AddConstant(1.0f, &head);
  onnx->AddFloats("image_and_class", {1, 2, kGrid, kGrid}, head);
  onnx->AddFloats("red_weights", {1, 2, 1, 1}, {1.0f, 0.0f});
  onnx->AddNode("Conv", {"scores", "red_weights"}, "red", {{"kernel_shape", {1, 1}}});
  AddConcat({"image_and_class", "red", "boxes"}, onnx);
  AddTable(7, "table", onnx);
  AddReshape("table", "output", {1, 1, kTinyBoxCount, 7}, onnx);
}

void AddHead(Output output, OnnxWriter* onnx) {
  switch (output) {
    case Output::kRows:
      AddRows(onnx);
      onnx->AddOutput("output", {1, kTinyBoxCount, 7});
      break;
    case Output::kColumns:
      AddCenters(onnx);
      AddConcat({"boxes", "scores"}, onnx);
      AddReshape("planes", "output", {1, 6, kTinyBoxCount}, onnx);
      onnx->AddOutput("output", {1, 6, kTinyBoxCount});
      break;
    case Output::kSsd:
      AddSsd(onnx);
      onnx->AddOutput("output", {1, 1, kTinyBoxCount, 7});
      break;
    case Output::kSquare:
    case Output::kMap: {
      onnx->AddFloats("red_weights", {1, 2, 1, 1}, {1.0f, 0.0f});
      const bool is_square = output == Output::kSquare;
      onnx->AddNode("Conv", {"scores", "red_weights"}, is_square ? "red" : "output",
                    {{"kernel_shape", {1, 1}}});
      if (is_square) AddReshape("red", "output", {1, kGrid, kGrid}, onnx);
      onnx->AddOutput("output", {1, kGrid, kGrid});
      break;
    }
  }
}

}  // namespace

std::string MakeTinyDetector(const TinyDetector& options) {
  OnnxWriter onnx;
  onnx.AddInput("images", {1, options.channel_count, kTinyInputPx, kTinyInputPx});
  AddScores(options, &onnx);
  AddHead(options.output, &onnx);
  if (options.has_raw_output) {
    onnx.AddNode("Relu", {"scores"}, "raw");
    onnx.AddOutput("raw", {1, 2, kGrid, kGrid});
  }
  return onnx.Bytes();
}

Image BlankImage(int width, int height, PixelFormat format) {
  Image image{.width = width, .height = height, .format = format, .bytes = {}};
  image.bytes.resize(static_cast<size_t>(width) * static_cast<size_t>(height) *
                     static_cast<size_t>(BytesPerPixel(format)));
  return image;
}

void PaintRectangle(Image* image, int left, int top, int size, uint8_t red, uint8_t green,
                    uint8_t blue) {
  const uint8_t color[] = {red, green, blue};
  const int right = std::min(image->width, left + kBoxWidthPx * size);
  const int bottom = std::min(image->height, top + kBoxHeightPx * size);
  for (int row = std::max(0, top); row < bottom; ++row) {
    for (int column = std::max(0, left); column < right; ++column) {
      uint8_t* pixel = image->bytes.data() + image->Offset(column, row);
      for (int c = 0; c < BytesPerPixel(image->format); ++c) pixel[c] = color[c];
    }
  }
}

}  // namespace dsg::ingest
