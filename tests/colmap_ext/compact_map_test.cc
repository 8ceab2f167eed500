#include "colmap_ext/compact_codes.h"
#include "colmap_ext/compact_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using phi::PixelState;

bool SameBits(const phi::MeasurementMap& a, const phi::MeasurementMap& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.width() == y.width() && x.height() == y.height() && std::memcmp(x.data(), y.data(), x.bytes()) == 0;
  };
  return same(a.planes, b.planes) && same(a.states, b.states);
}

phi::Vec3f RandomNormal(std::mt19937* random) {
  std::normal_distribution<float> gauss;
  return phi::Normalized({gauss(*random), gauss(*random), gauss(*random)});
}

// Depths between 1 and `largest`, a seventh of the pixels without. 53 x 37 pixels: neither side is a number of whole blocks.
phi::MeasurementMap RandomMap(float largest, bool has_states, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> inverse(1 / largest, 1);
  phi::MeasurementMap map{phi::PlaneMap(53, 37), {}};
  if (has_states) map.states = phi::StateMap(53, 37);
  for (std::size_t i = 0; i < map.planes.size(); ++i) {
    if (random() % 7 == 0) continue;
    map.planes.data()[i] = {RandomNormal(&random), 1 / inverse(random)};
    if (has_states) map.states.data()[i] = static_cast<PixelState>(1 + random() % 4);
  }
  return map;
}

bool IsRefused(const std::vector<std::uint8_t>& bytes) {
  return test_support::InputErrorOf([&] { DecodeCompactMap(bytes, "that map"); }).starts_with("that map: ");
}

TEST(CompactMap, KeepsDepthsAndNormalsWithinWhatItPromises) {
  for (const float largest : {1.00001f, 1.5f, 5.0f, 1000.0f}) {
    const phi::MeasurementMap map = RandomMap(largest, true, 1), rounded = RoundToCompact(map);
    const double limit = largest <= 1.5f ? 4e-6 : largest <= 5 ? 3.1e-5 : 1.3e-4;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const phi::PlaneHypothesis &before = map.planes.data()[i], &after = rounded.planes.data()[i];
      ASSERT_EQ(before.depth > 0, after.depth > 0);
      if (!(before.depth > 0)) continue;
      ASSERT_NEAR(after.depth / before.depth, 1, limit) << "depths from 1 to " << largest;
      ASSERT_NEAR(phi::Norm(after.normal), 1, 1e-6);
      ASSERT_GT(phi::Dot(before.normal, after.normal), std::cos(0.06 * 3.14159265 / 180));
      ASSERT_EQ(map.states.data()[i], rounded.states.data()[i]);
    }
  }
}

TEST(CompactMap, ASmoothSurfaceKeepsItsDepthsToTheLastBits) {
  phi::MeasurementMap map{phi::PlaneMap(64, 48), {}};
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) map.planes(x, y) = {{0, 0, -1}, 4 + 1e-4f * static_cast<float>(x + 2 * y)};
  }
  const phi::MeasurementMap rounded = RoundToCompact(map);
  for (std::size_t i = 0; i < map.size(); ++i)
    ASSERT_EQ(map.planes.data()[i].depth, rounded.planes.data()[i].depth);
}

TEST(CompactMap, DepthsAloneAreThoseOfTheMapWithoutClues) {
  const test_support::TemporaryFolder folder;
  for (const bool has_states : {false, true}) {
    const phi::MeasurementMap map = RoundToCompact(RandomMap(5, has_states, 4));
    PrepareCompactMap(folder / "m.map", map)->Commit();
    for (const int max_rows : {37, 5}) {
      const auto [depths, map_height] = ReadCompactDepthRows(folder / "m.map", max_rows);
      EXPECT_EQ(map_height, 37);
      ASSERT_EQ(depths.width(), 53);
      ASSERT_EQ(depths.height(), max_rows);
      for (int y = 0; y < max_rows; ++y) {
        const int row = (2 * y + 1) * 37 / (2 * max_rows);
        for (int x = 0; x < 53; ++x) {
          const bool is_clue = has_states && map.states(x, row) == PixelState::kClue;
          ASSERT_EQ(depths(x, y), is_clue ? 0 : map.planes(x, row).depth) << x << " " << row;
        }
      }
    }
  }
  const std::string bytes = test_support::ReadBytes(folder / "m.map");
  test_support::WriteBytes(folder / "m.map", bytes.substr(0, bytes.size() - 1));
  EXPECT_THAT(test_support::InputErrorOf([&] { ReadCompactDepthRows(folder / "m.map", 5); }), ::testing::HasSubstr("m.map"));
}

TEST(CompactMap, GivesBackWhatWasRounded) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const float largest = std::pow(10.0f, static_cast<float>(seed) / 8);
    const phi::MeasurementMap rounded = RoundToCompact(RandomMap(largest, seed % 2 == 0, seed));
    ASSERT_TRUE(SameBits(RoundToCompact(rounded), rounded)) << seed;
    ASSERT_TRUE(SameBits(DecodeCompactMap(EncodeCompactMap(rounded), "map"), rounded)) << seed;
  }
}

// Every normal of every 89th row, the middle row and both ends among them.
TEST(CompactMap, NormalsOnceRoundedStay) {
  constexpr int kSide = 4095, kHalf = kSide / 2, kStep = 89, kRows = (kSide - 1) / kStep + 1;
  phi::MeasurementMap map{phi::PlaneMap(kSide, kRows), {}};
  for (int row = 0; row < kRows; ++row) {
    const int y = row * kStep;
    for (int x = 0; x < kSide; ++x) {
      float u = static_cast<float>(x - kHalf) / kHalf, v = static_cast<float>(y - kHalf) / kHalf;
      const float z = 1 - std::abs(u) - std::abs(v);
      if (z < 0) {
        const float fold = (1 - std::abs(v)) * (u >= 0 ? 1.0f : -1.0f);
        v = (1 - std::abs(u)) * (v >= 0 ? 1.0f : -1.0f);
        u = fold;
      }
      map.planes(x, row) = {phi::Normalized({u, v, -z}), 2};
    }
  }
  const phi::MeasurementMap rounded = RoundToCompact(map);
  EXPECT_TRUE(SameBits(RoundToCompact(rounded), rounded));
  for (std::size_t i = 0; i < map.size(); ++i)
    ASSERT_GT(phi::Dot(map.planes.data()[i].normal, rounded.planes.data()[i].normal), 1 - 5e-7);
}

TEST(CompactMap, WhatIsNoDepthIsNone) {
  phi::MeasurementMap map{phi::PlaneMap(3, 1), {}};
  map.planes(0, 0) = {{0, 0, -1}, -2};
  map.planes(1, 0) = {{0, 0, -1}, std::numeric_limits<float>::infinity()};
  map.planes(2, 0) = {{0, 0, 0}, 3};
  const phi::MeasurementMap rounded = RoundToCompact(map);
  EXPECT_EQ(rounded.planes(0, 0).depth, 0);
  EXPECT_EQ(rounded.planes(1, 0).depth, 0);
  EXPECT_EQ(rounded.planes(2, 0).depth, 3);
  EXPECT_NEAR(phi::Norm(rounded.planes(2, 0).normal), 1, 1e-6) << "a unit vector, whichever";
}

TEST(CompactMap, TakesFiveBytesAPixelOfNoise) {
  std::mt19937 random(7);
  phi::MeasurementMap map{phi::PlaneMap(512, 512), {}};
  for (std::size_t i = 0; i < map.size(); ++i) {
    phi::Vec3f normal = RandomNormal(&random);
    normal.z = -std::abs(normal.z);
    map.planes.data()[i] = {normal, 1 + static_cast<float>(random() % 100000) * 1e-4f};
  }
  EXPECT_LT(static_cast<double>(EncodeCompactMap(RoundToCompact(map)).size()) / static_cast<double>(map.size()), 5.03);
}

TEST(CompactMap, FilesComeBackAndDamagedOnesAreErrors) {
  const test_support::TemporaryFolder folder;
  const phi::MeasurementMap rounded = RoundToCompact(RandomMap(5, true, 3));
  PrepareCompactMap(folder / "a.map", rounded)->Commit();
  EXPECT_TRUE(SameBits(ReadCompactMap(folder / "a.map"), rounded));
  EXPECT_EQ(ReadCompactMapSize(folder / "a.map").width, 53);
  EXPECT_EQ(ReadCompactMapSize(folder / "a.map").height, 37);
  const std::vector<std::uint8_t> bytes = EncodeCompactMap(rounded);
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 97)
    EXPECT_TRUE(IsRefused({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)})) << size;
  EXPECT_TRUE(IsRefused(std::vector<std::uint8_t>(bytes.size())));
  // A changed byte may give another map, and never more than an error.
  std::mt19937 random(5);
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[random() % damaged.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
    try {
      DecodeCompactMap(damaged, "that map");
    } catch (const phi::InputError&) {
    }
  }
  EXPECT_THAT(test_support::InputErrorOf([&] { ReadCompactMap(folder / "none.map"); }), testing::HasSubstr("none.map"));
}

// What no writer writes, and who reads it would take for depths, directions or states.
TEST(CompactMap, ValuesThatNoMapHasAreErrors) {
  // The header, then the least bits and the steps of 4 x 3 blocks, then depths and normals, of which nothing can be compressed.
  constexpr std::size_t kHasStatesAt = 16, kPlaneSizesAt = 20, kScalesAt = 44, kPlanesAt = kScalesAt + 12 * 5, kPlaneBytes = 53 * 37;
  phi::MeasurementMap map{phi::PlaneMap(53, 37), phi::StateMap(53, 37, PixelState::kMeasured)};
  std::mt19937 random(1);
  for (phi::PlaneHypothesis& plane : map.planes)
    plane = {RandomNormal(&random), 1 + static_cast<float>(random() % 100000) * 1e-5f};
  const std::vector<std::uint8_t> bytes = EncodeCompactMap(RoundToCompact(map));
  for (std::size_t plane = 0; plane < 5; ++plane) {
    std::int32_t size = 0;
    std::memcpy(&size, bytes.data() + kPlaneSizesAt + 4 * plane, 4);
    ASSERT_EQ(size, kPlaneBytes) << plane;
  }
  const auto refuses = [&](std::size_t at, const std::vector<std::uint8_t>& values) {
    std::vector<std::uint8_t> damaged = bytes;
    std::copy(values.begin(), values.end(), damaged.begin() + static_cast<std::ptrdiff_t>(at));
    return IsRefused(damaged);
  };
  ASSERT_FALSE(refuses(0, {}));
  EXPECT_TRUE(refuses(kHasStatesAt, {2})) << "neither with states nor without";
  for (const std::uint8_t least : {0, 1})
    EXPECT_TRUE(refuses(kScalesAt, {least, 0, 0, 0})) << "depths smaller than any normal float";
  EXPECT_TRUE(refuses(kScalesAt, {0, 0, 0x80, 0x7F})) << "infinite depths";
  EXPECT_TRUE(refuses(kScalesAt, {0xFF, 0xFF, 0xFF, 0xFF})) << "no depths at all";
  for (const std::size_t axis : {0, 1}) {  // 4095: beside the octahedron, which ends at 4094
    std::vector<std::uint8_t> damaged = bytes;
    damaged[kPlanesAt + (2 + axis) * kPlaneBytes] = 0xFF;
    damaged[kPlanesAt + 4 * kPlaneBytes] |= static_cast<std::uint8_t>(axis == 0 ? 0x0F : 0xF0);
    EXPECT_TRUE(IsRefused(damaged)) << axis;
  }
}

TEST(CompactMap, APixelWithDepthAndNoStateIsAnError) {
  const phi::MeasurementMap map{phi::PlaneMap(1, 1, {{0, 0, -1}, 2}), phi::StateMap(1, 1, PixelState::kClue)};
  std::vector<std::uint8_t> bytes = EncodeCompactMap(RoundToCompact(map));
  ASSERT_EQ(bytes.back(), static_cast<std::uint8_t>(PixelState::kClue));
  bytes.back() = static_cast<std::uint8_t>(PixelState::kNone);
  EXPECT_TRUE(IsRefused(bytes));
}

// Such a file would otherwise be read whole before it is looked at.
TEST(CompactMap, TheSizeTellsOfAFileThatIsNoSuchMap) {
  const test_support::TemporaryFolder folder;
  PrepareCompactMap(folder / "a.map", RoundToCompact(RandomMap(5, true, 3)))->Commit();
  const auto num_bytes = std::filesystem::file_size(folder / "a.map");
  for (const std::uintmax_t size : {num_bytes - 1, num_bytes + 1, std::uintmax_t{1} << 30}) {
    std::filesystem::resize_file(folder / "a.map", size);  // takes no place on the disk
    EXPECT_THAT(test_support::InputErrorOf([&] { ReadCompactMapSize(folder / "a.map"); }), testing::HasSubstr("a.map"));
    EXPECT_THAT(test_support::InputErrorOf([&] { ReadCompactMap(folder / "a.map"); }), testing::HasSubstr("a.map"));
  }
}

}  // namespace
}  // namespace colmap_ext
