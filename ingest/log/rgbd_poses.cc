// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/rgbd_poses.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/log/rigid_matrix.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

absl::Status AppendNumbers(const LinePosition& at, std::string_view text,
                           std::vector<double>* numbers) {
  std::vector<std::string_view> fields;
  SplitAtBlanks(text, &fields);
  for (const std::string_view field : fields) {
    DSG_ASSIGN_OR_RETURN(const double value, ParseNumber(at, "matrix", field));
    numbers->push_back(value);
  }
  return absl::OkStatus();
}

absl::Status AddMatrix(const LinePosition& at, const std::vector<double>& numbers, int64_t frame,
                       FramePoses* poses) {
  if (numbers.size() != 16) {
    return at.Error(absl::StrCat("a pose has 16 numbers, found ", numbers.size()));
  }
  const absl::StatusOr<RigidMatrix> rigid = ToRigid(RowMajor(numbers.data()));
  if (!rigid.ok()) return at.Error(absl::StrCat("the pose: ", rigid.status().message()));
  poses->deviation_max = std::max(poses->deviation_max, rigid->deviation);
  if (!poses->map_T_camera.try_emplace(frame, rigid->pose).second) {
    return at.Error(absl::StrCat("frame ", frame, " has a second pose; remove one"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status AddMatrixFile(const LogFile& file, int64_t frame, FramePoses* poses) {
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<double> numbers;
  while (lines.Next(&line) && numbers.size() <= 16) {
    DSG_RETURN_IF_ERROR(AppendNumbers({file.path, line.number}, line.text, &numbers));
  }
  return AddMatrix({file.path, 1}, numbers, frame, poses);
}

absl::StatusOr<FramePoses> ReadRedwoodTrajectory(const LogFile& file) {
  FramePoses poses;
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    const LinePosition at{file.path, line.number};
    SplitAtBlanks(line.text, &fields);
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 3, "frame, frame, next frame"));
    DSG_ASSIGN_OR_RETURN(const int64_t frame, ParseFrame(at, fields[0]));
    std::vector<double> numbers;
    for (int row = 0; row < 4 && lines.Next(&line); ++row) {
      DSG_RETURN_IF_ERROR(AppendNumbers({file.path, line.number}, line.text, &numbers));
    }
    DSG_RETURN_IF_ERROR(AddMatrix(at, numbers, frame, &poses));
  }
  return poses;
}

absl::StatusOr<FramePoses> ReadMatrixLines(const LogFile& file) {
  FramePoses poses;
  LineReader lines(file.bytes);
  TextLine line;
  int64_t frame = 0;
  while (lines.Next(&line)) {
    const LinePosition at{file.path, line.number};
    std::vector<double> numbers;
    DSG_RETURN_IF_ERROR(AppendNumbers(at, line.text, &numbers));
    DSG_RETURN_IF_ERROR(AddMatrix(at, numbers, frame++, &poses));
  }
  return poses;
}

absl::StatusOr<FramePoses> ReadIndexedPoses(const LogFile& file) {
  constexpr char kHeader[] = "index,role,pair,timestamp_ns,qw,qx,qy,qz,px,py,pz";
  FramePoses poses;
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  if (!lines.Next(&line) || line.text != kHeader) {
    return LinePosition{file.path, 1}.FieldError("header", line.text,
                                                 absl::StrCat("\"", kHeader, "\" is due"));
  }
  while (lines.Next(&line)) {
    const LinePosition at{file.path, line.number};
    SplitAtCommas(line.text, &fields);
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 11, kHeader));
    DSG_ASSIGN_OR_RETURN(const int64_t frame, ParseFrame(at, fields[0]));
    DSG_ASSIGN_OR_RETURN(const TimeNs stamp, ParseInteger(at, "timestamp_ns", fields[3]));
    double values[7] = {};
    for (size_t i = 0; i < 7; ++i) {
      DSG_ASSIGN_OR_RETURN(values[i], ParseCoordinate(at, "pose", fields[4 + i]));
    }
    Pose3d pose;
    DSG_ASSIGN_OR_RETURN(pose.orientation,
                         Normalize(at, {values[0], values[1], values[2], values[3]}));
    pose.position = {values[4], values[5], values[6]};
    if (!poses.map_T_camera.try_emplace(frame, pose).second) {
      return at.FieldError("index", fields[0], "each image has one pose; remove the line");
    }
    poses.stamps[frame] = stamp;
  }
  return poses;
}

absl::Status ReadIntrinsics(const LogFile& file, CameraCalibration* camera) {
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<double> k;
  while (lines.Next(&line) && k.size() <= 9) {
    DSG_RETURN_IF_ERROR(AppendNumbers({file.path, line.number}, line.text, &k));
  }
  const LinePosition at{file.path, 1};
  if (k.size() != 9 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0) {
    return at.Error("is no 3x3 matrix of intrinsics: fx 0 cx, 0 fy cy, 0 0 1");
  }
  camera->fx = k[0];
  camera->fy = k[4];
  camera->cx = k[2];
  camera->cy = k[5];
  return absl::OkStatus();
}

}  // namespace dsg::ingest
