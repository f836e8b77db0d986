// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/segmenter.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/agents/detector/letterbox.h"
#include "ingest/agents/detector/network_internal.h"
#include "ingest/agents/detector/output_layout.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status WrongOption(const std::string& field, const std::string& message) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat("segmenter: ", field, " is ", message),
                   {{"field", field}});
}

absl::Status CheckSegmenterOptions(const SegmenterOptions& options) {
  const auto is_size = [](int px) { return px > 0 && px <= kNetworkInputPxMax; };
  if (!is_size(options.input_width_px) || !is_size(options.input_height_px)) {
    return WrongOption("input size",
                       absl::StrCat(options.input_width_px, " x ", options.input_height_px,
                                    "; each may be 1 to ", kNetworkInputPxMax, " pixels"));
  }
  for (size_t i = 0; i < 3; ++i) {
    if (!std::isfinite(options.mean[i])) return WrongOption("mean", "no number");
    if (!std::isfinite(options.scale[i]) || options.scale[i] == 0.0) {
      return WrongOption("scale", absl::StrCat(options.scale[i], "; give three numbers but 0"));
    }
  }
  if (options.label_of_class.empty()) return WrongOption("list of classes", "empty");
  return absl::OkStatus();
}

// What an output of a segmentation network is, told by its shape.
struct MapLayout {
  /// 0 = numbers of classes instead of a score of each.
  int class_count = 0;
  int height = 0;
  int width = 0;
};

absl::StatusOr<MapLayout> MapLayoutOf(const cv::Mat& output) {
  const std::vector<int> shape = ShapeOf(output);
  const bool is_float = output.type() == CV_32F;
  const bool is_integer = output.type() == CV_32S;
  const bool is_one = !shape.empty() && shape[0] == 1;
  if (is_one && shape.size() == 4 && shape[1] > 1 && is_float) {
    return MapLayout{shape[1], shape[2], shape[3]};
  }
  if (is_one && shape.size() == 4 && shape[1] == 1 && (is_float || is_integer)) {
    return MapLayout{0, shape[2], shape[3]};
  }
  if (is_one && shape.size() == 3 && (is_float || is_integer)) {
    return MapLayout{0, shape[1], shape[2]};
  }
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat("the network's output is ", ShapeText(shape),
                                ", no map of classes; known are scores of [1, classes, height, "
                                "width], and numbers of classes of [1, height, width] or [1, 1, "
                                "height, width]"));
}

class OnnxSegmenter : public Segmenter {
 public:
  OnnxSegmenter(SegmenterOptions options, Network network)
      : options_(std::move(options)), network_(std::move(network)) {}

  // A grey picture tells the shape of the output.
  absl::Status Rehearse() {
    const cv::Mat input(options_.input_height_px, options_.input_width_px, CV_8UC3, Bars());
    DSG_ASSIGN_OR_RETURN(const std::vector<cv::Mat> outputs, Run(input));
    DSG_RETURN_IF_ERROR(ChooseOutput(outputs));
    DSG_ASSIGN_OR_RETURN(const MapLayout layout, MapLayoutOf(outputs[output_]));
    return CheckMap(layout);
  }

  absl::StatusOr<Image> Segment(const Image& image) override {
    DSG_RETURN_IF_ERROR(CheckNetworkImage("segmenter", image));
    const Letterbox letterbox =
        FitLetterbox(image.width, image.height, options_.input_width_px, options_.input_height_px);
    try {
      const cv::Mat input =
          MakeInput(image, letterbox, options_.input_width_px, options_.input_height_px, Bars());
      const std::lock_guard<std::mutex> lock(mutex_);
      DSG_ASSIGN_OR_RETURN(const std::vector<cv::Mat> outputs, Run(input));
      if (output_ >= outputs.size()) return absl::InternalError("the network gave no output");
      DSG_ASSIGN_OR_RETURN(const MapLayout layout, MapLayoutOf(outputs[output_]));
      DSG_RETURN_IF_ERROR(CheckMap(layout));
      return ToImage(ClassesOf(outputs[output_], layout), layout, letterbox);
    } catch (const std::exception& exception) {
      return absl::InternalError(absl::StrCat("OpenCV cannot prepare an image of ", image.width,
                                              " x ", image.height, ": ", WordsOf(exception)));
    }
  }

 private:
  // Bars are of no colour: the mean of the pictures of the training.
  cv::Scalar Bars() const {
    const auto gray = [](double mean) { return std::clamp(mean, 0.0, 255.0); };
    return {gray(options_.mean[0]), gray(options_.mean[1]), gray(options_.mean[2])};
  }

  absl::StatusOr<std::vector<cv::Mat>> Run(const cv::Mat& input) {
    std::vector<cv::Mat> planes;
    cv::split(input, planes);
    const int size[] = {1, 3, input.rows, input.cols};
    cv::Mat blob(4, size, CV_32F);
    for (int i = 0; i < 3; ++i) {
      cv::Mat plane(input.rows, input.cols, CV_32F, blob.ptr<float>(0, i));
      const double scale = options_.scale[static_cast<size_t>(i)];
      planes[static_cast<size_t>(i)].convertTo(plane, CV_32F, scale,
                                               -scale * options_.mean[static_cast<size_t>(i)]);
    }
    return network_.Run(blob);
  }

  // The only one that is a map; networks may give others beside it, for their training.
  absl::Status ChooseOutput(const std::vector<cv::Mat>& outputs) {
    absl::Status error = MakeError(Reason::kFileMalformed, "the network has no output");
    std::vector<size_t> known;
    std::vector<std::string> shapes;
    for (size_t i = 0; i < outputs.size(); ++i) {
      shapes.push_back(ShapeText(ShapeOf(outputs[i])));
      const absl::StatusOr<MapLayout> layout = MapLayoutOf(outputs[i]);
      if (layout.ok()) known.push_back(i);
      if (!layout.ok()) error = layout.status();
    }
    if (known.size() == 1) output_ = known.front();
    if (known.size() == 1) return absl::OkStatus();
    if (outputs.size() <= 1) return error;
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat("of the network's outputs ", absl::StrJoin(shapes, ", "), " ",
                                  known.size(), " are maps of classes, and exactly one must be"));
  }

  absl::Status CheckMap(const MapLayout& layout) const {
    // A table of boxes has three dimensions too.
    const int64_t skew = int64_t{layout.height} * options_.input_width_px -
                         int64_t{layout.width} * options_.input_height_px;
    if (std::abs(skew) > std::max(options_.input_width_px, options_.input_height_px)) {
      return MakeError(Reason::kFileMalformed,
                       absl::StrCat("the network's output is ", layout.width, " x ", layout.height,
                                    ", no map of an input of ", options_.input_width_px, " x ",
                                    options_.input_height_px));
    }
    const auto listed_count = static_cast<int>(options_.label_of_class.size());
    if (layout.class_count == 0 || layout.class_count == listed_count) return absl::OkStatus();
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat("the network tells ", layout.class_count, " classes apart, ",
                                  options_.classes_file, " lists ", listed_count,
                                  "; give the list of this network"));
  }

  // Of each cell of the map.
  static std::vector<int> ClassesOf(const cv::Mat& output, const MapLayout& layout) {
    const auto cell_count = static_cast<size_t>(layout.width) * static_cast<size_t>(layout.height);
    std::vector<int> classes(cell_count, 0);
    if (layout.class_count == 0) {
      for (size_t i = 0; i < cell_count; ++i) {
        const double number = output.type() == CV_32F ? output.ptr<float>()[i]
                                                      : static_cast<double>(output.ptr<int>()[i]);
        classes[i] = number >= 0.0 && number < 65536.0 ? static_cast<int>(std::lround(number)) : -1;
      }
      return classes;
    }
    const float* const scores = output.ptr<float>();
    for (size_t i = 0; i < cell_count; ++i) {
      float best = scores[i];
      for (int c = 1; c < layout.class_count; ++c) {
        const float score = scores[static_cast<size_t>(c) * cell_count + i];
        // Of equal ones the first; scores that are no numbers win nothing.
        if (score > best || std::isnan(best)) {
          best = score;
          classes[i] = c;
        }
      }
      if (std::isnan(best)) classes[i] = -1;
    }
    return classes;
  }

  // The cell under the middle of each pixel; the map covers the input.
  Image ToImage(const std::vector<int>& classes, const MapLayout& layout,
                const Letterbox& letterbox) const {
    Image label;
    label.width = letterbox.image_width_px;
    label.height = letterbox.image_height_px;
    label.format = PixelFormat::kLabel16;
    label.bytes.resize(2 * static_cast<size_t>(label.width) * static_cast<size_t>(label.height));
    const auto cell_of = [](int pixel, int image_px, int left, int width, int input_px, int cells) {
      const double input = left + (pixel + 0.5) * width / image_px;
      return std::clamp(static_cast<int>(input * cells / input_px), 0, cells - 1);
    };
    for (int row = 0; row < label.height; ++row) {
      const int y = cell_of(row, label.height, letterbox.top_px, letterbox.height_px,
                            options_.input_height_px, layout.height);
      for (int column = 0; column < label.width; ++column) {
        const int x = cell_of(column, label.width, letterbox.left_px, letterbox.width_px,
                              options_.input_width_px, layout.width);
        const int found = classes[static_cast<size_t>(y) * static_cast<size_t>(layout.width) +
                                  static_cast<size_t>(x)];
        const bool is_listed =
            found >= 0 && found < static_cast<int>(options_.label_of_class.size());
        const uint16_t value =
            is_listed ? options_.label_of_class[static_cast<size_t>(found)] : uint16_t{0};
        std::memcpy(label.bytes.data() + label.Offset(column, row), &value, sizeof(value));
      }
    }
    return label;
  }

  SegmenterOptions options_;
  std::mutex mutex_;
  Network network_;
  /// Of the network's outputs.
  size_t output_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Segmenter>> Segmenter::Load(const SegmenterOptions& options) {
  DSG_RETURN_IF_ERROR(CheckSegmenterOptions(options));
  std::unique_ptr<OnnxSegmenter> segmenter;
  const auto rehearse = [&](Network& network) {
    segmenter = std::make_unique<OnnxSegmenter>(options, network);
    return segmenter->Rehearse();
  };
  DSG_RETURN_IF_ERROR(Network::Load(options.model_file, rehearse).status());
  return segmenter;
}

}  // namespace dsg::ingest
