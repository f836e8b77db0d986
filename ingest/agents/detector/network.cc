// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/network_internal.h"

#include <algorithm>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/agents/detector/model_file.h"
#include "ingest/agents/detector/trial.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Loading, and one picture.
constexpr double kTrialSeconds = 60.0;

// OpenCV's importer prints what it also throws.
class QuietOpenCv {
 public:
  QuietOpenCv() : level_(cv::utils::logging::getLogLevel()) {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  }
  ~QuietOpenCv() { cv::utils::logging::setLogLevel(level_); }
  QuietOpenCv(const QuietOpenCv&) = delete;
  QuietOpenCv& operator=(const QuietOpenCv&) = delete;

 private:
  cv::utils::logging::LogLevel level_;
};

cv::dnn::Net ReadNet(const std::vector<uint8_t>& bytes) {
  cv::dnn::Net net = cv::dnn::readNetFromONNX(bytes);
  net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  return net;
}

}  // namespace

std::string WordsOf(const std::exception& exception) {
  const auto* of_opencv = dynamic_cast<const cv::Exception*>(&exception);
  std::string words = of_opencv != nullptr ? of_opencv->err : std::string(exception.what());
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words;
}

std::vector<int> ShapeOf(const cv::Mat& mat) { return {mat.size.p, mat.size.p + mat.dims}; }

absl::StatusOr<std::vector<cv::Mat>> Network::Run(const cv::Mat& blob) {
  const QuietOpenCv quiet;
  try {
    net_.setInput(blob);
    std::vector<cv::Mat> outputs;
    net_.forward(outputs, net_.getUnconnectedOutLayersNames());
    return outputs;
  } catch (const std::exception& exception) {
    return absl::InternalError(absl::StrCat("OpenCV cannot run the network on an input of ",
                                            blob.size[3], " x ", blob.size[2],
                                            " pixels: ", WordsOf(exception)));
  }
}

absl::StatusOr<Network> Network::Load(
    const std::string& file, const std::function<absl::Status(Network& network)>& rehearse) {
  try {
    DSG_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadModelFile(file));
    const QuietOpenCv quiet;
    const absl::Status trial = TryApart(
        [&] {
          // A pool of threads stays behind in the process that was copied.
          cv::setNumThreads(1);
          try {
            Network network(ReadNet(bytes));
            rehearse(network).IgnoreError();
          } catch (const cv::Exception& exception) {
            // All else is said again, in words, where it can be reported.
            if (exception.code == cv::Error::StsNoMem) throw;
          }
        },
        kTrialSeconds);
    if (!trial.ok()) {
      return BadModel(file, absl::StrCat("OpenCV cannot run it: ", trial.message()));
    }
    Network network(ReadNet(bytes));
    const absl::Status rehearsal = rehearse(network);
    if (ReasonOf(rehearsal) == Reason::kFieldInvalid) return rehearsal;
    if (!rehearsal.ok()) return BadModel(file, std::string(rehearsal.message()));
    return network;
  } catch (const std::exception& exception) {
    return BadModel(file, absl::StrCat("OpenCV cannot read it: ", WordsOf(exception)));
  }
}

absl::Status CheckNetworkImage(const std::string& who, const Image& image) {
  const bool is_color = image.format == PixelFormat::kRgb8;
  const bool is_sound =
      (is_color || image.format == PixelFormat::kGray8) && image.width > 0 && image.height > 0 &&
      image.bytes.size() == static_cast<size_t>(image.width) * static_cast<size_t>(image.height) *
                                static_cast<size_t>(BytesPerPixel(image.format));
  if (is_sound) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(who, ": the image is ", image.width, " x ", image.height,
                                " pixels of ", std::string(Name(image.format)), " in ",
                                image.bytes.size(), " bytes; give a whole gray8 or rgb8 image"),
                   {{"field", "image"}});
}

cv::Mat MakeInput(const Image& image, const Letterbox& letterbox, int width_px, int height_px,
                  const cv::Scalar& bars) {
  const bool is_color = image.format == PixelFormat::kRgb8;
  const cv::Mat whole(image.height, image.width, is_color ? CV_8UC3 : CV_8UC1,
                      const_cast<uint8_t*>(image.bytes.data()));
  cv::Mat resized;
  cv::resize(whole, resized, cv::Size(letterbox.width_px, letterbox.height_px), 0, 0,
             cv::INTER_LINEAR);
  if (!is_color) cv::cvtColor(resized, resized, cv::COLOR_GRAY2RGB);
  cv::Mat input(height_px, width_px, CV_8UC3, bars);
  resized.copyTo(input(
      cv::Rect(letterbox.left_px, letterbox.top_px, letterbox.width_px, letterbox.height_px)));
  return input;
}

}  // namespace dsg::ingest
