# Writes TARGET, the definitions of colmap_ext/build_info.h, where they changed.
# usage: cmake -DSOURCE=<tree> -DTARGET=<file> -DARCHITECTURES=<list> -P WriteBuildInfo.cmake
# A source tarball holds its commit in a file, a checkout in git.
set(commit unknown)
if(EXISTS "${SOURCE}/COMMIT")
  file(STRINGS "${SOURCE}/COMMIT" commit LIMIT_COUNT 1)
elseif(EXISTS "${SOURCE}/.git")
  execute_process(COMMAND git -C "${SOURCE}" rev-parse --short=7 HEAD
    OUTPUT_VARIABLE commit RESULT_VARIABLE failed ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(failed)
    set(commit unknown)
  endif()
endif()
string(REPLACE ";" ", " architectures "${ARCHITECTURES}")
set(text "#include \"colmap_ext/build_info.h\"\n
namespace colmap_ext {
const char* BuildCommit() { return \"${commit}\"; }
const char* CudaArchitectures() { return \"${architectures}\"; }
}  // namespace colmap_ext\n")
set(before "")
if(EXISTS "${TARGET}")
  file(READ "${TARGET}" before)
endif()
if(NOT before STREQUAL text)
  file(WRITE "${TARGET}" "${text}")
endif()
