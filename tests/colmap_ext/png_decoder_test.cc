#include "colmap_ext/png_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include <png.h>

#include "tests/support/error_message.h"

namespace colmap_ext {
namespace {

using test_support::InputErrorOf;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

struct Kind {
  std::string name;
  int color_type, bits;
  bool is_interlaced = false, has_transparency = false;
  double gamma = 0;  // 0: not told
};

std::vector<Kind> AllKinds() {
  std::vector<Kind> kinds;
  const auto add = [&](const char* name, int color_type, std::initializer_list<int> all_bits) {
    for (const int bits : all_bits) {
      for (const bool is_interlaced : {false, true}) {
        for (const bool has_transparency : {false, true}) {
          for (const double gamma : {0.0, 0.45455, 1.0}) {
            if (has_transparency && (color_type & PNG_COLOR_MASK_ALPHA) != 0) continue;
            const std::string text = std::string(name) + std::to_string(bits) + (is_interlaced ? " interlaced" : "") +
                                     (has_transparency ? " tRNS" : "") + " gamma " + std::to_string(gamma);
            kinds.push_back({text, color_type, bits, is_interlaced, has_transparency, gamma});
          }
        }
      }
    }
  };
  add("gray ", PNG_COLOR_TYPE_GRAY, {1, 2, 4, 8, 16});
  add("palette ", PNG_COLOR_TYPE_PALETTE, {1, 2, 4, 8});
  add("RGB ", PNG_COLOR_TYPE_RGB, {8, 16});
  add("gray and alpha ", PNG_COLOR_TYPE_GRAY_ALPHA, {8, 16});
  add("RGBA ", PNG_COLOR_TYPE_RGB_ALPHA, {8, 16});
  return kinds;
}

constexpr int kWidth = 61, kHeight = 43;

// Waves, in every bit.
PhotoFile Encode(const Kind& kind) {
  PhotoFile photo{kind.name, {}};
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  const auto write = [](png_structp to, png_bytep bytes, std::size_t count) {
    auto& all = static_cast<PhotoFile*>(png_get_io_ptr(to))->bytes;
    all.insert(all.end(), bytes, bytes + count);
  };
  png_set_write_fn(png, &photo, write, [](png_structp) {});
  png_set_IHDR(png, info, kWidth, kHeight, kind.bits, kind.color_type, kind.is_interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  std::vector<png_color> palette;
  Bytes alphas;
  for (int i = 0; i < 1 << std::min(kind.bits, 8); ++i) {
    palette.push_back({static_cast<png_byte>(37 * i), static_cast<png_byte>(255 - 5 * i), static_cast<png_byte>(i * i)});
    alphas.push_back(static_cast<std::uint8_t>(80 * i));
  }
  png_color_16 transparent = {.index = 0, .red = 9, .green = 9, .blue = 9, .gray = 1};
  const bool has_palette = kind.color_type == PNG_COLOR_TYPE_PALETTE;
  if (has_palette) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  if (kind.has_transparency) {
    png_set_tRNS(png, info, has_palette ? alphas.data() : nullptr, has_palette ? static_cast<int>(alphas.size()) : 1, &transparent);
  }
  if (kind.gamma > 0) png_set_gAMA(png, info, kind.gamma);
  png_write_info(png, info);
  const std::size_t row_bytes = png_get_rowbytes(png, info);
  std::vector<Bytes> pixels(kHeight, Bytes(row_bytes));
  std::vector<png_bytep> rows;
  for (int y = 0; y < kHeight; ++y) {
    for (std::size_t x = 0; x < row_bytes; ++x) {
      pixels[y][x] = static_cast<std::uint8_t>((x * 3 + y * 7 + x * y / 9) % 256);
    }
    rows.push_back(pixels[y].data());
  }
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return photo;
}

template <typename Pixel>
void ExpectSame(const phi::Array2D<Pixel>& own, const cv::Mat& other, const std::string& name) {
  ASSERT_EQ(sizeof(Pixel), other.elemSize()) << name;
  ASSERT_EQ(own.width(), other.cols) << name;
  ASSERT_EQ(own.height(), other.rows) << name;
  EXPECT_TRUE(std::equal(own.begin(), own.end(), other.ptr<Pixel>())) << name;
}

TEST(PngDecoder, GivesTheBytesThatOpenCvGives) {
  for (const Kind& kind : AllKinds()) {
    const PhotoFile photo = Encode(kind);
    ExpectSame(DecodePngGray(photo, {}), cv::imdecode(photo.bytes, cv::IMREAD_GRAYSCALE), kind.name);
    cv::Mat color = cv::imdecode(photo.bytes, cv::IMREAD_COLOR);
    cv::cvtColor(color, color, cv::COLOR_BGR2RGB);
    ExpectSame(DecodePngColor(photo, {}), color, kind.name);
    EXPECT_EQ(PngPixelsOf(photo.bytes).bits, kind.bits) << kind.name;
    EXPECT_EQ(PngPixelsOf(photo.bytes).is_gray, kind.color_type == PNG_COLOR_TYPE_GRAY) << kind.name;
    if (kind.bits < 16) continue;
    ExpectSame(DecodePngGray16(photo, {}), cv::imdecode(photo.bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH), kind.name);
    const cv::Mat unchanged = cv::imdecode(photo.bytes, cv::IMREAD_UNCHANGED);
    if (PngPixelsOf(photo.bytes).is_gray) ExpectSame(DecodePngGray16(photo, {}), unchanged, kind.name);
  }
}

// Empty: it is taken.
std::string ProblemOf(const PhotoFile& photo) {
  testing::internal::CaptureStderr();
  std::string problem;
  try {
    DecodePngColor(photo, {});
    DecodePngGray(photo, {});
  } catch (const phi::InputError& error) {
    problem = error.what();
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << problem;
  return problem;
}

bool OpenCvTakes(const PhotoFile& photo) {
  testing::internal::CaptureStderr();
  const bool is_taken = !cv::imdecode(photo.bytes, cv::IMREAD_COLOR).empty();
  testing::internal::GetCapturedStderr();
  return is_taken;
}

TEST(PngDecoder, RefusesWhatIsCutShortAnywhere) {
  const PhotoFile whole = Encode({"photo.png", PNG_COLOR_TYPE_RGB, 8});
  for (std::size_t size = 8; size < whole.bytes.size(); size += 1 + whole.bytes.size() / 200) {
    const PhotoFile cut{whole.path, Bytes(whole.bytes.begin(), whole.bytes.begin() + static_cast<std::ptrdiff_t>(size))};
    EXPECT_EQ(ProblemOf(cut), "photo.png: this PNG is cut short; copy or undistort it again") << size;
  }
  EXPECT_EQ(ProblemOf(whole), "");
}

// A wrong bit is noticed by the checksum of its part; one in a part that holds no pixels does no harm.
TEST(PngDecoder, TakesOfDamagedOnesWhatOpenCvTakes) {
  const PhotoFile whole = Encode({.name = "photo.png", .color_type = PNG_COLOR_TYPE_RGB, .bits = 8, .gamma = 0.45455});
  int num_taken = 0, num_refused = 0;
  for (std::size_t at = 8; at < whole.bytes.size(); at += at < 100 ? 1 : 29) {
    PhotoFile damaged = whole;
    damaged.bytes[at] ^= 0x10;
    const std::string problem = ProblemOf(damaged);
    EXPECT_EQ(problem.empty(), OpenCvTakes(damaged)) << at << " " << problem;
    EXPECT_THAT(problem, testing::AnyOf("", HasSubstr("photo.png: this PNG "))) << at;
    ++(problem.empty() ? num_taken : num_refused);
  }
  EXPECT_GT(num_taken, 5);
  EXPECT_GT(num_refused, 50);
  PhotoFile damaged = whole;
  damaged.bytes[damaged.bytes.size() / 2] ^= 1;
  EXPECT_THAT(ProblemOf(damaged), HasSubstr("photo.png: this PNG is damaged (IDAT: "));
}

TEST(PngDecoder, AsksAboutTheSizeBeforeItDecodes) {
  PhotoFile photo = Encode({"photo.png", PNG_COLOR_TYPE_RGB, 8});
  photo.bytes.resize(40);
  struct Refused {};
  const auto refuse = [](std::size_t width, std::size_t height) {
    EXPECT_EQ(width, kWidth);
    EXPECT_EQ(height, kHeight);
    throw Refused();
  };
  EXPECT_THROW(DecodePngGray(photo, refuse), Refused);
  EXPECT_THROW(DecodePngColor(photo, refuse), Refused);
}

// 65535 x 65535 pixels in a file of 100 bytes.
TEST(PngDecoder, RefusesMorePixelsThanAnyPhotoHas) {
  PhotoFile photo = Encode({"photo.png", PNG_COLOR_TYPE_RGB, 8});
  for (const std::size_t at : {18, 19, 22, 23}) photo.bytes[at] = 0xFF;
  png_uint_32 sum = 0xFFFFFFFF;
  for (std::size_t at = 12; at < 29; ++at) {
    sum ^= photo.bytes[at];
    for (int bit = 0; bit < 8; ++bit) sum = (sum & 1) != 0 ? sum >> 1 ^ 0xEDB88320 : sum >> 1;
  }
  for (int i = 0; i < 4; ++i) photo.bytes[29 + i] = static_cast<std::uint8_t>(~sum >> (24 - 8 * i));
  EXPECT_EQ(ProblemOf(photo), "photo.png: this PNG has more pixels than any photo; copy or undistort it again");
}

}  // namespace
}  // namespace colmap_ext
