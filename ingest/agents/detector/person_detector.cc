// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/person_detector.h"

#include <algorithm>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/agents/detector/letterbox.h"
#include "ingest/agents/detector/network_internal.h"
#include "ingest/agents/detector/output_layout.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Suppression compares all pairs; no image holds as many people.
constexpr int kCandidateCountMax = 3000;
// The grey that bars have in the training of most detectors.
constexpr double kBarGray = 114.0;

absl::Status BadOption(const std::string& field, const std::string& message) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat("person detector: ", field, " is ", message),
                   {{"field", field}});
}

absl::Status CheckOptions(const PersonDetectorOptions& options) {
  const auto is_size = [](int px) { return px > 0 && px <= kNetworkInputPxMax; };
  const auto is_share = [](double share) { return share >= 0.0 && share <= 1.0; };
  if (!is_size(options.input_width_px) || !is_size(options.input_height_px)) {
    return BadOption("input size",
                     absl::StrCat(options.input_width_px, " x ", options.input_height_px,
                                  "; each may be 1 to ", kNetworkInputPxMax, " pixels"));
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
  OnnxPersonDetector(PersonDetectorOptions options, Network network)
      : options_(std::move(options)), network_(std::move(network)) {}

  // An image without anything in it tells the shape of the output.
  absl::Status Rehearse();

  absl::StatusOr<std::vector<HumanDetection>> Detect(const Image& image, TimeNs time_ns,
                                                     const std::string& camera,
                                                     int64_t first_id) override;

 private:
  absl::StatusOr<std::vector<cv::Mat>> Run(const cv::Mat& input) {
    return network_.Run(cv::dnn::blobFromImage(input, 1.0 / 255.0));
  }
  absl::StatusOr<std::vector<PersonCandidate>> Candidates(const cv::Mat& input);

  CandidateOptions OptionsOfCandidates() const {
    return {.score_min = options_.score_min,
            .person_class = options_.person_class,
            .input_width_px = options_.input_width_px,
            .input_height_px = options_.input_height_px};
  }

  PersonDetectorOptions options_;
  Network network_;
  // Of the network's outputs.
  size_t output_ = 0;
  OutputKind kind_ = OutputKind::kRows;
};

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
  DSG_RETURN_IF_ERROR(CheckNetworkImage("person detector", image));
  const Letterbox letterbox =
      FitLetterbox(image.width, image.height, options_.input_width_px, options_.input_height_px);
  std::vector<PersonCandidate> people;
  try {
    const cv::Mat input = MakeInput(image, letterbox, options_.input_width_px,
                                    options_.input_height_px, cv::Scalar::all(kBarGray));
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

}  // namespace

absl::StatusOr<std::unique_ptr<PersonDetector>> PersonDetector::Load(
    const PersonDetectorOptions& options) {
  DSG_RETURN_IF_ERROR(CheckOptions(options));
  std::unique_ptr<OnnxPersonDetector> detector;
  const auto rehearse = [&](Network& network) {
    detector = std::make_unique<OnnxPersonDetector>(options, network);
    return detector->Rehearse();
  };
  DSG_RETURN_IF_ERROR(Network::Load(options.model_file, rehearse).status());
  return detector;
}

}  // namespace dsg::ingest
