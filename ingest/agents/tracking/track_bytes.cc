// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/track_bytes.h"

#include <cstring>
#include <type_traits>
#include <utility>

#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

class Writer {
 public:
  template <typename Number>
  void operator()(const Number& number) {
    static_assert(std::is_arithmetic_v<Number> || std::is_enum_v<Number>);
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof(Number));
  }
  template <typename Scalar, int kRows, int kColumns>
  void operator()(const Eigen::Matrix<Scalar, kRows, kColumns>& matrix) {
    bytes_.append(reinterpret_cast<const char*>(matrix.data()), sizeof(Scalar) * kRows * kColumns);
  }
  void operator()(const Pose3d& pose) {
    (*this)(pose.position);
    (*this)(pose.orientation.coeffs());
  }
  // Of a list, which is written by whoever asks.
  uint32_t Count(size_t count) {
    (*this)(static_cast<uint32_t>(count));
    return static_cast<uint32_t>(count);
  }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <typename Number>
  void operator()(Number& number) {
    static_assert(std::is_arithmetic_v<Number> || std::is_enum_v<Number>);
    Copy(&number, sizeof(Number));
  }
  template <typename Scalar, int kRows, int kColumns>
  void operator()(Eigen::Matrix<Scalar, kRows, kColumns>& matrix) {
    Copy(matrix.data(), sizeof(Scalar) * kRows * kColumns);
  }
  void operator()(Pose3d& pose) {
    (*this)(pose.position);
    (*this)(pose.orientation.coeffs());
  }
  // No more than there are bytes.
  uint32_t Count(size_t) {
    uint32_t count = 0;
    (*this)(count);
    if (count > bytes_.size()) is_good_ = false;
    return is_good_ ? count : 0;
  }
  bool IsDone() const { return is_good_ && bytes_.empty(); }

 private:
  void Copy(void* target, size_t size) {
    is_good_ = is_good_ && bytes_.size() >= size;
    if (!is_good_) return;
    std::memcpy(target, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }

  std::string_view bytes_;
  bool is_good_ = true;
};

// All members but those that ForgetShapes frees, in one place for both ways.
template <typename Way, typename Observation>
void PassObservation(Way& way, Observation& seen) {
  way(seen.time_ns);
  way(seen.detection_id);
  way(seen.is_weak);
  way(seen.map_T_torso);
  way(seen.position_covariance_map);
  way(seen.heading_sigma_rad);
  way(seen.has_heading);
  way(seen.camera_map);
  const uint32_t cue_count = way.Count(seen.cues.size());
  if constexpr (!std::is_const_v<Observation>) seen.cues.resize(cue_count);
  for (auto& cue : seen.cues) {
    way(cue.kind);
    way(cue.torso_map);
    way(cue.information_map);
  }
  way(seen.has_joints);
  if (!seen.has_joints) return;
  for (auto& joint : seen.joints_torso) way(joint);
  for (auto& visibility : seen.joint_visibility) way(visibility);
}

template <typename Way, typename Estimate>
void PassEstimate(Way& way, Estimate& estimate) {
  way(estimate.time_ns);
  way(estimate.map_T_torso);
  for (auto& value : estimate.covariance) way(value);
}

}  // namespace

std::string EncodeTrack(const std::vector<PersonObservation>& observations,
                        const std::vector<TorsoEstimate>& estimates) {
  DSG_CHECK(observations.size() == estimates.size());
  Writer writer;
  for (const PersonObservation& observation : observations) PassObservation(writer, observation);
  for (const TorsoEstimate& estimate : estimates) PassEstimate(writer, estimate);
  return writer.Take();
}

bool DecodeTrack(std::string_view bytes, size_t count, std::vector<PersonObservation>* observations,
                 std::vector<TorsoEstimate>* estimates) {
  observations->assign(count, PersonObservation());
  estimates->assign(count, TorsoEstimate());
  Reader reader(bytes);
  for (PersonObservation& observation : *observations) PassObservation(reader, observation);
  for (TorsoEstimate& estimate : *estimates) PassEstimate(reader, estimate);
  return reader.IsDone();
}

}  // namespace dsg::ingest
