// The algorithm, of target phimvs::phi: whole images in, whole maps and points out. No file is read or written.
//
// What these headers declare is public. What they include beside is not, and may change with every release.
#pragma once

#include "phi/backend.h"                // estimation, filter, inference of one image
#include "phi/base/cancellation.h"      // asking a computation to stop
#include "phi/base/error.h"             // what is thrown
#include "phi/base/log.h"               // where lines of log go
#include "phi/fusion/fusion_options.h"  // options of fusion
#include "phi/fusion/image_fusion.h"    // maps of one image and its neighbours to points
#include "phi/options.h"                // options of the stages
#include "phi/sparse_depth.h"           // depth range of a view, and the points that may initialise its depths
#include "phi/sparse_scene.h"           // sparse points and their tracks
#include "phi/view_selection.h"         // source images
#include "phimvs/version.h"
