# SPDX-License-Identifier: Apache-2.0
# The few libraries of PCL that we use, as PclParts::pcl. Debian's own PCLConfig searches for VTK
# and MPI, which none of them needs.
find_path(PCL_INCLUDE_DIR pcl/point_types.h PATH_SUFFIXES pcl-1.13)
set(PCL_PARTS_LIBRARIES)
set(PCL_PARTS_REQUIRED)
foreach(part common kdtree octree search sample_consensus filters features segmentation keypoints)
  find_library(PCL_${part}_LIBRARY pcl_${part})
  list(APPEND PCL_PARTS_LIBRARIES ${PCL_${part}_LIBRARY})
  list(APPEND PCL_PARTS_REQUIRED PCL_${part}_LIBRARY)
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(PclParts REQUIRED_VARS PCL_INCLUDE_DIR ${PCL_PARTS_REQUIRED})
if(PclParts_FOUND AND NOT TARGET PclParts::pcl)
  find_package(Eigen3 REQUIRED)
  add_library(PclParts::pcl INTERFACE IMPORTED)
  target_include_directories(PclParts::pcl SYSTEM INTERFACE ${PCL_INCLUDE_DIR})
  target_link_libraries(PclParts::pcl INTERFACE ${PCL_PARTS_LIBRARIES} Eigen3::Eigen)
endif()
