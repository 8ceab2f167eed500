# The card at hand where there is one, else a single architecture; preset 'package' sets the full list.
if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
  execute_process(COMMAND nvidia-smi --query-gpu=compute_cap --format=csv,noheader
    OUTPUT_VARIABLE phimvs_compute_caps RESULT_VARIABLE phimvs_smi_result ERROR_QUIET
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(phimvs_smi_result EQUAL 0 AND phimvs_compute_caps MATCHES "^[0-9]+\\.[0-9]+")
    string(REPLACE "\n" ";" phimvs_compute_caps "${phimvs_compute_caps}")
    list(REMOVE_DUPLICATES phimvs_compute_caps)
    string(REPLACE "." "" CMAKE_CUDA_ARCHITECTURES "${phimvs_compute_caps}")
  else()
    set(CMAKE_CUDA_ARCHITECTURES 90)
  endif()
  message(STATUS "CUDA architectures: ${CMAKE_CUDA_ARCHITECTURES}")
endif()
