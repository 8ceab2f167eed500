// COLMAP's map files, photos, and pictures of maps.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <cstring>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "colmap_ext/colorize.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_file.h"
#include "phi/base/error.h"
#include "python/bindings/module.h"
#include "python/bindings/numpy_arrays.h"
#include "python/bindings/text_caster.h"

namespace nb = nanobind;

namespace phimvs_python {
namespace {

using Floats = Input<float>;

template <typename Map>
Map FromNumpy(const Floats& values) {
  Map map(static_cast<int>(values.shape(1)), static_cast<int>(values.shape(0)));
  std::memcpy(static_cast<void*>(map.data()), values.data(), map.bytes());
  return map;
}

std::tuple<int, int, int> MapSizeOf(const std::string& path) {
  const colmap_ext::MapSize size = colmap_ext::ReadMapSize(path);
  return {size.width, size.height, size.channels};
}

void WriteMap(const std::string& path, const Floats& values) {
  const nb::gil_scoped_release release;
  if (values.ndim() == 2) {
    colmap_ext::WriteDepthMap(path, FromNumpy<phi::Array2D<float>>(values));
  } else {
    colmap_ext::WriteNormalMap(path, FromNumpy<phi::Array2D<phi::Vec3f>>(values));
  }
}

template <typename Image>
std::vector<std::uint8_t> BytesOf(const Image& image) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(image.data());
  return {bytes, bytes + image.bytes()};
}

// The photo's stored pixels, as the commands see them.
Output<std::uint8_t> ReadImage(const std::string& path, bool color) {
  std::vector<std::uint8_t> bytes;
  std::vector<std::size_t> shape;
  {
    const nb::gil_scoped_release release;
    const auto take = [&](const auto& image) {
      bytes = BytesOf(image);
      shape = {static_cast<std::size_t>(image.height()), static_cast<std::size_t>(image.width())};
    };
    if (color) {
      take(colmap_ext::ReadColorImage(path));
      shape.push_back(3);
    } else {
      take(colmap_ext::ReadGrayImage(path));
    }
  }
  return MakeOutput(std::move(bytes), std::move(shape));
}

Output<std::uint8_t> Colorize(const Floats& values, const std::string& kind,
                              std::optional<std::pair<float, float>> range) {
  colmap_ext::ColorImage picture;
  {
    const nb::gil_scoped_release release;
    if (kind == "normal") {
      picture = colmap_ext::ColorizeNormals(FromNumpy<phi::Array2D<phi::Vec3f>>(values));
    } else {
      const auto map = FromNumpy<phi::Array2D<float>>(values);
      const auto chosen = [&](const colmap_ext::ValueRange& otherwise) {
        return range ? colmap_ext::ValueRange{range->first, range->second} : otherwise;
      };
      picture = kind == "cost" ? colmap_ext::ColorizeCost(map, chosen({0, 2}))
                               : colmap_ext::ColorizeDepth(map, chosen(colmap_ext::RobustRange(map)));
    }
  }
  return MakeOutput(BytesOf(picture),
                    {static_cast<std::size_t>(picture.height()), static_cast<std::size_t>(picture.width()), 3});
}

}  // namespace

void BindMaps(nb::module_& module) {
  module.def("map_size", &MapSizeOf);
  module.def("write_map", &WriteMap);
  module.def("read_image", &ReadImage);
  module.def("colorize", &Colorize, nb::arg("values"), nb::arg("kind"), nb::arg("range").none());
}

}  // namespace phimvs_python
