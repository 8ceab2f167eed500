# The sources that the readers of files need, for the fuzzer and for the test of the readers. Both are made of these alone: a
# change of one is soon under test again, and a source that is missing here fails the build of the tests.
set(reader_sources
  atomic_file compact_map config_lines fusion_config image_file input_file json_file map_file mask_file moved_image patch_match_config
  plane_channels ply_writer sparse_model sparse_model_binary sparse_model_text terminal tiff_orientation workspace
  cli/option_parser cli/suggestion evaluation/crop_volume evaluation/meshlab_project evaluation/ply_rows fusion/bounding_box_file
  pipeline/file_identity pipeline/result_key pipeline/run_record
  pipeline/shard_journals pipeline/task_record)
set(reader_phi_sources base/array_memory base/log base/option base/rules base/utc_time geometry/camera
  geometry/image_correction)
