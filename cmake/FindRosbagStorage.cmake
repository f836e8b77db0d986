# SPDX-License-Identifier: Apache-2.0
# ROS 1 bags: RosbagStorage::rosbag_storage, with the message headers that stand beside it.
# Debian's own config asks for packages that it does not ship, and the headers of the ROS 2 packages
# that rosbag/bag.h includes sit one folder deeper than it looks for them.
if(TARGET RosbagStorage::rosbag_storage)
  return()
endif()

find_path(RosbagStorage_INCLUDE_DIR rosbag/bag.h)
set(RosbagStorage_wanted RosbagStorage_INCLUDE_DIR)
set(RosbagStorage_includes ${RosbagStorage_INCLUDE_DIR})
foreach(package pluginlib class_loader rcutils rcpputils ament_index_cpp)
  find_path(RosbagStorage_${package}_DIR ${package} PATH_SUFFIXES ${package} NO_CACHE
    PATHS /usr/include NO_DEFAULT_PATH)
  list(APPEND RosbagStorage_includes ${RosbagStorage_${package}_DIR})
  list(APPEND RosbagStorage_wanted RosbagStorage_${package}_DIR)
endforeach()
# A message of each package that is written or read.
foreach(message sensor_msgs/Image std_msgs/String geometry_msgs/Transform nav_msgs/Odometry
    tf2_msgs/TFMessage)
  string(MAKE_C_IDENTIFIER ${message} name)
  find_path(RosbagStorage_${name}_DIR ${message}.h)
  list(APPEND RosbagStorage_wanted RosbagStorage_${name}_DIR)
endforeach()
foreach(library rosbag_storage roscpp_serialization rostime cpp_common console_bridge)
  find_library(RosbagStorage_${library}_LIBRARY ${library})
  list(APPEND RosbagStorage_libraries ${RosbagStorage_${library}_LIBRARY})
  list(APPEND RosbagStorage_wanted RosbagStorage_${library}_LIBRARY)
endforeach()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(RosbagStorage REQUIRED_VARS ${RosbagStorage_wanted}
  REASON_FAILURE_MESSAGE "install librosbag-storage-dev libsensor-msgs-dev libnav-msgs-dev libtf2-msgs-dev")

if(RosbagStorage_FOUND)
  list(REMOVE_DUPLICATES RosbagStorage_includes)
  add_library(RosbagStorage::rosbag_storage INTERFACE IMPORTED GLOBAL)
  # Headers of imported targets are system headers: their warnings are not ours.
  target_include_directories(RosbagStorage::rosbag_storage INTERFACE ${RosbagStorage_includes})
  target_link_libraries(RosbagStorage::rosbag_storage INTERFACE ${RosbagStorage_libraries})
endif()
