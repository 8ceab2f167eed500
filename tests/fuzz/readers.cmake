# The sources that the readers of files need, for the fuzzer and for the test of the readers. Both compile these alone: a change
# of one is soon under test again, and a source that is missing here fails the build of the tests.
set(reader_sources
  atomic_file compact_codes compact_map config_lines dead_link file_locks fusion_config image_file input_file jpeg_decoder json_file map_file mask_file moved_image
  patch_match_config pinhole_camera plane_channels ply_writer png_decoder rig_frames sparse_model sparse_model_binary sparse_model_text terminal
  tiff_orientation workspace
  cli/option_help cli/option_parser cli/project_file cli/suggestion evaluation/crop_volume evaluation/meshlab_project evaluation/ply_rows
  fusion/bounding_box_file
  pipeline/file_identity pipeline/result_key pipeline/run_record
  pipeline/shard_journals pipeline/task_record)
set(reader_phi_sources base/array_memory base/log base/option base/rules base/utc_time geometry/camera
  geometry/image_correction)
list(TRANSFORM reader_sources REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/colmap_ext/\\1.cc")
list(TRANSFORM reader_phi_sources REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/phi/\\1.cc")

# An executable of the readers, their targets and `ARGN`.
function(phimvs_add_reader_executable name)
  add_executable(${name} ${ARGN} "${PROJECT_SOURCE_DIR}/tests/fuzz/targets.cc" ${reader_sources} ${reader_phi_sources})
  target_compile_definitions(${name} PRIVATE PHIMVS_VERSION="${PROJECT_VERSION}")
  target_include_directories(${name} SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
  target_link_libraries(${name} PRIVATE phimvs_compilation Eigen3::Eigen TBB::tbb Threads::Threads Boost::program_options
    nlohmann_json::nlohmann_json JPEG::JPEG PNG::PNG PkgConfig::LZ4 ${OpenCV_LIBS})
endfunction()
