# `cmake --install`, and a Debian package by `cpack` in the build folder.
include(GNUInstallDirs)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME program)
install(TARGETS phimvs RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(PROGRAMS scripts/colmap-phi DESTINATION "${CMAKE_INSTALL_BINDIR}")
# The same stand-in named `colmap`, in a folder of its own: PATH=<prefix>/libexec/phimvs:$PATH makes programs use it.
install(PROGRAMS scripts/colmap-phi DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/phimvs" RENAME colmap)
install(PROGRAMS scripts/compare_with_colmap DESTINATION "${CMAKE_INSTALL_BINDIR}" RENAME phimvs-compare-with-colmap)
install(PROGRAMS scripts/points_lost DESTINATION "${CMAKE_INSTALL_BINDIR}" RENAME phimvs-points-lost)
# Laid out as in the source, so that the README's links and pictures are there.
install(FILES README.md CONTRIBUTING.md CITATION.cff DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY docs DESTINATION "${CMAKE_INSTALL_DOCDIR}")

# Man page and completions, from the program's own descriptions.
find_package(Python3 COMPONENTS Interpreter)
if(Python3_Interpreter_FOUND)
  set(pages "${CMAKE_CURRENT_BINARY_DIR}/pages")
  add_custom_command(OUTPUT "${pages}/phimvs.1" DEPENDS phimvs scripts/command_pages
    COMMAND "${Python3_EXECUTABLE}" "${CMAKE_CURRENT_SOURCE_DIR}/scripts/command_pages" $<TARGET_FILE:phimvs> "${pages}"
    COMMAND sh -c "gzip -9nf \"$1\"/*.1 && gzip -dkf \"$1\"/phimvs.1.gz" sh "${pages}" VERBATIM)
  add_custom_target(phimvs_pages ALL DEPENDS "${pages}/phimvs.1")
  install(DIRECTORY "${pages}/" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" FILES_MATCHING PATTERN "*.1.gz")
  install(FILES "${pages}/phimvs" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions")
  install(FILES "${pages}/_phimvs" DESTINATION "${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions")
endif()

# What Debian asks of every package: copyright, and a changelog in its form.
file(READ THIRD_PARTY.md phimvs_third_party)
file(READ LICENSE phimvs_license)
configure_file(cmake/copyright.in "${CMAKE_CURRENT_BINARY_DIR}/debian/copyright" @ONLY)
string(TIMESTAMP phimvs_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(cmake/changelog.in "${CMAKE_CURRENT_BINARY_DIR}/debian/changelog" @ONLY)
execute_process(COMMAND gzip -9nf "${CMAKE_CURRENT_BINARY_DIR}/debian/changelog")
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/debian/copyright" "${CMAKE_CURRENT_BINARY_DIR}/debian/changelog.gz"
  DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(FILES cmake/lintian-overrides DESTINATION "${CMAKE_INSTALL_DATADIR}/lintian/overrides" RENAME phimvs)
install(FILES CHANGELOG.md DESTINATION "${CMAKE_INSTALL_DOCDIR}" RENAME CHANGES.md)

# The package holds the program alone; the library is installed by `cmake --install --component library`.
set(CPACK_INSTALL_CMAKE_PROJECTS "${CMAKE_BINARY_DIR};${PROJECT_NAME};program;/")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME phimvs)
set(CPACK_PACKAGE_VENDOR "The phimvs authors")
set(CPACK_PACKAGE_CONTACT "The phimvs authors <phimvs@users.noreply.github.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "dense multi-view stereo for COLMAP workspaces")
set(CPACK_PACKAGE_DESCRIPTION "phimvs makes depth and normal maps and coloured point clouds from photos
whose poses COLMAP has found. It takes COLMAP's workspaces, options and file
formats, runs on NVIDIA GPUs or on the CPU, and fills surfaces without texture
with planes.")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/OpenFolders.cmake")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # needs dpkg-dev
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS colmap)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS python3)
include(CPack)
