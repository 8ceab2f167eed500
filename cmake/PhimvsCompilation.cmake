# Warnings and floating-point rules that all targets share.
add_library(phimvs_compilation INTERFACE)
target_compile_options(phimvs_compilation INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wno-unknown-pragmas>
  # GCC 12 sees overlaps in its own std::string (bug 105329).
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-Wno-restrict>
  # Contraction is written out with std::fma where it is wanted, so that results do not depend on the compiler's choice.
  $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>)
target_include_directories(phimvs_compilation INTERFACE "${CMAKE_CURRENT_SOURCE_DIR}")

find_program(PHIMVS_CCACHE ccache)
if(PHIMVS_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${PHIMVS_CCACHE}")
endif()
