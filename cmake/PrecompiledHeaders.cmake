# SPDX-License-Identifier: Apache-2.0
# Headers that most files include, compiled once for each kind of target. A file still includes all
# that it uses: a build with -DDSG_PCH=OFF compiles without them.
option(DSG_PCH "Precompile the headers that most files include" ON)

set(CORE_HEADERS <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <fstream> <functional>
  <limits> <map> <memory> <mutex> <numbers> <optional> <set> <span> <sstream> <string>
  <string_view> <thread> <tuple> <unordered_map> <utility> <variant> <vector>
  <Eigen/Core> <Eigen/Geometry>
  <absl/container/flat_hash_map.h> <absl/container/flat_hash_set.h> <absl/status/statusor.h>
  <absl/strings/numbers.h> <absl/strings/str_cat.h> <absl/strings/str_format.h>
  <absl/strings/str_join.h> <absl/strings/str_split.h> <absl/synchronization/mutex.h>)
set(RPC_HEADERS <dsg/v1/query_service.pb.h> <dsg/v1/ingest_service.pb.h>
  <dsg/v1/map_service.pb.h> <dsg/v1/maintenance_service.pb.h> <dsg/v1/errors.pb.h>)

# Release compiles with -O2, and with -O3 where a folder sets DSG_HOT: inner loops over poses, voxels,
# nodes and pixels. -O3 everywhere makes the build an eighth longer. gcc takes the level from the
# precompiled headers and not from the command line, so these folders have a set of their own.
if(CMAKE_BUILD_TYPE STREQUAL "Release" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(DSG_HOT_OPTIONS -O3)
endif()

# dsg_precompiled(name HEADERS ... LIBRARIES ...): one set of headers, as the target dsg_pch_<name>.
function(dsg_precompiled name)
  cmake_parse_arguments(ARG "" "" "HEADERS;LIBRARIES" ${ARGN})
  set(source ${PROJECT_BINARY_DIR}/precompiled_${name}.cc)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Carries the precompiled headers \"${name}\".\n")
  add_library(dsg_pch_${name} OBJECT EXCLUDE_FROM_ALL ${source})
  target_link_libraries(dsg_pch_${name} PRIVATE ${ARG_LIBRARIES})
  target_precompile_headers(dsg_pch_${name} PRIVATE ${ARG_HEADERS})
endfunction()

if(DSG_PCH)
  set(CORE_LIBRARIES Eigen3::Eigen absl::flat_hash_map absl::statusor absl::str_format
    absl::synchronization)
  dsg_precompiled(core HEADERS ${CORE_HEADERS} LIBRARIES ${CORE_LIBRARIES})
  dsg_precompiled(rpc HEADERS ${CORE_HEADERS} ${RPC_HEADERS}
    LIBRARIES ${CORE_LIBRARIES} dsg_proto)
  if(DSG_HOT_OPTIONS)
    dsg_precompiled(core_hot HEADERS ${CORE_HEADERS} LIBRARIES ${CORE_LIBRARIES})
    target_compile_options(dsg_pch_core_hot PRIVATE ${DSG_HOT_OPTIONS})
  endif()
  if(DSG_BUILD_TESTS)
    find_package(GTest REQUIRED)
    dsg_precompiled(core_test HEADERS ${CORE_HEADERS} <gtest/gtest.h>
      LIBRARIES ${CORE_LIBRARIES} GTest::gtest)
    dsg_precompiled(rpc_test HEADERS ${CORE_HEADERS} ${RPC_HEADERS} <gtest/gtest.h>
      LIBRARIES ${CORE_LIBRARIES} dsg_proto GTest::gtest)
  endif()
endif()

# Lets the target name use the set of its folder: DSG_HEADERS (core when unset), and for tests the
# set of that name with gtest. A folder with DSG_HOT uses core_hot, whatever
# its DSG_HEADERS: what else it includes, it parses.
function(dsg_use_precompiled name)
  set(headers ${DSG_HEADERS}${ARGN})
  if(DSG_HOT AND DSG_HOT_OPTIONS)
    target_compile_options(${name} PRIVATE ${DSG_HOT_OPTIONS})
    set(headers core_hot)
  endif()
  if(DSG_PCH)
    target_precompile_headers(${name} REUSE_FROM dsg_pch_${headers})
  endif()
endfunction()
set(DSG_HEADERS core)
