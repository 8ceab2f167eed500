# `cmake --install` of the library: find_package(phimvs) then gives phimvs::phi and phimvs::colmap_ext. Component "library".
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(phimvs_package "${CMAKE_INSTALL_LIBDIR}/cmake/phimvs")

install(TARGETS phi phimvs_compilation EXPORT phimvsPhiTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT library)
set(phimvs_scene_targets colmap_ext)
if(PHIMVS_HAVE_CUDA)
  list(APPEND phimvs_scene_targets phi_cuda)
endif()
install(TARGETS ${phimvs_scene_targets} EXPORT phimvsColmapExtTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT library)
foreach(set Phi ColmapExt)
  install(EXPORT phimvs${set}Targets NAMESPACE phimvs:: DESTINATION "${phimvs_package}" COMPONENT library)
endforeach()

# Public: include/phimvs. What it includes: include/phimvs/detail.
install(DIRECTORY include/phimvs "${CMAKE_CURRENT_BINARY_DIR}/include/phimvs" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
  COMPONENT library FILES_MATCHING PATTERN "*.h")
install(DIRECTORY phi colmap_ext DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/phimvs/detail" COMPONENT library
  FILES_MATCHING PATTERN "*.h" PATTERN cli EXCLUDE PATTERN report EXCLUDE)

configure_package_config_file(cmake/phimvsConfig.cmake.in "${CMAKE_CURRENT_BINARY_DIR}/phimvsConfig.cmake"
  INSTALL_DESTINATION "${phimvs_package}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/phimvsConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/phimvsConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/phimvsConfigVersion.cmake"
  DESTINATION "${phimvs_package}" COMPONENT library)
