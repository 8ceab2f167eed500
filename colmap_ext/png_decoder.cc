#include "colmap_ext/png_decoder.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>
#include <vector>

#include <png.h>

#include "colmap_ext/refused_photo.h"

namespace colmap_ext {
namespace {

constexpr char kFormat[] = "PNG";

// Places in the file: its first chunk is the header.
constexpr std::size_t kWidth = 16, kHeight = 20, kBits = 24, kColorType = 25, kHeaderEnd = 26;

std::size_t BigEndian(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::size_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | bytes[i];
  return value;
}

enum class Wanted { kGray, kColor, kGray16 };

// libpng leaves at an error by longjmp, which passes destructors by: nothing in the functions that call it has one.
class Session {
 public:
  explicit Session(std::span<const std::uint8_t> bytes) : left_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, Leave, [](png_structp, png_const_charp) {});
    if (png_ == nullptr) throw std::bad_alloc();
    info_ = png_create_info_struct(png_);
    end_info_ = png_create_info_struct(png_);
  }
  ~Session() { png_destroy_read_struct(&png_, &info_, &end_info_); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  bool ReadHeader() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, this, Read);
    png_read_info(png_, info_);
    return true;
  }

  // And what lies behind them.
  bool ReadRows(Wanted wanted, png_bytepp rows, std::size_t row_bytes) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    Prepare(wanted);
    if (png_get_rowbytes(png_, info_) != row_bytes) png_error(png_, "rows of another length");
    png_read_image(png_, rows);
    png_read_end(png_, end_info_);
    return true;
  }

  std::size_t width() const { return png_get_image_width(png_, info_); }
  std::size_t height() const { return png_get_image_height(png_, info_); }

  // What ended the last call.
  std::string Problem() const { return is_cut_ ? "is cut short" : "is damaged (" + std::string(problem_) + ")"; }

 private:
  // OpenCV's calls, so that gray levels are the same.
  void Prepare(Wanted wanted) {
    const int color_type = png_get_color_type(png_, info_), bits = png_get_bit_depth(png_, info_);
    const bool has_colors = (color_type & PNG_COLOR_MASK_COLOR) != 0;
    if (wanted != Wanted::kGray16) {
      png_set_strip_16(png_);
    } else if (std::endian::native == std::endian::little) {
      png_set_swap(png_);
    }
    png_set_strip_alpha(png_);
    if (color_type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (!has_colors && bits < 8) png_set_expand_gray_1_2_4_to_8(png_);
    if (wanted != Wanted::kColor) {
      png_set_rgb_to_gray(png_, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
    } else if (!has_colors) {
      png_set_gray_to_rgb(png_);
    }
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
  }

  [[noreturn]] static void Leave(png_structp png, png_const_charp text) {
    auto& session = *static_cast<Session*>(png_get_error_ptr(png));
    std::snprintf(session.problem_, sizeof(session.problem_), "%s", text);
    png_longjmp(png, 1);
  }

  static void Read(png_structp png, png_bytep to, std::size_t count) {
    auto& session = *static_cast<Session*>(png_get_io_ptr(png));
    session.is_cut_ = count > session.left_.size();
    if (session.is_cut_) png_error(png, "");
    std::memcpy(to, session.left_.data(), count);
    session.left_ = session.left_.subspan(count);
  }

  std::span<const std::uint8_t> left_;  // of the file
  png_structp png_ = nullptr;
  png_infop info_ = nullptr, end_info_ = nullptr;
  bool is_cut_ = false;
  char problem_[128] = {};
};

template <typename Pixel>
phi::Array2D<Pixel> Decode(const PhotoFile& photo, Wanted wanted, const CheckSize& check_size) {
  if (check_size && photo.bytes.size() >= kHeaderEnd) check_size(BigEndian(photo.bytes, kWidth), BigEndian(photo.bytes, kHeight));
  Session session(photo.bytes);
  if (!session.ReadHeader()) RefusePhoto(photo, kFormat, session.Problem());
  RefuseTooManyPixels(photo, kFormat, session.width(), session.height());
  auto image = phi::Array2D<Pixel>::Uninitialized(static_cast<int>(session.width()), static_cast<int>(session.height()));
  std::vector<png_bytep> rows;
  for (int y = 0; y < image.height(); ++y) rows.push_back(reinterpret_cast<png_bytep>(&image(0, y)));
  if (!session.ReadRows(wanted, rows.data(), session.width() * sizeof(Pixel))) RefusePhoto(photo, kFormat, session.Problem());
  return image;
}

}  // namespace

bool IsPng(std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  return bytes.size() >= sizeof(kSignature) && std::equal(std::begin(kSignature), std::end(kSignature), bytes.begin());
}

PngPixels PngPixelsOf(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kHeaderEnd) return {};
  return {.bits = bytes[kBits], .is_gray = bytes[kColorType] == PNG_COLOR_TYPE_GRAY};
}

phi::GrayImage DecodePngGray(const PhotoFile& photo, const CheckSize& check_size) {
  return Decode<std::uint8_t>(photo, Wanted::kGray, check_size);
}

ColorImage DecodePngColor(const PhotoFile& photo, const CheckSize& check_size) {
  return Decode<Rgb>(photo, Wanted::kColor, check_size);
}

phi::Array2D<std::uint16_t> DecodePngGray16(const PhotoFile& photo, const CheckSize& check_size) {
  return Decode<std::uint16_t>(photo, Wanted::kGray16, check_size);
}

}  // namespace colmap_ext
