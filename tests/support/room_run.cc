#include "tests/support/room_run.h"

#include <cmath>
#include <utility>

#include "colmap_ext/measurement_file.h"
#include "tests/support/run_on_workspace.h"

namespace test_support {
namespace {

bool IsWithin(float depth, float truth, float relative_error) {
  return depth > 0 && std::abs(depth - truth) <= relative_error * truth;
}

void AddView(const RoomRun& run, int view, RoomScore* score) {
  const phi::Array2D<float> raw = run.Depth(view, "photometric"), measured = run.Depth(view, "measured");
  const phi::Array2D<int> other_views = colmap_ext::CountOtherViews(run.scene(), view);
  const phi::PlaneMap& truth = *run.scene().truth[view];
  const phi::Mask& textured = *run.scene().textured[view];
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const float depth = truth.data()[i].depth, kept_depth = measured.data()[i];
    const bool kept_correct = IsWithin(kept_depth, depth, 0.01f);
    score->kept += kept_depth > 0;
    score->kept_correct += kept_correct;
    if (textured.data()[i] == 0 || other_views.data()[i] < 2) continue;
    ++score->textured;
    score->raw_correct += IsWithin(raw.data()[i], depth, 0.005f);
    score->kept_textured += kept_depth > 0;
    score->kept_textured_correct += kept_correct;
  }
}

}  // namespace

RoomRun::RoomRun(colmap_ext::SyntheticRoom room) : room_(std::move(room)) {
  colmap_ext::WriteSyntheticRoom(room_, folder_ / "room");
}

ProgramResult RoomRun::RunStereo(const std::vector<std::string>& options) const {
  return RunOnWorkspace("patch_match_stereo", dense(), options);
}

phi::Array2D<float> RoomRun::Depth(int view, const std::string& kind) const {
  const std::string file = room_.scene.views[view].name + "." + kind + ".bin";
  return colmap_ext::ReadPublishedDepths(dense() / "stereo/depth_maps" / file);
}

RoomScore ScoreRoom(const RoomRun& run) {
  RoomScore score;
  for (int view = 0; view < run.num_views(); ++view) AddView(run, view, &score);
  return score;
}

}  // namespace test_support
