#include "colmap_ext/map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_message.h"
#include "tests/support/golden_bytes.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::GoldenBytes;
using test_support::InputErrorOf;
using test_support::ReadBytes;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string GoldenDepth() {
  return GoldenBytes().Text("3&2&1&").F32(1).F32(2).F32(3).F32(4).F32(0).F32(-1.5f).bytes();
}

// Two pixels: normals (0, 0, -1) and (0.6, 0, -0.8), channel after channel.
std::string GoldenNormals() {
  return GoldenBytes().Text("2&1&3&").F32(0).F32(0.6f).F32(0).F32(0).F32(-1).F32(-0.8f).bytes();
}

TEST(MapFileTest, DepthMapHasTheExactBytes) {
  TemporaryFolder folder;
  phi::Array2D<float> depth(3, 2);
  depth(0, 0) = 1, depth(1, 0) = 2, depth(2, 0) = 3, depth(0, 1) = 4, depth(1, 1) = 0, depth(2, 1) = -1.5f;
  WriteDepthMap(folder / "sub/d.bin", depth);
  EXPECT_EQ(ReadBytes(folder / "sub/d.bin"), GoldenDepth());
}

TEST(MapFileTest, NormalMapHasTheExactBytes) {
  TemporaryFolder folder;
  phi::Array2D<phi::Vec3f> normals(2, 1);
  normals(0, 0) = {0, 0, -1};
  normals(1, 0) = {0.6f, 0, -0.8f};
  WriteNormalMap(folder / "n.bin", normals);
  EXPECT_EQ(ReadBytes(folder / "n.bin"), GoldenNormals());
}

TEST(MapFileTest, PlaneMapIsItsDepthAndNormalMap) {
  TemporaryFolder folder;
  phi::PlaneMap map(2, 1);
  map(0, 0) = {{0, 0, -1}, 5};
  map(1, 0) = {{0.6f, 0, -0.8f}, 7};
  WritePlaneMap(folder / "d.bin", folder / "n.bin", map);
  EXPECT_EQ(ReadBytes(folder / "d.bin"), GoldenBytes().Text("2&1&1&").F32(5).F32(7).bytes());
  EXPECT_EQ(ReadBytes(folder / "n.bin"), GoldenNormals());
  const phi::PlaneMap read = ReadPlaneMap(folder / "d.bin", folder / "n.bin");
  EXPECT_EQ(read(1, 0).depth, 7);
  EXPECT_EQ(read(1, 0).normal.x, 0.6f);
  EXPECT_EQ(read(1, 0).normal.z, -0.8f);
  EXPECT_EQ(read(0, 0).normal.z, -1);
}

TEST(MapFileTest, ReadsWhatTheBytesSay) {
  TemporaryFolder folder;
  WriteBytes(folder / "d.bin", GoldenDepth());
  const phi::Array2D<float> depth = ReadDepthMap(folder / "d.bin");
  ASSERT_EQ(depth.width(), 3);
  ASSERT_EQ(depth.height(), 2);
  EXPECT_EQ(depth(2, 0), 3);
  EXPECT_EQ(depth(2, 1), -1.5f);
  WriteBytes(folder / "n.bin", GoldenNormals());
  EXPECT_EQ(ReadNormalMap(folder / "n.bin")(1, 0).x, 0.6f);
  const MapSize size = ReadMapSize(folder / "n.bin");
  EXPECT_EQ(size.width, 2);
  EXPECT_EQ(size.height, 1);
  EXPECT_EQ(size.channels, 3);
}

// 7 x 5 pixels become 4 x 3: column x is the one at (x + 0.5) 7 / 4 = 0.9, 2.6, 4.4, 6.1, row y at 0.8, 2.5, 4.2.
TEST(MapFileTest, ThinnedMapsAreTheNearestPixels) {
  TemporaryFolder folder;
  phi::Array2D<float> depth(7, 5);
  phi::Array2D<phi::Vec3f> normals(7, 5);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 7; ++x) {
      depth(x, y) = static_cast<float>(10 * y + x);
      normals(x, y) = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(x * y)};
    }
  }
  WriteDepthMap(folder / "d.bin", depth);
  WriteNormalMap(folder / "n.bin", normals);
  const phi::Array2D<float> thinned = ReadThinnedDepthMap(folder / "d.bin", 4);
  const phi::Array2D<phi::Vec3f> thinned_normals = ReadThinnedNormalMap(folder / "n.bin", 4);
  ASSERT_EQ(thinned.width(), 4);
  ASSERT_EQ(thinned.height(), 3);
  ASSERT_EQ(thinned_normals.width(), 4);
  const int columns[] = {0, 2, 4, 6}, rows[] = {0, 2, 4};
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) {
      EXPECT_EQ(thinned(x, y), 10 * rows[y] + columns[x]);
      EXPECT_EQ(thinned_normals(x, y).x, columns[x]);
      EXPECT_EQ(thinned_normals(x, y).y, rows[y]);
      EXPECT_EQ(thinned_normals(x, y).z, columns[x] * rows[y]);
    }
  }
  EXPECT_EQ(ReadThinnedDepthMap(folder / "d.bin", 100).width(), 7) << "none grows";
  EXPECT_THAT(InputErrorOf([&] { ReadThinnedNormalMap(folder / "d.bin", 4); }), HasSubstr("normal map has 3"));
}

TEST(MapFileTest, SomeRowsAreWholeAndEvenlyOverTheHeight) {
  TemporaryFolder folder;
  phi::Array2D<float> depth(7, 5);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 7; ++x) depth(x, y) = static_cast<float>(10 * y + x);
  }
  WriteDepthMap(folder / "d.bin", depth);
  const auto [rows, map_height] = ReadDepthRows(folder / "d.bin", 2);
  EXPECT_EQ(map_height, 5);
  ASSERT_EQ(rows.width(), 7);
  ASSERT_EQ(rows.height(), 2);
  for (int x = 0; x < 7; ++x) {
    EXPECT_EQ(rows(x, 0), 10 + x);
    EXPECT_EQ(rows(x, 1), 30 + x);
  }
  const phi::Array2D<float> all = ReadDepthRows(folder / "d.bin", 5).depths;
  EXPECT_TRUE(std::equal(all.begin(), all.end(), depth.begin(), depth.end()));
}

TEST(MapFileTest, EveryOtherLengthIsAnInputErrorThatNamesTheFile) {
  TemporaryFolder folder;
  const std::string whole = GoldenDepth();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    WriteBytes(folder / "d.bin", whole.substr(0, length));
    ASSERT_THAT(InputErrorOf([&] { ReadDepthMap(folder / "d.bin"); }), HasSubstr("d.bin")) << length;
    ASSERT_THAT(InputErrorOf([&] { ReadMapSize(folder / "d.bin"); }), HasSubstr("d.bin")) << length;
  }
  WriteBytes(folder / "d.bin", whole + "x");
  EXPECT_THAT(InputErrorOf([&] { ReadDepthMap(folder / "d.bin"); }),
              AllOf(HasSubstr("has 31 bytes"), HasSubstr("3x2x1, that is 30 bytes")));
}

TEST(MapFileTest, RefusesForeignAndAbsurdHeaders) {
  TemporaryFolder folder;
  for (const char* header : {"PNG", "3&2&", "-3&2&1&", "0&2&1&", "3,2,1,", "3&2&1.5&",
                             "99999999999999999999&1&1&", "2000000000&2000000000&1&", " 3&2&1&", "3&2&1"}) {
    WriteBytes(folder / "d.bin", header + std::string(24, '\0'));
    EXPECT_THAT(InputErrorOf([&] { ReadDepthMap(folder / "d.bin"); }), HasSubstr("no COLMAP map")) << header;
  }
}

TEST(MapFileTest, RefusesTheWrongKindOfMap) {
  TemporaryFolder folder;
  WriteBytes(folder / "d.bin", GoldenDepth());
  WriteBytes(folder / "n.bin", GoldenNormals());
  EXPECT_THAT(InputErrorOf([&] { ReadDepthMap(folder / "n.bin"); }), HasSubstr("2x1x3"));
  EXPECT_THAT(InputErrorOf([&] { ReadNormalMap(folder / "d.bin"); }), HasSubstr("3x2x1"));
  EXPECT_THAT(InputErrorOf([&] { ReadPlaneMap(folder / "d.bin", folder / "n.bin"); }),
              AllOf(HasSubstr("n.bin"), HasSubstr("d.bin"), HasSubstr("3x2x1")));
  EXPECT_THAT(InputErrorOf([&] { ReadDepthMap(folder / "none.bin"); }), HasSubstr("none.bin"));
}

// Read in blocks of rows, of which the last is not full.
TEST(MapFileTest, RowsAreThoseOfTheMap) {
  const test_support::TemporaryFolder folder;
  phi::PlaneMap map(3, 70);
  for (int y = 0; y < 70; ++y) {
    for (int x = 0; x < 3; ++x) map(x, y) = {{0.25f * x, 0.5f * y, -1.0f * (x + y)}, 1.0f + 10 * y + x};
  }
  WritePlaneMap(folder / "depth.bin", folder / "normal.bin", map);
  int next = 0;
  const auto check = [&](int y, const PlaneRow& row) {
    ASSERT_EQ(y, next++);
    for (int x = 0; x < 3; ++x) {
      ASSERT_EQ(row.depth[x], 1 + 10 * y + x);
      ASSERT_EQ(row.normal[0][x], 0.25f * x);
      ASSERT_EQ(row.normal[1][x], 0.5f * y);
      ASSERT_EQ(row.normal[2][x], -1.0f * (x + y));
    }
  };
  ReadPlaneRows(folder / "depth.bin", folder / "normal.bin", check);
  EXPECT_EQ(next, 70);
  next = 11;
  ReadPlaneRows(folder / "depth.bin", folder / "normal.bin", check, {11, 45});
  EXPECT_EQ(next, 45);
  next = 60;
  ReadPlaneRows(folder / "depth.bin", folder / "normal.bin", check, {60, 90});
  EXPECT_EQ(next, 70);
}

}  // namespace
}  // namespace colmap_ext
