# The library as another project takes it up from its sources, by FetchContent or add_subdirectory: the targets that find_package gives,
# and all that they link, are there. Only configured: what is compiled is the same.
# usage: cmake -DSOURCE=<source folder> -DOPENCV=<OpenCV's CMake folder> -DWORK=<scratch> -P source_library.cmake
if(CMAKE_VERSION VERSION_LESS 3.24)
  message("skipped: imported targets can be made global since CMake 3.24")
  return()
endif()
file(REMOVE_RECURSE "${WORK}")
file(WRITE "${WORK}/CMakeLists.txt" "cmake_minimum_required(VERSION 3.24)
project(taker LANGUAGES CXX)
add_subdirectory(\"${SOURCE}\" phimvs)
add_executable(taker \"${SOURCE}/examples/cpp/estimate_and_fuse.cc\")
target_link_libraries(taker PRIVATE phimvs::colmap_ext phimvs::phi)
")
execute_process(COMMAND "${CMAKE_COMMAND}" -S "${WORK}" -B "${WORK}/build" -DPHIMVS_CUDA=OFF "-DOpenCV_DIR=${OPENCV}"
  RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
message("${output}")
if(failed)
  message(FATAL_ERROR "cannot be configured")
endif()
if(EXISTS "${WORK}/build/phimvs/tests" OR EXISTS "${WORK}/build/CPackConfig.cmake")
  message(FATAL_ERROR "brings its tests or its package into another project")
endif()
