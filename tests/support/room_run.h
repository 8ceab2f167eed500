// A synthetic room on disk, and the maps that the program makes of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/synthetic/room.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace test_support {

class RoomRun {
 public:
  // Writes the workspace to a folder of its own.
  explicit RoomRun(colmap_ext::SyntheticRoom room);

  // `phimvs patch_match_stereo` on the CPU backend, which is there on every machine.
  ProgramResult RunStereo(const std::vector<std::string>& options = {}) const;

  int num_views() const { return static_cast<int>(room_.scene.views.size()); }
  const colmap_ext::RenderedScene& scene() const { return room_.scene; }
  std::filesystem::path dense() const { return folder_ / "room/dense"; }
  phi::Array2D<float> Depth(int view, const std::string& kind) const;

 private:
  colmap_ext::SyntheticRoom room_;
  TemporaryFolder folder_;
};

// Pixels of all views, counted against the exact depth.
struct RoomScore {
  std::int64_t textured = 0;       // textured and seen by three or more views, the reference among them
  std::int64_t raw_correct = 0;    // of `textured`: the raw estimate is within 0.5 %
  std::int64_t kept_textured = 0;  // of `textured`: the filter kept the pixel
  std::int64_t kept_textured_correct = 0;  // of `kept_textured`: within 1 %
  std::int64_t kept = 0;                   // of all pixels, painted ones too
  std::int64_t kept_correct = 0;           // of `kept`: within 1 %

  double RawCorrectPercent() const { return 100.0 * raw_correct / textured; }
  double KeptTexturedPercent() const { return 100.0 * kept_textured / textured; }
  double KeptTexturedCorrectPercent() const { return 100.0 * kept_textured_correct / kept_textured; }
  double KeptCorrectPercent() const { return 100.0 * kept_correct / kept; }
};

RoomScore ScoreRoom(const RoomRun& run);

}  // namespace test_support
