# `cmake --install`, and a Debian package by `cpack` in the build folder.
include(GNUInstallDirs)
install(PROGRAMS scripts/colmap-phi DESTINATION "${CMAKE_INSTALL_BINDIR}")
# The same stand-in named `colmap`, in a folder of its own: PATH=<prefix>/libexec/phimvs:$PATH makes programs use it.
install(PROGRAMS scripts/colmap-phi DESTINATION "${CMAKE_INSTALL_LIBEXECDIR}/phimvs" RENAME colmap)
install(PROGRAMS scripts/compare_with_colmap DESTINATION "${CMAKE_INSTALL_BINDIR}" RENAME phimvs-compare-with-colmap)
install(PROGRAMS scripts/eth3d DESTINATION "${CMAKE_INSTALL_BINDIR}" RENAME phimvs-eth3d)
install(PROGRAMS scripts/ablation DESTINATION "${CMAKE_INSTALL_BINDIR}" RENAME phimvs-ablation)
install(PROGRAMS scripts/points_lost DESTINATION "${CMAKE_INSTALL_BINDIR}" RENAME phimvs-points-lost)
# Laid out as in the source, so that the README's links and pictures are there.
install(FILES README.md CHANGELOG.md CONTRIBUTING.md LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY docs DESTINATION "${CMAKE_INSTALL_DOCDIR}")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME phimvs)
set(CPACK_PACKAGE_VENDOR "The phimvs authors")
set(CPACK_PACKAGE_CONTACT "The phimvs authors <phimvs@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # needs dpkg-dev
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS colmap)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS python3)
include(CPack)
