# Fails when an include points against the layers: phi <- cuda <- colmap_ext.
# usage: cmake -DROOT=<source folder> -P check_dependencies.cmake
set(violations "")

# Folders and system headers that the sources in `folder` must not include.
function(check_layer folder forbidden)
  file(GLOB_RECURSE sources "${ROOT}/${folder}/*.h" "${ROOT}/${folder}/*.cc" "${ROOT}/${folder}/*.cu" "${ROOT}/${folder}/*.cuh")
  if(NOT sources)
    message(FATAL_ERROR "no sources in ${ROOT}/${folder}")
  endif()
  foreach(source ${sources})
    file(STRINGS "${source}" includes REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](${forbidden})")
    foreach(include ${includes})
      file(RELATIVE_PATH name "${ROOT}" "${source}")
      set(violations "${violations}\n  ${name}: ${include}")
    endforeach()
  endforeach()
  set(violations "${violations}" PARENT_SCOPE)
endfunction()

check_layer(phi "cuda|colmap_ext/|tests/|opencv2/|nlohmann/|boost/|thrust/|cub/")
if(EXISTS "${ROOT}/cuda")
  check_layer(cuda "colmap_ext/|tests/|opencv2/|nlohmann/|boost/")
endif()
check_layer(colmap_ext "tests/|cuda_runtime|thrust/|cub/")

if(violations)
  message(FATAL_ERROR "dependencies point one way, phi <- cuda <- colmap_ext; these includes do not:${violations}")
endif()
