// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/agents/detector/tiny_segmenter.h"

#include <vector>

#include "tests/unit/ingest/agents/detector/onnx_writer.h"

namespace dsg::ingest {
namespace {

// The mean over stride x stride pixels, weighted by channel.
void AddMean(const std::vector<float>& of_channel, int stride, std::vector<float>* weights) {
  const auto share = 1.0f / static_cast<float>(stride * stride);
  for (const float weight : of_channel) {
    for (int i = 0; i < stride * stride; ++i) weights->push_back(weight * share);
  }
}

void AddConv(const std::string& output, const std::vector<std::vector<float>>& rows,
             const std::vector<float>& bias, int stride, OnnxWriter* onnx) {
  std::vector<float> weights;
  for (const std::vector<float>& row : rows) AddMean(row, stride, &weights);
  const auto count = static_cast<int64_t>(rows.size());
  onnx->AddFloats(output + "_weights", {count, 3, stride, stride}, weights);
  onnx->AddFloats(output + "_bias", {count}, bias);
  onnx->AddNode("Conv", {"images", output + "_weights", output + "_bias"}, output,
                {{"kernel_shape", {stride, stride}}, {"strides", {stride, stride}}});
}

}  // namespace

std::string MakeTinySegmenter(const TinySegmenter& options) {
  using Output = TinySegmenter::Output;
  OnnxWriter onnx;
  const int64_t height = options.height_px / options.stride_px;
  const int64_t width = options.width_px / options.stride_px;
  onnx.AddInput("images", {1, 3, options.height_px, options.width_px});
  const bool has_scores = options.output == Output::kScores || options.output == Output::kTable;
  const std::string made =
      options.output == Output::kScores || options.output == Output::kNumbers ? "output" : "map";
  if (has_scores) {
    AddConv(made, {{0, 0, 0}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {options.dark_below, 0, 0, 0},
            options.stride_px, &onnx);
  } else {
    AddConv(made, {{1, 2, 3}}, {0}, options.stride_px, &onnx);
  }
  std::vector<int64_t> shape = {1, has_scores ? 4 : 1, height, width};
  if (made == "map") {
    shape = options.output == Output::kTable ? std::vector<int64_t>{1, 4, height * width}
                                             : std::vector<int64_t>{1, height, width};
    onnx.AddInts("shape", shape);
    onnx.AddNode("Reshape", {"map", "shape"}, "output");
  }
  onnx.AddOutput("output", shape);
  if (options.has_second_output) {
    onnx.AddNode("Relu", {made}, "second");
    onnx.AddOutput("second", {1, has_scores ? 4 : 1, height, width});
  }
  return onnx.Bytes();
}

}  // namespace dsg::ingest
