// A tiny undistorted COLMAP workspace on disk, with subfolders in the image names, for tests of the program around
// the algorithm: its images are noise, so the maps mean nothing. Every image is a source of every other.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace test_support {

struct NoiseWorkspaceOptions {
  int num_images = 5;
  int width = 24, height = 16;
};

// Names of the images in the order of patch-match.cfg: "a/0.png", "a/1.png", ...
std::vector<std::string> WriteNoiseWorkspace(const std::filesystem::path& folder,
                                             const NoiseWorkspaceOptions& options = {});

// From then on each image has one source: the one before it in `names`, the first one the second.
void ReadNeighboursAlone(const std::filesystem::path& folder, const std::vector<std::string>& names);

// "relative path: hash of the bytes" of every map and mask below stereo/, in order. What is left out holds times.
std::vector<std::string> HashMaps(const std::filesystem::path& folder);

}  // namespace test_support
