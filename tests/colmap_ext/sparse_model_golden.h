// The bytes of SmallModel()'s files, written out from COLMAP's format description.
#pragma once

#include <string>

#include "tests/support/golden_bytes.h"

namespace colmap_ext {

inline std::string GoldenCamerasBin() {
  return test_support::GoldenBytes()
      .U64(2)
      .U32(1).U32(1).U64(32).U64(24).F64(30).F64(31).F64(16).F64(12)
      .U32(4).U32(0).U64(20).U64(10).F64(25).F64(10).F64(5)
      .bytes();
}

inline std::string GoldenImagesBin() {
  const std::string end(1, '\0');
  const std::uint64_t no_point = 0xFFFFFFFFFFFFFFFFu;
  return test_support::GoldenBytes()
      .U64(3)
      .U32(7).F64(1).F64(0).F64(0).F64(0).F64(0.5).F64(-0.25).F64(2).U32(1).Text("a.png" + end)
      .U64(3).F64(1.5).F64(2.5).U64(11).F64(3.5).F64(4.5).U64(no_point).F64(5.5).F64(6.5).U64(12)
      .U32(3).F64(0.5).F64(-0.5).F64(0.5).F64(-0.5).F64(1).F64(2).F64(3).U32(1)
      .Text("sub folder/b \xC3\xA9.png" + end)
      .U64(1).F64(7.5).F64(8.5).U64(11)
      .U32(9).F64(0).F64(1).F64(0).F64(0).F64(0.5).F64(-0.25).F64(2).U32(4).Text("c.png" + end)
      .U64(0)
      .bytes();
}

inline std::string GoldenPointsBin() {
  return test_support::GoldenBytes()
      .U64(2)
      .U64(11).F64(1).F64(-2).F64(4).U8(10).U8(20).U8(255).F64(0.75).U64(2).U32(7).U32(0).U32(3).U32(0)
      .U64(12).F64(0.125).F64(8).F64(16).U8(0).U8(1).U8(2).F64(1.25).U64(1).U32(7).U32(2)
      .bytes();
}

inline std::string GoldenCamerasTxt() {
  return "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS...\n"
         "# Number of cameras: 2\n"
         "1 PINHOLE 32 24 30 31 16 12\n"
         "4 SIMPLE_PINHOLE 20 10 25 10 5\n";
}

inline std::string GoldenImagesTxt() {
  return "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, next line: (X Y POINT3D_ID)...\n"
         "# Number of images: 3\n"
         "7 1 0 0 0 0.5 -0.25 2 1 a.png\n"
         "1.5 2.5 11 3.5 4.5 -1 5.5 6.5 12\n"
         "3 0.5 -0.5 0.5 -0.5 1 2 3 1 sub folder/b \xC3\xA9.png\n"
         "7.5 8.5 11\n"
         "9 0 1 0 0 0.5 -0.25 2 4 c.png\n"
         "\n";
}

inline std::string GoldenPointsTxt() {
  return "# POINT3D_ID X Y Z R G B ERROR (IMAGE_ID OBSERVATION_INDEX)...\n"
         "# Number of points: 2\n"
         "11 1 -2 4 10 20 255 0.75 7 0 3 0\n"
         "12 0.125 8 16 0 1 2 1.25 7 2\n";
}

}  // namespace colmap_ext
