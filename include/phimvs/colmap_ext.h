// Whole scenes, of target phimvs::colmap_ext: COLMAP's files, and the stages on a scene in memory.
//
// What these headers declare is public. What they include beside is not, and may change with every release.
#pragma once

#include "colmap_ext/build_info.h"                // commit and devices
#include "colmap_ext/image_file.h"                // photos
#include "colmap_ext/map_file.h"                  // depth and normal maps
#include "colmap_ext/pipeline/backend_choice.h"   // CPU and GPUs
#include "colmap_ext/pipeline/memory_scene.h"     // estimation, filling and fusion of a scene
#include "colmap_ext/pipeline/stereo_pipeline.h"  // patch_match_stereo on a workspace
#include "colmap_ext/progress.h"                  // how far a run is
#include "colmap_ext/sparse_model.h"              // sparse models
#include "colmap_ext/synthetic/room.h"            // a scene with exact truth
#include "colmap_ext/workspace.h"                 // undistorted workspaces, and scenes in memory
#include "phimvs/phi.h"
