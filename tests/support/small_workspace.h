// A workspace of three tiny images, written out by hand, for tests of formats and checks.
#pragma once

#include <filesystem>

#include "colmap_ext/sparse_model.h"

namespace test_support {

// Two cameras (PINHOLE 32x24, SIMPLE_PINHOLE 20x10), three images ('a.png', 'sub folder/b é.png', 'c.png'
// with the second camera), two points. Every number is exact in binary, and none equals another of its kind.
colmap_ext::SparseModel SmallModel();

// The model as .bin, gray PNG images and both cfg files with `__auto__, 20`.
void WriteSmallWorkspace(const std::filesystem::path& folder);

// EXPECTs equal models up to the order of images and points, and rotations up to `tolerance`.
void ExpectSameModel(const colmap_ext::SparseModel& a, const colmap_ext::SparseModel& b, double tolerance);

}  // namespace test_support
