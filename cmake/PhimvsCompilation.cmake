# Warnings and floating-point rules that all targets share.
add_library(phimvs_compilation INTERFACE)
set_target_properties(phimvs_compilation PROPERTIES EXPORT_NAME compilation)
target_compile_features(phimvs_compilation INTERFACE cxx_std_20)
string(REGEX MATCH "^(aarch64|arm64)" phimvs_is_arm "${CMAKE_SYSTEM_PROCESSOR}")
target_compile_options(phimvs_compilation INTERFACE
  $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wno-unknown-pragmas>>
  # GCC 12 sees overlaps in its own std::string (bug 105329).
  $<BUILD_INTERFACE:$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-Wno-restrict>>
  # Contraction is written out with std::fma where it is wanted, so that results do not depend on the compiler's choice.
  $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>
  # Eigen fuses by itself where the compiler says that an ARM processor can; on x86-64 it does not. clang's own headers need the macro.
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>,$<BOOL:${phimvs_is_arm}>>:-U__ARM_FEATURE_FMA>
  # Nobody reads floating-point flags or the errno of a square root: loops with comparisons and roots become vector instructions.
  # No value changes by either.
  $<$<COMPILE_LANGUAGE:CXX>:-fno-trapping-math>
  $<$<COMPILE_LANGUAGE:CXX>:-fno-math-errno>)
# What users include is in include/phimvs; it takes the rest from detail/ once it is installed.
target_include_directories(phimvs_compilation INTERFACE
  "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}>" "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>"
  "$<BUILD_INTERFACE:${CMAKE_CURRENT_BINARY_DIR}/include>"
  "$<INSTALL_INTERFACE:include>" "$<INSTALL_INTERFACE:include/phimvs/detail>")

option(PHIMVS_COMPILER_CACHE "Compile through ccache where it is installed" ON)
find_program(PHIMVS_CCACHE ccache)
if(PHIMVS_COMPILER_CACHE AND PHIMVS_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Paths within the checkout count from the build folder, so that other builds and checkouts find the file as well.
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}" "${PHIMVS_CCACHE}")
endif()

# What many files of a folder include and instantiate is then compiled once for all of them.
option(PHIMVS_WHOLE_FOLDERS "Compile the files of a folder together; OFF: a longer first build, shorter ones after a change" ON)
# ALONE: files that use a name as others of their folder do, or that include themselves.
function(phimvs_compile_whole_folders target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "ALONE")
  if(NOT PHIMVS_WHOLE_FOLDERS)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  list(TRANSFORM arg_ALONE PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  get_target_property(sources ${target} SOURCES)
  list(REMOVE_ITEM sources ${arg_ALONE})
  foreach(source ${sources})
    cmake_path(IS_PREFIX CMAKE_CURRENT_BINARY_DIR "${source}" is_generated)
    cmake_path(GET source PARENT_PATH folder)
    cmake_path(GET folder FILENAME folder)
    if(NOT is_generated)  # one of them changes with each commit
      set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${folder}")
    endif()
  endforeach()
endfunction()
