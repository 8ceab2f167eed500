#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/workspace.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/run_on_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/map_workspace.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/views_model.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::Not;

bool InHole(int x, int y) { return x >= 60 && x < 100 && y >= 45 && y < 75; }

std::string MapName(int view, const std::string& kind) {
  return "view" + std::to_string(view) + ".png." + kind + ".bin";
}

// A workspace as another program leaves it: exact .geometric.bin maps of an oblique plane, each with a hole.
class ForeignWorkspace {
 public:
  ForeignWorkspace() : scene_(test_support::PlaneScene()) {
    std::vector<std::string> names;
    std::string config;
    for (std::size_t i = 0; i < scene_.views.size(); ++i) {
      const std::string name = "view" + std::to_string(i) + ".png";
      names.push_back(name);
      colmap_ext::WriteGrayImage(path() / "images" / name, *scene_.images[i]);
      phi::PlaneMap map = *scene_.truth[i];
      for (int y = 0; y < map.height(); ++y) {
        for (int x = 0; x < map.width(); ++x) {
          if (InHole(x, y)) map(x, y) = {};
        }
      }
      colmap_ext::WritePlaneMap(path() / "stereo/depth_maps" / MapName(static_cast<int>(i), "geometric"),
                                path() / "stereo/normal_maps" / MapName(static_cast<int>(i), "geometric"),
                                map);
      config += name + "\n__all__\n";
    }
    colmap_ext::WriteSparseModelBinary(test_support::ModelOfViews(scene_, names), path() / "sparse");
    test_support::WriteBytes(path() / "stereo/patch-match.cfg", config);
  }

  const fs::path& path() const { return folder_.path(); }
  int num_views() const { return static_cast<int>(scene_.views.size()); }
  const phi::PlaneMap& truth(int view) const { return *scene_.truth[view]; }

  phi::Array2D<float> Depth(int view, const std::string& kind) const {
    return colmap_ext::ReadDepthMap(path() / "stereo/depth_maps" / MapName(view, kind));
  }
  ProgramResult Fill(const std::string& mode) const {
    return Run({"--PhiInference.mode", mode, "--overwrite", "true"});
  }
  ProgramResult Run(const std::vector<std::string>& options) const {
    return test_support::RunOnWorkspace("hole_filler", path(), options);
  }
  ProgramResult Stereo(const std::vector<std::string>& options) const {
    std::vector<std::string> words = {"--PatchMatchStereo.num_iterations", "2",
                                      "--PatchMatchStereo.depth_min",      "1",
                                      "--PatchMatchStereo.depth_max",      "10"};
    words.insert(words.end(), options.begin(), options.end());
    return test_support::RunOnWorkspace("patch_match_stereo", path(), words);
  }
  // Content of all maps and masks, by path.
  std::map<std::string, std::string> Files() const { return test_support::ReadMaps(path()); }

 private:
  TemporaryFolder folder_;
  colmap_ext::RenderedScene scene_;
};

TEST(HoleFillerCommand, FillsMapsOfAnotherProgramAndRepeatsItself) {
  const ForeignWorkspace workspace;
  const phi::Array2D<float> before = workspace.Depth(0, "geometric");
  const ProgramResult result = workspace.Fill("mrf");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (int view = 0; view < workspace.num_views(); ++view) {
    const phi::Array2D<float> depth = workspace.Depth(view, "geometric");
    int filled = 0, right = 0;
    for (int y = 45; y < 75; ++y) {
      for (int x = 60; x < 100; ++x) {
        filled += depth(x, y) > 0;
        right += std::abs(depth(x, y) / workspace.truth(view)(x, y).depth - 1) < 1e-3f;
      }
    }
    EXPECT_GT(filled, 0.95 * 40 * 30) << "view " << view;
    EXPECT_GT(right, 0.95 * filled) << "view " << view;
  }
  // What was measured is unchanged or, where no view confirms it, gone.
  const phi::Array2D<float> after = workspace.Depth(0, "geometric"),
                            measured = workspace.Depth(0, "measured");
  for (std::size_t i = 0; i < before.size(); ++i) {
    ASSERT_EQ(measured.data()[i], before.data()[i]);
    if (before.data()[i] > 0 && after.data()[i] > 0) {
      ASSERT_EQ(after.data()[i], before.data()[i]);
    }
  }
  const phi::Mask mask = colmap_ext::ReadMask(workspace.path() / "stereo/filled_masks/view0.png.png");
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) ASSERT_EQ(mask(x, y) == 255, InHole(x, y) && after(x, y) > 0);
  }

  const auto files = workspace.Files();
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  EXPECT_EQ(workspace.Files(), files);
}

// The plane goes through the distance of 4 within the hole.
TEST(HoleFillerCommand, KeepsToTheDepthsThatAreGiven) {
  struct Range {
    std::string nearest, farthest;
  };
  for (const Range& range : {Range{"1", "4"}, Range{"4", "10"}}) {
    const ForeignWorkspace workspace;
    const ProgramResult result = workspace.Run(
        {"--overwrite", "true", "--PatchMatchStereo.depth_min", range.nearest, "--PatchMatchStereo.depth_max", range.farthest});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const phi::Array2D<float> depth = workspace.Depth(0, "geometric");
    int num_inside = 0, num_beyond = 0;  // of the hole's pixels that have depth
    for (int y = 45; y < 75; ++y) {
      for (int x = 60; x < 100; ++x) {
        if (!(depth(x, y) > 0)) continue;
        const bool is_inside = depth(x, y) >= std::stof(range.nearest) && depth(x, y) <= std::stof(range.farthest);
        ++(is_inside ? num_inside : num_beyond);
      }
    }
    EXPECT_GT(num_inside, 100) << range.nearest;
    EXPECT_EQ(num_beyond, 0) << range.nearest;
  }
}

TEST(HoleFillerCommand, DepthsBesideTheSparsePointsAreToldOf) {
  const TemporaryFolder folder;
  test_support::WriteMapWorkspace(test_support::PlaneScene(), folder.path());
  test_support::WriteBytes(folder / "stereo/patch-match.cfg", test_support::MapWorkspaceImageName(0) + "\n__all__\n");
  const ProgramResult result = test_support::RunOnWorkspace(
      "hole_filler", folder.path(),
      {"--overwrite", "true", "--PatchMatchStereo.depth_min", "1000", "--PatchMatchStereo.depth_max", "4000"});
  EXPECT_THAT(result.errors, HasSubstr("warning: --PatchMatchStereo.depth_min and depth_max, 1000 to 4000, hold 0.0 % of the sparse"));
}

// The hole's depth is given as 0 and as -4: the same maps come out.
TEST(HoleFillerCommand, ANegativeDepthOfAnotherProgramIsNone) {
  const ForeignWorkspace zero, negative;
  const fs::path maps = negative.path() / "stereo/depth_maps";
  for (int view = 0; view < negative.num_views(); ++view) {
    phi::Array2D<float> depth = negative.Depth(view, "geometric");
    for (int y = 45; y < 75; ++y) {
      for (int x = 60; x < 100; ++x) depth(x, y) = -4;
    }
    colmap_ext::WriteDepthMap(maps / MapName(view, "geometric"), depth);
  }
  ASSERT_EQ(zero.Fill("mrf").exit_code, 0);
  ASSERT_EQ(negative.Fill("mrf").exit_code, 0);
  for (int view = 0; view < negative.num_views(); ++view) {
    for (const std::string kind : {"measured", "geometric"}) {
      const fs::path file = fs::path("stereo/depth_maps") / MapName(view, kind);
      EXPECT_EQ(ReadBytes(zero.path() / file), ReadBytes(negative.path() / file)) << file;
    }
  }
}

// They were published, with depth beside them. What is left out is filled as a hole.
TEST(HoleFillerCommand, NormalsOfAnotherProgramThatAreNotFiniteAreNone) {
  const ForeignWorkspace workspace;
  const auto path = [&](const std::string& kind) { return workspace.path() / "stereo/normal_maps" / MapName(0, kind); };
  phi::Array2D<phi::Vec3f> normals = colmap_ext::ReadNormalMap(path("geometric"));
  const float nan = std::nanf(""), infinite = HUGE_VALF;
  for (int x = 60; x < 100; ++x) normals(x, 30) = x % 2 == 0 ? phi::Vec3f{nan, nan, nan} : phi::Vec3f{0, infinite, -infinite};
  colmap_ext::WriteNormalMap(path("geometric"), normals);
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  for (const std::string kind : {"measured", "geometric"}) {
    for (const phi::Vec3f& n : colmap_ext::ReadNormalMap(path(kind))) ASSERT_TRUE(std::isfinite(n.x + n.y + n.z)) << kind;
  }
  int num_filled = 0;
  for (int x = 60; x < 100; ++x) num_filled += workspace.Depth(0, "geometric")(x, 30) > 0;
  EXPECT_GT(num_filled, 30);
}

// Some measured pixels of the first image become clues: by the mask beside the map, or as earlier versions wrote them, by
// negative depths. Returns what filling made of the map.
std::string FilledWithClues(const std::string& mode, bool as_earlier_versions) {
  const ForeignWorkspace workspace;
  EXPECT_EQ(workspace.Fill("mrf").exit_code, 0);
  const fs::path measured = workspace.path() / "stereo/depth_maps" / MapName(0, "measured");
  const fs::path mask_path = workspace.path() / "stereo/filled_masks/view0.png.measured.png";
  const phi::Array2D<float> depth = colmap_ext::ReadDepthMap(measured);
  phi::Array2D<float> marked = depth;
  phi::Mask mask = colmap_ext::ReadMask(mask_path);
  for (int x = 10; x < 50; ++x) {
    EXPECT_EQ(mask(x, 20), 0);
    if (as_earlier_versions) marked(x, 20) *= -1;
    if (!as_earlier_versions) mask(x, 20) = colmap_ext::kClueValue;
  }
  colmap_ext::WriteDepthMap(measured, marked);
  colmap_ext::WriteMask(mask_path, mask);
  EXPECT_EQ(workspace.Fill(mode).exit_code, 0);
  const phi::Array2D<float> published = workspace.Depth(0, "geometric");
  for (int x = 10; x < 50; ++x) {
    EXPECT_EQ(workspace.Depth(0, "measured")(x, 20), marked(x, 20));
    const float expected = mode == "off" ? 0 : depth(x, 20);
    EXPECT_NEAR(published(x, 20), expected, 1e-3f * expected) << mode << ", " << x;
  }
  return ReadBytes(workspace.path() / "stereo/depth_maps" / MapName(0, "geometric"));
}

// The published map does not show them, filled or not.
TEST(HoleFillerCommand, CluesAreNotPublished) {
  for (const std::string mode : {"mrf", "off"}) {
    EXPECT_EQ(FilledWithClues(mode, false), FilledWithClues(mode, true)) << mode;
  }
}

// The depths of the first image are given as negative where there are none, which measured maps must not hold.
TEST(HoleFillerCommand, ReplacesNothingUnaskedAndPutsBackWhatItReplaced) {
  const ForeignWorkspace workspace;
  const fs::path first = workspace.path() / "stereo/depth_maps" / MapName(0, "geometric");
  phi::Array2D<float> depth = workspace.Depth(0, "geometric");
  for (float& d : depth) d = d > 0 ? d : -1;
  colmap_ext::WriteDepthMap(first, depth);
  const auto originals = workspace.Files();

  const ProgramResult refused = workspace.Run({});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.errors,
              HasSubstr("was made by another program, and filling replaces it; add --overwrite"));
  EXPECT_EQ(workspace.Files(), originals);
  EXPECT_EQ(workspace.Run({"--restore", "true"}).exit_code, 2) << "nothing was filled yet";

  ASSERT_EQ(workspace.Run({"--overwrite", "true"}).exit_code, 0);
  EXPECT_NE(workspace.Files(), originals);
  EXPECT_EQ(workspace.Run({}).exit_code, 0) << "the filled maps are its own";
  const fs::path confidences = workspace.path() / "stereo/confidence_maps" / MapName(1, "geometric"),
                 foreign = workspace.path() / "stereo/confidence_maps" / "of no image.geometric.bin";
  for (const fs::path& path : {confidences, foreign}) test_support::WriteBytes(path, "rests on the filled map, too");
  const ProgramResult restored = workspace.Run({"--restore", "true"});
  EXPECT_EQ(restored.exit_code, 0) << restored.errors;
  EXPECT_FALSE(fs::exists(confidences));
  EXPECT_TRUE(fs::remove(foreign)) << "it is not ours";
  EXPECT_EQ(workspace.Files(), originals);
  EXPECT_EQ(workspace.Run({}).exit_code, 2) << "they are the other program's again";
}

// A file is renamed or not: after so many of the steps for one image, the same command does the rest.
TEST(HoleFillerCommand, AKilledRestoreGoesOn) {
  const ForeignWorkspace workspace;
  const auto originals = workspace.Files();
  const auto path = [&](const char* folder, const char* kind) {
    return workspace.path() / "stereo" / folder / MapName(0, kind);
  };
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  fs::rename(path("normal_maps", "measured"), path("normal_maps", "geometric"));
  const ProgramResult restored = workspace.Run({"--restore", "true"});
  EXPECT_EQ(restored.exit_code, 0) << restored.errors;
  EXPECT_EQ(workspace.Files(), originals);

  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  fs::remove(path("normal_maps", "measured"));
  const auto filled = workspace.Files();
  EXPECT_EQ(workspace.Run({"--restore", "true"}).exit_code, 0);
  for (const char* folder : {"depth_maps", "normal_maps"}) {
    const fs::path geometric = fs::relative(path(folder, "geometric"), workspace.path());
    EXPECT_EQ(workspace.Files().at(geometric), filled.at(geometric)) << "its original normals are lost";
  }
}

// The first maps hold a negative depth, and so have another name than the later ones' originals.
TEST(HoleFillerCommand, RestorePutsBackTheLastMapsOfTheOtherProgram) {
  const ForeignWorkspace workspace, again;
  const fs::path maps = workspace.path() / "stereo/depth_maps";
  phi::Array2D<float> depth = workspace.Depth(0, "geometric");
  depth(60, 45) = -1;
  colmap_ext::WriteDepthMap(maps / MapName(0, "geometric"), depth);
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  for (const char* folder : {"stereo/depth_maps", "stereo/normal_maps"}) {
    fs::copy(again.path() / folder, workspace.path() / folder, fs::copy_options::overwrite_existing);
  }
  depth(60, 45) = 7;
  colmap_ext::WriteDepthMap(maps / MapName(0, "geometric"), depth);
  const std::string last = ReadBytes(maps / MapName(0, "geometric"));
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  ASSERT_EQ(workspace.Run({"--restore", "true"}).exit_code, 0);
  EXPECT_EQ(ReadBytes(maps / MapName(0, "geometric")), last);
}

// The measured maps are phimvs's own there.
TEST(HoleFillerCommand, RestoreLeavesMapsOfPatchMatchStereoAlone) {
  const ForeignWorkspace workspace;
  ASSERT_EQ(workspace.Stereo({"--overwrite", "true"}).exit_code, 0);
  ASSERT_EQ(workspace.Run({}).exit_code, 0);
  const auto files = workspace.Files();
  const ProgramResult result = workspace.Run({"--restore", "true"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("--PhiInference.mode off"));
  EXPECT_EQ(workspace.Files(), files);
}

TEST(HoleFillerCommand, OffTakesFilledDepthsBackOut) {
  const ForeignWorkspace workspace;
  const std::string depth = workspace.path() / "stereo/depth_maps/view1.png.geometric.bin";
  const std::string original = ReadBytes(depth);
  ASSERT_EQ(workspace.Fill("min_cost").exit_code, 0);
  EXPECT_NE(ReadBytes(depth), original);
  ASSERT_EQ(workspace.Fill("off").exit_code, 0);
  EXPECT_EQ(ReadBytes(depth), original);
  EXPECT_FALSE(fs::exists(workspace.path() / "stereo/filled_masks/view1.png.png"));
}

// The other program's maps and their copies are not for patch_match_stereo to replace unasked.
TEST(HoleFillerCommand, LeavesAWorkspaceThatBothCommandsGoOnFrom) {
  const ForeignWorkspace workspace;
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  const auto files = workspace.Files();
  const ProgramResult refused = workspace.Stereo({});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.errors, HasSubstr("was not made by phimvs patch_match_stereo; add --overwrite true"));
  EXPECT_EQ(workspace.Files(), files);
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  EXPECT_EQ(workspace.Files(), files);

  // From then on all maps are phimvs's own, and each command starts from the measured ones.
  const ProgramResult replaced = workspace.Stereo({"--overwrite", "true"});
  ASSERT_EQ(replaced.exit_code, 0) << replaced.errors;
  const auto own = workspace.Files();
  EXPECT_NE(own, files);
  ASSERT_EQ(workspace.Fill("min_cost").exit_code, 0);
  const ProgramResult again = workspace.Stereo({});
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_EQ(workspace.Files(), own);
}

// What is fused is what the last run meant, or a warning says so.
TEST(StaleMaps, AreNamedBeforeTheyAreFused) {
  const ForeignWorkspace workspace;
  const auto fuse = [&](const std::string& type) {
    return RunProgram({PHIMVS_BINARY, "stereo_fusion", "--workspace_path", workspace.path(), "--output_path",
                       workspace.path() / "fused.ply", "--input_type", type});
  };
  EXPECT_THAT(fuse("geometric").errors, Not(HasSubstr("warning"))) << "all are another program's";
  ASSERT_EQ(workspace.Stereo({"--overwrite", "true"}).exit_code, 0);
  EXPECT_THAT(fuse("geometric").errors, Not(HasSubstr("of the last run")));
  ASSERT_EQ(workspace.Stereo({"--PatchMatchStereo.geom_consistency", "false"}).exit_code, 0);
  EXPECT_THAT(
      fuse("geometric").errors,
      HasSubstr(
          "geometric maps, view0.png the first, were made with other options than those of the last run"));
  EXPECT_THAT(fuse("photometric").errors, Not(HasSubstr("of the last run")));
  ASSERT_EQ(workspace.Stereo({}).exit_code, 0);
  EXPECT_THAT(fuse("geometric").errors, Not(HasSubstr("of the last run")));
  ASSERT_EQ(workspace.Run({}).exit_code, 0);
  for (const std::string type : {"geometric", "measured", "photometric"}) {
    EXPECT_THAT(fuse(type).errors, Not(HasSubstr("of the last run"))) << type;
  }
}

TEST(StaleMaps, OfAFailedImageSayThatItFailed) {
  const ForeignWorkspace workspace;
  ASSERT_EQ(workspace.Stereo({"--overwrite", "true"}).exit_code, 0);
  test_support::WriteBytes(workspace.path() / "images/view1.png", "no photo");
  ASSERT_EQ(workspace.Stereo({}).exit_code, 4);
  const ProgramResult fused = RunProgram({PHIMVS_BINARY, "stereo_fusion", "--workspace_path", workspace.path(), "--output_path",
                                          workspace.path() / "fused.ply"});
  EXPECT_THAT(fused.errors, HasSubstr("geometric maps, view1.png the first, are of an earlier run, since their images failed in the last one"));
  EXPECT_THAT(fused.errors, Not(HasSubstr("a run that stopped")));
}

// Its earlier map is no result of the run, and stays.
TEST(HoleFillerCommand, StatusTellsOfAPhotoThatIsMissing) {
  const ForeignWorkspace workspace;
  const fs::path photo = workspace.path() / "images/view1.png", geometric = workspace.path() / "stereo/depth_maps/view1.png.geometric.bin";
  const auto status = [&] { return RunProgram({PHIMVS_BINARY, "status", "--workspace_path", workspace.path()}).output; };
  ASSERT_EQ(workspace.Fill("min_cost").exit_code, 0);
  EXPECT_THAT(status(), Not(HasSubstr("failed: ")));
  const std::string before = ReadBytes(geometric);
  fs::rename(photo, workspace.path() / "away.png");
  EXPECT_EQ(workspace.Fill("min_cost").exit_code, 4);
  EXPECT_THAT(status(), HasSubstr("failed: view1.png (geometric): the file " + photo.string() + " is missing"));
  EXPECT_EQ(ReadBytes(geometric), before);
  fs::rename(workspace.path() / "away.png", photo);
  EXPECT_EQ(workspace.Fill("min_cost").exit_code, 0);
  EXPECT_THAT(status(), Not(HasSubstr("failed: ")));
  EXPECT_EQ(ReadBytes(geometric), before);
}

// What was inferred once must never come back as measured.
TEST(HoleFillerCommand, DoesNotTakeItsOwnMapsForMeasuredOnes) {
  const ForeignWorkspace workspace;
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  const auto files = workspace.Files();
  const fs::path record = workspace.path() / "stereo/phimvs.json";
  fs::remove(record);
  ASSERT_EQ(workspace.Fill("mrf").exit_code, 0);
  EXPECT_EQ(workspace.Files(), files);

  const fs::path measured = workspace.path() / "stereo/depth_maps/view1.png.measured.bin";
  const std::string geometric = ReadBytes(workspace.path() / "stereo/depth_maps/view1.png.geometric.bin");
  for (const bool with_record : {true, false}) {
    if (!with_record) fs::remove(record);
    fs::resize_file(measured, 1000);
    const ProgramResult result = workspace.Fill("mrf");
    EXPECT_EQ(result.exit_code, 4) << result.errors;
    EXPECT_THAT(result.errors,
                HasSubstr("image view1.png: its measured maps are missing, damaged or of another size"));
    EXPECT_EQ(fs::file_size(measured), 1000u);
    EXPECT_EQ(ReadBytes(workspace.path() / "stereo/depth_maps/view1.png.geometric.bin"), geometric);
  }
}

// Damaged maps are failures, now and in a second run; no maps at all are none.
TEST(HoleFillerCommand, SaysOfEachImageWhyItsMapsCannotBeFilled) {
  const ForeignWorkspace workspace;
  const fs::path depths = workspace.path() / "stereo/depth_maps", normals = workspace.path() / "stereo/normal_maps";
  fs::remove(normals / MapName(0, "geometric"));
  fs::resize_file(depths / MapName(1, "geometric"), 1000);
  colmap_ext::WriteDepthMap(depths / MapName(2, "geometric"), phi::Array2D<float>(7, 5, 4));
  for (const fs::path& folder : {depths, normals}) fs::remove(folder / MapName(3, "geometric"));
  const std::string failed = ".png: its maps cannot be filled: ";
  for (int run = 0; run < 2; ++run) {
    const ProgramResult result = workspace.Fill("mrf");
    EXPECT_EQ(result.exit_code, 4);
    EXPECT_THAT(result.errors, HasSubstr("view0" + failed + (normals / MapName(0, "geometric")).string() + " is missing"));
    EXPECT_THAT(result.errors, HasSubstr("view1" + failed + (depths / MapName(1, "geometric")).string() + ": the file has 1000 bytes"));
    EXPECT_THAT(result.errors, HasSubstr("view2" + failed + (depths / MapName(2, "geometric")).string() + " has 7x5 pixels"));
    EXPECT_THAT(result.errors, HasSubstr("give the --PatchMatchStereo.max_image_size"));
    EXPECT_THAT(result.errors, HasSubstr("warning: image view3.png: left out, it has no maps to fill: "));
    EXPECT_THAT(result.errors, HasSubstr("warning: 1 of 5 images were left out:\n  view3.png: left out, it has no maps to fill: "));
    EXPECT_THAT(result.errors, HasSubstr("error: 3 of 4 images failed:\n  view0.png (measured): its maps cannot be filled: "));
  }
  const std::string status = RunProgram({PHIMVS_BINARY, "status", "--workspace_path", workspace.path()}).output;
  EXPECT_THAT(status, HasSubstr("failed: view1.png (geometric): its maps cannot be filled: "));
  EXPECT_THAT(status, Not(HasSubstr("failed: view3.png")));
}

// Whoever made them. It asked for cost maps, without which every image failed.
TEST(HoleFillerCommand, MapsThatAreThereHaveNoCostToFilterBy) {
  const ForeignWorkspace workspace, without;
  const std::string sentence = "warning: --PatchMatchStereo.filter_min_ncc has no effect: ";
  const ProgramResult result = workspace.Run({"--overwrite", "true", "--PatchMatchStereo.filter_min_ncc", "0.5"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr(sentence));
  EXPECT_THAT(without.Run({"--overwrite", "true"}).errors, Not(HasSubstr(sentence)));
  EXPECT_TRUE(workspace.Files() == without.Files());
}

TEST(HoleFillerCommand, SaysWhatIsMissing) {
  const ForeignWorkspace workspace;
  fs::remove_all(workspace.path() / "stereo/normal_maps");
  const ProgramResult result = workspace.Fill("mrf");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("run patch_match_stereo first"));
}

}  // namespace
