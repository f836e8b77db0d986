// SPDX-License-Identifier: Apache-2.0
// The ROS message types of a sensor bag, in a form that C++20 compiles.
// Refuses to know which topic carries what.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <std_msgs/String.h>
#include <tf2_msgs/TFMessage.h>

#include <memory>
#include <type_traits>

namespace dsg::simulator::ros_messages {

/// Generated messages ask their allocator for `rebind`, which std::allocator lost in C++20. Text
/// keeps std::allocator, so that it is std::string.
template <class T>
struct Allocator : std::allocator<T> {
  template <class U>
  struct rebind {  // NOLINT(readability-identifier-naming): the name that messages ask for.
    using other = std::conditional_t<std::is_same_v<U, char>, std::allocator<char>, Allocator<U>>;
  };
  Allocator() = default;
  template <class U>
  Allocator(const Allocator<U>&) {}
};

using CameraInfo = sensor_msgs::CameraInfo_<Allocator<char>>;
using Image = sensor_msgs::Image_<Allocator<char>>;
using Imu = sensor_msgs::Imu_<Allocator<char>>;
using Odometry = nav_msgs::Odometry_<Allocator<char>>;
using String = std_msgs::String_<Allocator<char>>;
using TfMessage = tf2_msgs::TFMessage_<Allocator<char>>;
using TransformStamped = geometry_msgs::TransformStamped_<Allocator<char>>;

}  // namespace dsg::simulator::ros_messages
