// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/person_detector.h"

#include <algorithm>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/agents/detector/letterbox.h"
#include "ingest/agents/detector/model_file.h"
#include "ingest/agents/detector/output_layout.h"
#include "ingest/agents/detector/trial.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr int kInputPxMax = 4096;
// Suppression compares all pairs; no image holds as many people.
constexpr int kCandidateCountMax = 3000;
// The grey that bars have in the training of most detectors.
constexpr double kBarGray = 114.0;

absl::Status BadOption(const std::string& field, const std::string& message) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat("person detector: ", field, " is ", message),
                   {{"field", field}});
}

absl::Status CheckOptions(const PersonDetectorOptions& options) {
  const auto is_size = [](int px) { return px > 0 && px <= kInputPxMax; };
  const auto is_share = [](double share) { return share >= 0.0 && share <= 1.0; };
  if (!is_size(options.input_width_px) || !is_size(options.input_height_px)) {
    return BadOption("input size",
                     absl::StrCat(options.input_width_px, " x ", options.input_height_px,
                                  "; each may be 1 to ", kInputPxMax, " pixels"));
  }
  if (!is_share(options.score_min)) {
    return BadOption("score_min", absl::StrCat(options.score_min, "; give 0 to 1"));
  }
  if (!is_share(options.overlap_max)) {
    return BadOption("overlap_max", absl::StrCat(options.overlap_max, "; give 0 to 1"));
  }
  if (options.person_class < 0) {
    return BadOption("person_class",
                     absl::StrCat(options.person_class, "; classes are numbered from 0"));
  }
  return absl::OkStatus();
}

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

// Without the source line, and on one line.
std::string WordsOf(const std::exception& exception) {
  const auto* of_opencv = dynamic_cast<const cv::Exception*>(&exception);
  std::string words = of_opencv != nullptr ? of_opencv->err : std::string(exception.what());
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words;
}

std::vector<int> ShapeOf(const cv::Mat& mat) { return {mat.size.p, mat.size.p + mat.dims}; }

// The one output whose shape is known; networks may give raw ones beside it.
absl::StatusOr<size_t> ChooseOutput(const std::vector<cv::Mat>& outputs) {
  std::vector<size_t> known;
  std::vector<std::string> shapes;
  absl::Status error = MakeError(Reason::kFileMalformed, "the network has no output");
  for (size_t i = 0; i < outputs.size(); ++i) {
    const std::vector<int> shape = ShapeOf(outputs[i]);
    shapes.push_back(ShapeText(shape));
    if (outputs[i].type() != CV_32F) continue;
    const absl::StatusOr<OutputLayout> layout = LayoutOf(shape);
    if (layout.ok()) known.push_back(i);
    if (!layout.ok()) error = layout.status();
  }
  if (known.size() == 1) return known.front();
  if (outputs.size() <= 1) return error;
  return MakeError(
      Reason::kFileMalformed,
      absl::StrCat("of the network's outputs ", absl::StrJoin(shapes, ", "), " ", known.size(),
                   " have a known shape, and exactly one must; known are [1, N, 5 + classes], "
                   "[1, 4 + classes, N] and [1, 1, N, 7]"));
}

class OnnxPersonDetector : public PersonDetector {
 public:
  OnnxPersonDetector(PersonDetectorOptions options, const cv::dnn::Net& net)
      : options_(std::move(options)), net_(net) {}

  // An image without anything in it tells the shape of the output.
  absl::Status Rehearse();

  absl::StatusOr<std::vector<HumanDetection>> Detect(const Image& image, TimeNs time_ns,
                                                     const std::string& camera,
                                                     int64_t first_id) override;

 private:
  absl::StatusOr<std::vector<cv::Mat>> Run(const cv::Mat& input);
  absl::StatusOr<std::vector<PersonCandidate>> Candidates(const cv::Mat& input);

  CandidateOptions OptionsOfCandidates() const {
    return {.score_min = options_.score_min,
            .person_class = options_.person_class,
            .input_width_px = options_.input_width_px,
            .input_height_px = options_.input_height_px};
  }

  PersonDetectorOptions options_;
  cv::dnn::Net net_;
  // Of the network's outputs.
  size_t output_ = 0;
  OutputKind kind_ = OutputKind::kRows;
};

absl::StatusOr<std::vector<cv::Mat>> OnnxPersonDetector::Run(const cv::Mat& input) {
  const QuietOpenCv quiet;
  try {
    net_.setInput(cv::dnn::blobFromImage(input, 1.0 / 255.0));
    std::vector<cv::Mat> outputs;
    net_.forward(outputs, net_.getUnconnectedOutLayersNames());
    return outputs;
  } catch (const std::exception& exception) {
    return absl::InternalError(absl::StrCat("OpenCV cannot run the network on an input of ",
                                            input.cols, " x ", input.rows,
                                            " pixels: ", WordsOf(exception)));
  }
}

absl::Status OnnxPersonDetector::Rehearse() {
  const cv::Mat input(options_.input_height_px, options_.input_width_px, CV_8UC3,
                      cv::Scalar::all(kBarGray));
  DSG_ASSIGN_OR_RETURN(const std::vector<cv::Mat> outputs, Run(input));
  DSG_ASSIGN_OR_RETURN(output_, ChooseOutput(outputs));
  DSG_ASSIGN_OR_RETURN(const OutputLayout layout, LayoutOf(ShapeOf(outputs[output_])));
  kind_ = layout.kind;
  if (layout.class_count > 0 && options_.person_class >= layout.class_count) {
    return BadOption("person_class", absl::StrCat(options_.person_class, ", and the network has ",
                                                  layout.class_count, " classes from 0 on"));
  }
  const cv::Mat& output = outputs[output_];
  return ReadCandidates(layout, output.ptr<float>(), OptionsOfCandidates()).status();
}

absl::StatusOr<std::vector<PersonCandidate>> OnnxPersonDetector::Candidates(const cv::Mat& input) {
  DSG_ASSIGN_OR_RETURN(const std::vector<cv::Mat> outputs, Run(input));
  if (output_ >= outputs.size()) return absl::InternalError("the network gave no output");
  const cv::Mat& output = outputs[output_];
  // Networks that suppress boxes themselves may leave none.
  if (kind_ == OutputKind::kSsd && output.total() == 0) return std::vector<PersonCandidate>{};
  DSG_ASSIGN_OR_RETURN(const OutputLayout layout, LayoutOf(ShapeOf(output)));
  if (layout.kind != kind_ || output.type() != CV_32F || !output.isContinuous()) {
    return absl::InternalError(
        absl::StrCat("the network's output changed its layout to ", ShapeText(ShapeOf(output))));
  }
  return ReadCandidates(layout, output.ptr<float>(), OptionsOfCandidates());
}

absl::Status CheckImage(const Image& image) {
  const bool is_color = image.format == PixelFormat::kRgb8;
  const bool is_sound =
      (is_color || image.format == PixelFormat::kGray8) && image.width > 0 && image.height > 0 &&
      image.bytes.size() == static_cast<size_t>(image.width) * static_cast<size_t>(image.height) *
                                static_cast<size_t>(BytesPerPixel(image.format));
  if (is_sound) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("person detector: the image is ", image.width, " x ", image.height,
                                " pixels of ", std::string(Name(image.format)), " in ",
                                image.bytes.size(), " bytes; give a whole gray8 or rgb8 image"),
                   {{"field", "image"}});
}

// Red, green, blue, with bars. Requires: a sound image.
cv::Mat MakeInput(const Image& image, const Letterbox& letterbox, int width_px, int height_px) {
  const bool is_color = image.format == PixelFormat::kRgb8;
  const cv::Mat whole(image.height, image.width, is_color ? CV_8UC3 : CV_8UC1,
                      const_cast<uint8_t*>(image.bytes.data()));
  cv::Mat resized;
  cv::resize(whole, resized, cv::Size(letterbox.width_px, letterbox.height_px), 0, 0,
             cv::INTER_LINEAR);
  if (!is_color) cv::cvtColor(resized, resized, cv::COLOR_GRAY2RGB);
  cv::Mat input(height_px, width_px, CV_8UC3, cv::Scalar::all(kBarGray));
  resized.copyTo(input(
      cv::Rect(letterbox.left_px, letterbox.top_px, letterbox.width_px, letterbox.height_px)));
  return input;
}

// Best score first; equal ones in the network's order.
std::vector<PersonCandidate> Suppress(const std::vector<PersonCandidate>& candidates,
                                      double overlap_max) {
  std::vector<cv::Rect2d> boxes;
  std::vector<float> scores;
  for (const PersonCandidate& candidate : candidates) {
    const Eigen::Vector4d& box = candidate.box_input;
    boxes.emplace_back(box[0], box[1], box[2] - box[0], box[3] - box[1]);
    scores.push_back(static_cast<float>(candidate.score));
  }
  std::vector<int> kept;
  cv::dnn::NMSBoxes(boxes, scores, 0.0f, static_cast<float>(overlap_max), kept, 1.0f,
                    kCandidateCountMax);
  std::vector<PersonCandidate> people;
  people.reserve(kept.size());
  for (const int index : kept) people.push_back(candidates[static_cast<size_t>(index)]);
  return people;
}

HumanDetection MakeDetection(const Eigen::Vector4d& box_px, double score) {
  HumanDetection detection;
  detection.score = score;
  detection.box_px = box_px;
  detection.has_joints = false;
  detection.joints_root.fill(Eigen::Vector3d::Zero());
  detection.joints_px.fill(Eigen::Vector2d::Zero());
  return detection;
}

absl::StatusOr<std::vector<HumanDetection>> OnnxPersonDetector::Detect(const Image& image,
                                                                       TimeNs time_ns,
                                                                       const std::string& camera,
                                                                       int64_t first_id) {
  DSG_RETURN_IF_ERROR(CheckImage(image));
  const Letterbox letterbox =
      FitLetterbox(image.width, image.height, options_.input_width_px, options_.input_height_px);
  std::vector<PersonCandidate> people;
  try {
    const cv::Mat input =
        MakeInput(image, letterbox, options_.input_width_px, options_.input_height_px);
    DSG_ASSIGN_OR_RETURN(const std::vector<PersonCandidate> candidates, Candidates(input));
    people = Suppress(candidates, options_.overlap_max);
  } catch (const std::exception& exception) {
    return absl::InternalError(absl::StrCat("OpenCV cannot prepare an image of ", image.width,
                                            " x ", image.height, ": ", WordsOf(exception)));
  }
  std::vector<HumanDetection> detections;
  for (const PersonCandidate& person : people) {
    const Eigen::Vector4d box_px = letterbox.ToImage(person.box_input);
    // In the bars there is nobody.
    if (!(box_px[0] < box_px[2] && box_px[1] < box_px[3])) continue;
    HumanDetection detection = MakeDetection(box_px, person.score);
    detection.time_ns = time_ns;
    detection.camera = camera;
    detection.id = first_id + static_cast<int64_t>(detections.size());
    detections.push_back(std::move(detection));
  }
  return detections;
}

// Loading, and one picture.
constexpr double kTrialSeconds = 60.0;

cv::dnn::Net ReadNet(const std::vector<uint8_t>& bytes) {
  cv::dnn::Net net = cv::dnn::readNetFromONNX(bytes);
  net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  return net;
}

}  // namespace

absl::StatusOr<std::unique_ptr<PersonDetector>> PersonDetector::Load(
    const PersonDetectorOptions& options) {
  DSG_RETURN_IF_ERROR(CheckOptions(options));
  const std::string& file = options.model_file;
  try {
    DSG_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadModelFile(file));
    const QuietOpenCv quiet;
    const absl::Status trial = TryApart(
        [&] {
          // A pool of threads stays behind in the process that was copied.
          cv::setNumThreads(1);
          try {
            OnnxPersonDetector(options, ReadNet(bytes)).Rehearse().IgnoreError();
          } catch (const cv::Exception& exception) {
            // All else is said again, in words, where it can be reported.
            if (exception.code == cv::Error::StsNoMem) throw;
          }
        },
        kTrialSeconds);
    if (!trial.ok()) {
      return BadModel(file, absl::StrCat("OpenCV cannot run it: ", trial.message()));
    }
    auto detector = std::make_unique<OnnxPersonDetector>(options, ReadNet(bytes));
    const absl::Status rehearsal = detector->Rehearse();
    if (ReasonOf(rehearsal) == Reason::kFieldInvalid) return rehearsal;
    if (!rehearsal.ok()) return BadModel(file, std::string(rehearsal.message()));
    return detector;
  } catch (const std::exception& exception) {
    return BadModel(file, absl::StrCat("OpenCV cannot read it: ", WordsOf(exception)));
  }
}

}  // namespace dsg::ingest
